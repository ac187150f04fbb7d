// Understory ([GM] 3.1): the points between 0.2 m and 3 m above the terrain, in local coordinates.
// In: points of a scan (one pass) and its terrain. Out: `local_points` in the terrain's frame.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

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

namespace detail {

/// The heights between which each cell of a terrain raster may hold understory points: most points are told
/// by these, without interpolation.
class layer_limits {
 public:
  layer_limits(const terrain& ground, const understory_options& options) : ground_(ground) {
    limits_.resize(ground.heights.size());
    for (int r = 0; r < ground.rows; ++r)
      for (int c = 0; c < ground.columns; ++c) {
        limits l{std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity()};
        for (int dr = -1; dr <= 1; ++dr)  // heights in a cell lie between those of the nodes around
          for (int dc = -1; dc <= 1; ++dc) {
            const std::size_t node = ground.node(std::clamp(c + dc, 0, ground.columns - 1),
                                                 std::clamp(r + dr, 0, ground.rows - 1));
            l.lowest = std::min(l.lowest, ground.heights[node]);
            l.highest = std::max(l.highest, ground.heights[node]);
          }
        constexpr float rounding = 0.001f;  // [m]
        l.lowest += float(options.lowest) - rounding;
        l.highest += float(options.highest) + rounding;
        limits_[ground.node(c, r)] = l;
      }
  }

  /// False where (x, y, z) is certainly not between the limits. Requires that the terrain covers (x, y).
  bool may_hold(double x, double y, double z) const {
    const double per_cell = 1 / ground_.resolution;
    const int c = std::min(static_cast<int>(x * per_cell), ground_.columns - 1);
    const int r = std::min(static_cast<int>(y * per_cell), ground_.rows - 1);
    const limits& l = limits_[ground_.node(c, r)];
    return z >= l.lowest && z <= l.highest;
  }

 private:
  struct limits {
    float lowest, highest;
  };
  const terrain& ground_;
  std::vector<limits> limits_;
};

}  // namespace detail

inline namespace GLOBALMATCH_THREADING {

/// Points of the scan in the understory layer, in its order; none where the terrain does not reach. One
/// forward pass; parallel where the range gives random access.
template <point_range R>
local_points select_understory(const R& scan, const terrain& ground, const understory_options& options = {},
                               const execution& how = {}) {
  require_valid(options);
  local_points understory;
  understory.frame = ground.frame;
  if (ground.empty()) return understory;
  const detail::layer_limits limits(ground, options);
  std::vector<local_points> parts;
  read_in_chunks(
      scan, how, "understory", [&](std::size_t chunks) { parts.resize(chunks); },
      [&](std::size_t chunk, const auto& visit_points) {
        constexpr std::size_t usual = 16384;  // points of a chunk in the layer
        local_points part;
        part.reserve(usual);
        visit_points([&](const Eigen::Vector3d& p, point_index i) {
          const Eigen::Vector3d local = ground.frame.to_local(p);
          if (!ground.covers(local.x(), local.y()) || !limits.may_hold(local.x(), local.y(), local.z()))
            return;
          const double height = local.z() - ground.interpolated_height(local.x(), local.y());
          if (height >= options.lowest && height <= options.highest) part.push_back(local.cast<float>(), i);
        });
        parts[chunk] = std::move(part);
      });
  std::vector<std::size_t> first(parts.size() + 1, 0);
  for (std::size_t k = 0; k < parts.size(); ++k) first[k + 1] = first[k] + parts[k].size();
  understory.resize(first.back());
  parallel_for(
      how, "understory", parts.size(),
      [&](std::size_t k) {
        const auto at = static_cast<std::ptrdiff_t>(first[k]);
        std::copy(parts[k].x.begin(), parts[k].x.end(), understory.x.begin() + at);
        std::copy(parts[k].y.begin(), parts[k].y.end(), understory.y.begin() + at);
        std::copy(parts[k].z.begin(), parts[k].z.end(), understory.z.begin() + at);
        std::copy(parts[k].index.begin(), parts[k].index.end(), understory.index.begin() + at);
        parts[k] = {};
      },
      1);
  return understory;
}

}  // namespace GLOBALMATCH_THREADING
}  // namespace globalmatch
