# The headers, the package behind find_package(globalmatch CONFIG), and the one behind pkg-config.
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

set(package_dir ${CMAKE_INSTALL_DATADIR}/cmake/globalmatch)
set(package_build_dir ${CMAKE_CURRENT_BINARY_DIR}/package)

configure_package_config_file(cmake/globalmatchConfig.cmake.in ${package_build_dir}/globalmatchConfig.cmake
                              INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${package_build_dir}/globalmatchConfigVersion.cmake
                                 COMPATIBILITY SameMinorVersion ARCH_INDEPENDENT)

install(DIRECTORY include/globalmatch DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.hpp")
install(TARGETS globalmatch EXPORT globalmatchTargets INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(EXPORT globalmatchTargets NAMESPACE globalmatch:: DESTINATION ${package_dir})
install(FILES ${package_build_dir}/globalmatchConfig.cmake ${package_build_dir}/globalmatchConfigVersion.cmake
        DESTINATION ${package_dir})
configure_file(cmake/globalmatch.pc.in ${package_build_dir}/globalmatch.pc @ONLY)
install(FILES ${package_build_dir}/globalmatch.pc DESTINATION ${CMAKE_INSTALL_DATADIR}/pkgconfig)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
