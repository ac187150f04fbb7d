// Voxel grid ([GM] 3.1): one point for each occupied voxel, the one nearest the centroid of the voxel's
// points.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <vector>

#include "globalmatch/detail/core/local_points.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/points.hpp"

namespace globalmatch::detail {

/// A point and the voxel it lies in.
struct voxel_member {
  std::array<double, 3> voxel;
  point_index index;
  bool operator<(const voxel_member& other) const {
    return voxel != other.voxel ? voxel < other.voxel : index < other.index;
  }
};

/// Of each voxel the member nearest to the centroid. `members` holds all members of whole voxels, in any
/// order.
inline void keep_nearest_to_centroids(const local_points& points, std::vector<voxel_member>& members,
                                      std::vector<point_index>& kept) {
  std::sort(members.begin(), members.end());
  for (std::size_t begin = 0, end = 0; begin < members.size(); begin = end) {
    vec3 sum = vec3{};
    for (end = begin; end < members.size() && members[end].voxel == members[begin].voxel; ++end)
      sum += vec3(points[members[end].index]);
    const vec3 centroid = sum / double(end - begin);
    point_index nearest = 0;
    double min_squared_distance = std::numeric_limits<double>::infinity();
    for (std::size_t k = begin; k < end; ++k) {
      const double squared_distance = (vec3(points[members[k].index]) - centroid).squared_norm();
      if (squared_distance < min_squared_distance) {
        min_squared_distance = squared_distance;
        nearest = members[k].index;
      }
    }
    kept.push_back(nearest);
  }
}

/// Positions in `points` of the points that stay, in increasing order. `voxel_size` in metres. Of points
/// equally near the centroid (mean) of a voxel the first one stays. Throws `std::invalid_argument` when
/// `voxel_size` is not positive, and `operation_cancelled`. Cost: linear in the points; parallel.
inline std::vector<point_index> thin_by_voxels(const local_points& points, double voxel_size,
                                               const execution& exec = {}) {
  if (!(voxel_size > 0)) throw std::invalid_argument("voxel_size must be positive");
  // Voxels are dealt out to as many parts as there are, and each part is sorted alone.
  constexpr std::size_t points_a_part = 8192;
  const std::size_t parts = points.size() / points_a_part + 1;
  const auto last_part = static_cast<std::uint32_t>(parts - 1);
  const auto voxel_of = [&](std::size_t i) {
    const auto cell = [&](float v) { return std::floor(double(v) / voxel_size); };
    return std::array{cell(points.x[i]), cell(points.y[i]), cell(points.z[i])};
  };
  std::vector<std::uint32_t> part_of(points.size());
  parallel_for(exec, "voxels", points.size(), [&](std::size_t i) {
    const auto [x, y, z] = voxel_of(i);
    const double mixed = x * 0.6180339887498949 + y * 0.7548776662466927 + z * 0.8191725133961645;
    const double share = mixed - std::floor(mixed);  // not a number for voxels smaller than numbers tell
    if (share < 1) part_of[i] = std::min(static_cast<std::uint32_t>(share * double(parts)), last_part);
  });
  std::vector<std::uint32_t> first(parts + 1), members(points.size());
  for (const std::uint32_t part : part_of) ++first[part + 1];
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<std::uint32_t> place(first.begin(), first.end() - 1);
  for (std::size_t i = 0; i < points.size(); ++i)
    members[place[part_of[i]]++] = static_cast<std::uint32_t>(i);

  std::vector<std::vector<point_index>> kept_of(parts);
  parallel_for(
      exec, "voxels", parts,
      [&](std::size_t part) {
        std::vector<voxel_member> own;
        own.reserve(first[part + 1] - first[part]);
        for (std::uint32_t k = first[part]; k < first[part + 1]; ++k)
          own.push_back({voxel_of(members[k]), members[k]});
        keep_nearest_to_centroids(points, own, kept_of[part]);
      },
      1);
  std::vector<point_index> kept;
  for (const auto& own : kept_of) kept.insert(kept.end(), own.begin(), own.end());
  std::sort(kept.begin(), kept.end());
  return kept;
}

}  // namespace globalmatch::detail
