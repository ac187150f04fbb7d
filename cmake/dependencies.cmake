# Where a dependency comes from: the parent project's target, else an installed package, else its repository
# at the tag below. With FETCHCONTENT_SOURCE_DIR_<NAME> a local copy stands in for the repository.
include(FetchContent)

# Fetches a header-only library. Its own build system stays out of ours (SOURCE_SUBDIR names a folder that
# does not exist): its options, flags, tests and install rules would become the parent's. Like an installed
# package, an imported target gives its headers as system headers.
function(globalmatch_fetch_headers name target repository tag include_dir)
  message(STATUS "globalmatch: ${name} is not installed, fetching ${repository} ${tag}")
  FetchContent_Declare(
    ${name}
    GIT_REPOSITORY ${repository}
    GIT_TAG ${tag}
    GIT_SHALLOW ON
    SOURCE_SUBDIR headers-only)
  FetchContent_MakeAvailable(${name})
  string(TOLOWER ${name} lower_name)
  add_library(${target} INTERFACE IMPORTED GLOBAL)
  target_include_directories(${target} INTERFACE ${${lower_name}_SOURCE_DIR}/${include_dir})
endfunction()

# A macro, so that what a found package sets (a module path, for one) reaches the caller.
macro(globalmatch_require name target version repository tag include_dir)
  if(NOT TARGET ${target})
    find_package(${name} ${version} QUIET CONFIG)
  endif()
  if(NOT TARGET ${target})
    globalmatch_fetch_headers(${name} ${target} ${repository} ${tag} ${include_dir})
  endif()
endmacro()

# What the headers need. A parent that has its own way of finding threads may have done so already.
if(NOT TARGET Threads::Threads)
  set(THREADS_PREFER_PTHREAD_FLAG ON)
  find_package(Threads REQUIRED)
endif()
globalmatch_require(Eigen3 Eigen3::Eigen 3.4 https://gitlab.com/libeigen/eigen.git 3.4.0 .)
globalmatch_require(nanoflann nanoflann::nanoflann 1.4 https://github.com/jlblancoc/nanoflann.git v1.4.3
                    include)

# What the programs built here need besides.
if(GLOBALMATCH_BUILD_EXAMPLES OR GLOBALMATCH_BUILD_TESTS OR GLOBALMATCH_BUILD_BENCHMARKS)
  globalmatch_require(CLI11 CLI11::CLI11 2.1 https://github.com/CLIUtils/CLI11.git v2.1.2 include)
  globalmatch_require(nlohmann_json nlohmann_json::nlohmann_json 3.10
                      https://github.com/nlohmann/json.git v3.11.2 single_include)
  globalmatch_require(pugixml pugixml::pugixml 1.10 https://github.com/zeux/pugixml.git v1.13 src)
  FetchContent_GetProperties(pugixml)
  if(pugixml_POPULATED) # its repository serves as headers alone, too
    target_compile_definitions(pugixml::pugixml INTERFACE PUGIXML_HEADER_ONLY)
  endif()
endif()

# Embree casts the simulator's rays. It is too large to be fetched: without it, the simulator is left out.
set(GLOBALMATCH_HAS_EMBREE OFF)
if(GLOBALMATCH_BUILD_EXAMPLES OR GLOBALMATCH_BUILD_TESTS OR GLOBALMATCH_BUILD_BENCHMARKS)
  find_package(embree QUIET CONFIG)
  if(embree_FOUND AND EMBREE_VERSION VERSION_GREATER_EQUAL 3.8)
    set(GLOBALMATCH_HAS_EMBREE ON)
    add_library(globalmatch_embree INTERFACE IMPORTED)
    target_include_directories(globalmatch_embree INTERFACE ${EMBREE_INCLUDE_DIRS})
    target_link_libraries(globalmatch_embree INTERFACE ${EMBREE_LIBRARIES})
    # The headers of Embree 3 and 4 may lie side by side in one folder.
    target_compile_definitions(globalmatch_embree INTERFACE GLOBALMATCH_EMBREE_MAJOR=${EMBREE_VERSION_MAJOR})
  else()
    message(STATUS "globalmatch: Embree 3 or 4 is not installed (Debian: libembree-dev); "
                   "simulate_plot and the tests of the simulator are left out")
  endif()
endif()

if(GLOBALMATCH_BUILD_TESTS)
  globalmatch_require(Catch2 Catch2::Catch2 "" https://github.com/catchorg/Catch2.git v2.13.10 single_include)
  FetchContent_GetProperties(Catch2)
  if(catch2_POPULATED) # catch_discover_tests comes from there too
    list(APPEND CMAKE_MODULE_PATH ${catch2_SOURCE_DIR}/contrib)
  endif()
endif()

if(GLOBALMATCH_BUILD_BENCHMARKS AND NOT TARGET benchmark::benchmark)
  find_package(benchmark QUIET CONFIG)
  if(NOT benchmark_FOUND)
    FetchContent_Declare(
      benchmark
      GIT_REPOSITORY https://github.com/google/benchmark.git
      GIT_TAG v1.7.1
      GIT_SHALLOW ON)
    set(BENCHMARK_ENABLE_TESTING OFF)
    set(BENCHMARK_ENABLE_INSTALL OFF)
    FetchContent_MakeAvailable(benchmark)
    target_compile_options(benchmark PRIVATE -w) # our warnings are not meant for it
  endif()
endif()
