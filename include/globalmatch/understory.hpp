// Understory ([GM] 3.1): the points between 0.2 m and 3 m above the terrain, in local coordinates.
// In: points of a scan (one pass) and its terrain. Out: `local_points` in the terrain's frame.
#pragma once

#include <cstddef>
#include <stdexcept>

#include "globalmatch/execution.hpp"
#include "globalmatch/local_points.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/terrain.hpp"

namespace globalmatch {

struct understory_options {
  double lowest = 0.2;   ///< [m] above the terrain ([GM] 3.1: 0.2)
  double highest = 3.0;  ///< [m] above the terrain ([GM] 3.1: 3)
};

/// Throws `std::invalid_argument` when the layer is empty by its limits.
inline void require_valid(const understory_options& options) {
  if (!(options.lowest < options.highest))
    throw std::invalid_argument("understory.lowest must be less than understory.highest");
}

/// Points of the scan in the understory layer; none where the terrain does not reach. One forward pass.
template <point_range R>
local_points select_understory(const R& scan, const terrain& ground, const understory_options& options = {},
                               const execution& how = {}) {
  require_valid(options);
  local_points understory;
  understory.frame = ground.frame;
  for_each_finite(scan, [&](const Eigen::Vector3d& p, point_index i) {
    if (i % (1u << 20) == 0) report_progress(how, "understory", 0);
    const Eigen::Vector3d local = ground.frame.to_local(p);
    if (!ground.covers(local.x(), local.y())) return;
    const double height = local.z() - ground.interpolated_height(local.x(), local.y());
    if (height >= options.lowest && height <= options.highest) understory.push_back(local.cast<float>(), i);
  });
  return understory;
}

}  // namespace globalmatch
