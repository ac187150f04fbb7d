// What holds for every stem map that is written or read, so that whatever uses one from a file finds its
// arrays as long as it takes them to be.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

/// What is wrong with the raster of a terrain; empty where nothing is.
inline std::string describe_raster_error(const terrain& t) {
  if (t.columns < 0 || t.rows < 0) return "terrain: columns and rows must not be negative";
  const std::size_t nodes = std::size_t(t.columns) * std::size_t(t.rows);
  if (t.heights.size() != nodes) return "terrain: heights must hold columns x rows values";
  if (t.has_data.size() != nodes) return "terrain: has_data must hold columns x rows values";
  if (!t.in_surface.empty() && t.in_surface.size() != nodes)
    return "terrain: in_surface must hold columns x rows values, or none";
  if (nodes > 0 && !(t.resolution > 0 && std::isfinite(t.resolution)))
    return "terrain: resolution must be finite and positive";
  return "";
}

/// The same for the ground points of a terrain whose raster is right.
inline std::string describe_ground_error(const terrain& t) {
  const auto& first = t.first_ground;
  if (first.empty()) return "";
  if (first.size() != t.heights.size() + 1)
    return "terrain: first_ground must hold columns x rows + 1 values";
  if (first.front() != 0 || first.back() != t.ground.size() || !std::is_sorted(first.begin(), first.end()))
    return "terrain: first_ground must increase from 0 to the number of ground points";
  return "";
}

/// The same for the samples.
inline std::string describe_sample_error(const stem_map& map) {
  for (const auto* samples : {&map.ground_samples, &map.stem_samples, &map.stem_normals})
    if (!std::all_of(samples->begin(), samples->end(), [](const auto& p) { return p.allFinite(); }))
      return "samples and normals must be finite";
  return "";
}

/// The same for what the scanner saw.
inline std::string describe_view_error(const stem_map& map) {
  const visible_ranges& visible = map.visible;
  constexpr std::size_t cells = std::size_t(visible_ranges::columns) * std::size_t(visible_ranges::rows);
  if (!visible.empty() && visible.ranges.size() != cells)
    return "visible: ranges must hold columns x rows values, or none";
  if (!is_finite(visible.scanner)) return "visible: the scanner's place must be finite";
  return "";
}

}  // namespace globalmatch::detail
