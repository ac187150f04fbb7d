// PCL's readers of PLY and PCD, if it is used.
#pragma once

#ifdef GLOBALMATCH_BENCHMARK_PCL
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_types.h>
#endif

#include <cstddef>
#include <filesystem>

namespace globalmatch::benchmarks {

#ifdef GLOBALMATCH_BENCHMARK_PCL

inline bool pcl_reads(const std::filesystem::path& file) {
  return file.extension() == ".ply" || file.extension() == ".pcd";
}

/// The number of points.
inline std::size_t read_by_pcl(const std::filesystem::path& file) {
  pcl::PointCloud<pcl::PointXYZ> cloud;
  const bool is_ply = file.extension() == ".ply";
  const int status =
      is_ply ? pcl::io::loadPLYFile(file.string(), cloud) : pcl::io::loadPCDFile(file.string(), cloud);
  return status < 0 ? 0 : cloud.size();
}

#else

inline bool pcl_reads(const std::filesystem::path&) {
  return false;
}

inline std::size_t read_by_pcl(const std::filesystem::path&) {
  return 0;
}

#endif

}  // namespace globalmatch::benchmarks
