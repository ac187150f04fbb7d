// The direction that the stems of a scan stand in: its vertical, where the scanner was not level.
// In: axes of stems. Out: their robust mean. Ours; [GM] takes scans as levelled. The ground has no say,
// because slopes are no tilt.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include "globalmatch/detail/core/local_frame.hpp"
#include "globalmatch/detail/core/robust.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/mapping_options.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

/// The direction that stems stand in, from their axes (unit, pointing up): the mean in which those count less
/// that lean more (Tukey's weight). Nothing from fewer than ten stems. Cost: linear.
inline std::optional<upright_direction> upright_of(std::span<const vec3> axes) {
  constexpr std::size_t min_stems = 10;
  constexpr int max_iterations = 20;
  constexpr double median_of_rayleigh = 1.1774;  // standard deviations
  constexpr double min_noise = 1e-6;             // [rad]
  if (axes.size() < min_stems) return std::nullopt;
  vec3 first = vec3{};
  for (const vec3& a : axes) first += a;
  vec3 up = first.normalized();
  double sigma = 0;
  std::vector<double> tilts(axes.size());
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    for (std::size_t i = 0; i < axes.size(); ++i) tilts[i] = angle_between(axes[i], up);
    const double noise = std::max(median(tilts) / median_of_rayleigh, min_noise);
    vec3 sum = vec3{};
    double weights = 0;
    for (const vec3& a : axes) {
      const double off = std::pow(angle_between(a, up) / (tukey_constant * noise), 2);
      const double weight = tukey_weight(off);
      sum += weight * a;
      weights += weight;
    }
    up = sum.normalized();
    sigma = noise / std::sqrt(weights);
  }
  return upright_direction{up.as<Eigen::Vector3d>(), sigma};
}

inline std::vector<vec3> axes_of(const std::vector<stem>& stems) {
  std::vector<vec3> axes;
  for (const stem& s : stems) axes.push_back(vec3::from(s.axis));
  return axes;
}

/// A map without stems yet, of a scan whose vertical is taken to be `up`.
inline stem_map empty_map(const vec3& up) {
  stem_map map;
  map.up = map.given_up = up.stable_normalized().as<Eigen::Vector3d>();
  return map;
}

/// Whether the vertical of a map is to be that of its stems.
inline bool takes_vertical_from_stems(const stem_map& map, const mapping_options& options) {
  if (!map.upright) return false;
  return options.vertical == vertical_rule::stems ||
         (options.vertical == vertical_rule::stems_if_tilted && is_tilted(map));
}

/// Whether stems are so far from the vertical of a map that some were not found.
inline bool is_far_from_upright(const stem_map& map) {
  constexpr double all_found = 15 * std::numbers::pi / 180;  // [rad] half of what stems may lean
  return angle_between(map.upright->up, map.up) > all_found;
}

/// Takes the vertical of a map from its stems, if there are enough.
inline void take_vertical_from_stems(stem_map& map) {
  if (map.upright) map.up = map.upright->up;
  map.up_by_stems = true;
}

}  // namespace globalmatch::detail
