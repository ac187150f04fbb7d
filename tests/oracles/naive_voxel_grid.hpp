// A voxel grid with one list of points a voxel: the oracle of `thin_by_voxels`.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "globalmatch/points.hpp"

namespace globalmatch::oracles {

/// Indices of the points nearest to the mean of their voxel's points, increasing. `corner` is one of a voxel.
inline std::vector<point_index> naive_voxel_grid(const std::vector<Eigen::Vector3f>& points,
                                                 double voxel_size, const Eigen::Vector3d& corner) {
  std::map<std::array<double, 3>, std::vector<point_index>> voxels;
  for (point_index i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d cell = ((points[i].cast<double>() - corner) / voxel_size).array().floor();
    voxels[{cell.x(), cell.y(), cell.z()}].push_back(i);
  }
  std::vector<point_index> kept;
  for (const auto& [cell, members] : voxels) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const point_index i : members) mean += points[i].cast<double>() / double(members.size());
    const auto distance = [&, mean = mean](point_index i) {
      return (points[i].cast<double>() - mean).norm();
    };
    kept.push_back(*std::min_element(members.begin(), members.end(), [&](point_index a, point_index b) {
      return distance(a) < distance(b);
    }));
  }
  std::sort(kept.begin(), kept.end());
  return kept;
}

}  // namespace globalmatch::oracles
