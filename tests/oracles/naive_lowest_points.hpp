// Lowest points with one map entry a cell: the oracle of `gather_lowest_points`.
#pragma once

#include <Eigen/Core>

#include <cmath>
#include <map>
#include <utility>
#include <vector>

namespace globalmatch::oracles {

/// The lowest of the finite points in each cell, by (column, row) of a raster whose corner is `corner`; the
/// first of equally low ones.
inline std::map<std::pair<int, int>, Eigen::Vector3d> naive_lowest_points(
    const std::vector<Eigen::Vector3d>& points, double resolution, const Eigen::Vector3d& corner) {
  std::map<std::pair<int, int>, Eigen::Vector3d> lowest;
  for (const Eigen::Vector3d& p : points) {
    if (!p.allFinite()) continue;
    const Eigen::Vector3d cell = ((p - corner) / resolution).array().floor();
    const auto [entry, is_new] = lowest.try_emplace({int(cell.x()), int(cell.y())}, p);
    if (p.z() < entry->second.z()) entry->second = p;
  }
  return lowest;
}

}  // namespace globalmatch::oracles
