// Points for a fine registration: on the ground and, thinned, on the stems. In: stems with their support and
// the terrain. Out: samples in the frame of the scan.
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "globalmatch/detail/core/local_points.hpp"
#include "globalmatch/detail/core/matrices.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/mapping/stem_cylinder.hpp"
#include "globalmatch/detail/mapping/stem_points.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

/// Of points sorted into cells the one nearest to the middle of each cell, in their order. Stems near a
/// scanner, which are dense, would outweigh the others in a fine registration.
inline std::vector<point_index> thin_in_cells(const local_points& sorted,
                                              const std::vector<point_index>& chosen) {
  constexpr double below = 1 << 24;  // cells are counted from far below: cutting the fraction off rounds down
  std::vector<point_index> kept;
  std::int32_t cell[3] = {-1, -1, -1};
  double minimum = 0;
  for (const point_index i : chosen) {
    const vec3 at = vec3(sorted[i]) * (1 / cell_width) + vec3{below, below, below};
    const std::int32_t own[3] = {std::int32_t(at.x), std::int32_t(at.y), std::int32_t(at.z)};
    const vec3 from_middle = at - vec3{double(own[0]), double(own[1]), double(own[2])} - vec3{0.5, 0.5, 0.5};
    const double squared = from_middle.squared_norm();
    const bool is_same = own[0] == cell[0] && own[1] == cell[1] && own[2] == cell[2];
    if (is_same && squared >= minimum) continue;
    if (!is_same) kept.emplace_back();
    kept.back() = i;
    for (int axis = 0; axis < 3; ++axis) cell[axis] = own[axis];
    minimum = squared;
  }
  return kept;
}

/// Adds the samples to a map.
inline void collect_samples(const std::vector<stem_cylinder>& stems, const local_points& understory,
                            stem_map& map, const execution& exec) {
  const local_frame& frame = map.terrain.frame;
  const auto& ground = map.terrain.ground;
  map.ground_samples.resize(ground.size());
  parallel_for(exec, "samples", ground.size(), [&](std::size_t i) {
    map.ground_samples[i] = frame.to_scan(vec3(ground[i])).as<Eigen::Vector3d>();
  });
  const mat3 scan_from_local = frame.rotation.transpose();
  std::vector<std::vector<point_index>> kept_of(stems.size());
  parallel_for(
      exec, "samples", stems.size(),
      [&](std::size_t k) { kept_of[k] = thin_in_cells(understory, stems[k].support); }, 4);
  std::vector<std::size_t> first = {0};
  for (const auto& kept : kept_of) first.push_back(first.back() + kept.size());
  map.stem_samples.resize(first.back());
  map.stem_normals.resize(first.back());
  parallel_for(
      exec, "samples", stems.size(),
      [&](std::size_t k) {
        const cylinder& c = stems[k].cylinder;
        std::size_t at = first[k];
        for (const point_index i : kept_of[k]) {
          const vec3 p(understory[i]), from_axis = p - c.point;
          const vec3 outward = from_axis - from_axis.dot(c.axis) * c.axis;
          map.stem_samples[at] = frame.to_scan(p).as<Eigen::Vector3d>();
          map.stem_normals[at] = (scan_from_local * outward.normalized()).as<Eigen::Vector3d>();
          ++at;
        }
      },
      4);
}

}  // namespace globalmatch::detail
