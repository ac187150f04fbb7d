// Voxel grid ([GM] 3.1): one point for each occupied voxel, the one nearest the centroid of the voxel's
// points. Cost: O(n log n), from sorting.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "globalmatch/local_points.hpp"
#include "globalmatch/points.hpp"

namespace globalmatch {

/// Positions in `points` of the points that stay, in increasing order. `voxel_size` in metres. Of points
/// equally near the centroid (mean) of a voxel the first one stays. Throws `std::invalid_argument` when
/// `voxel_size` is not positive.
inline std::vector<point_index> thin_by_voxels(const local_points& points, double voxel_size) {
  if (!(voxel_size > 0)) throw std::invalid_argument("voxel_size must be positive");
  const auto cell = [&](float v) { return std::floor(double(v) / voxel_size); };
  std::vector<std::pair<std::array<double, 3>, point_index>> order(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    order[i] = {{cell(points.x[i]), cell(points.y[i]), cell(points.z[i])}, static_cast<point_index>(i)};
  std::sort(order.begin(), order.end());

  std::vector<point_index> kept;
  for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (end = begin; end < order.size() && order[end].first == order[begin].first; ++end)
      sum += points[order[end].second].cast<double>();
    const Eigen::Vector3d centroid = sum / double(end - begin);
    point_index nearest = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = begin; k < end; ++k) {
      const double squared_distance = (points[order[k].second].cast<double>() - centroid).squaredNorm();
      if (squared_distance < least) {
        least = squared_distance;
        nearest = order[k].second;
      }
    }
    kept.push_back(nearest);
  }
  std::sort(kept.begin(), kept.end());
  return kept;
}

/// The same for points of the caller's: indices into `points`; points that are not finite do not stay.
template <point_range R>
std::vector<point_index> thin_by_voxels(const R& points, double voxel_size) {
  const local_points local = import_points(points);
  std::vector<point_index> kept = thin_by_voxels(local, voxel_size);
  for (point_index& i : kept) i = local.index[i];
  return kept;
}

}  // namespace globalmatch
