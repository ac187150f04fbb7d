// Scans as PCL has them.
#pragma once

#include <globalmatch/points.hpp>

#include <pcl/filters/voxel_grid.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <map>
#include <utility>

namespace globalmatch::benchmarks {

using pcl_cloud = pcl::PointCloud<pcl::PointXYZ>;

/// The finite points of a scan, less `origin` [m].
template <point_range R>
pcl_cloud to_pcl(const R& scan, const detail::vec3& origin = {}) {
  pcl_cloud cloud;
  for (const auto& point : scan)
    if (const detail::vec3 p = xyz(point); is_finite(p))
      cloud.emplace_back(float(p.x - origin.x), float(p.y - origin.y), float(p.z - origin.z));
  return cloud;
}

/// One point a voxel, tile by tile: the numbers of PCL's voxels would overflow on a whole plot.
inline pcl_cloud::Ptr thinned_by_tiles(const pcl_cloud& points, float voxel) {
  constexpr float tile = 5;  // [m]
  std::map<std::pair<int, int>, pcl_cloud::Ptr> tiles;
  for (const pcl::PointXYZ& p : points) {
    pcl_cloud::Ptr& own = tiles[{int(p.x / tile), int(p.y / tile)}];
    if (!own) own = pcl::make_shared<pcl_cloud>();
    own->push_back(p);
  }
  const auto thinned = pcl::make_shared<pcl_cloud>();
  for (const auto& entry : tiles) {
    pcl_cloud kept;
    pcl::VoxelGrid<pcl::PointXYZ> grid;
    grid.setInputCloud(entry.second);
    grid.setLeafSize(voxel, voxel, voxel);
    grid.filter(kept);
    *thinned += kept;
  }
  return thinned;
}

}  // namespace globalmatch::benchmarks
