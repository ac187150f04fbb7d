// How far a scanner saw in each direction: a raster of the directions near the horizontal with the distance
// of the furthest return in each. Where it saw past a place, no stem stands there. Ours.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "globalmatch/detail/core/vectors.hpp"

namespace globalmatch::detail {

/// A return of a scanner: the direction it came from, and how far.
struct ranged_return {
  std::uint16_t cell;
  std::uint16_t range;  ///< [cm] horizontal
};

/// The raster, of directions in a levelled frame. Columns divide each quadrant evenly by x / (|x| + |y|), in
/// steps of 0.13 to 0.25 degrees; rows divide the slopes evenly. A tenth of a megabyte.
class visible_ranges {
 public:
  static constexpr int columns = 1800, rows = 30;
  static constexpr float max_slope = 1;       ///< [m/m] of directions, up and down
  static constexpr float max_distance = 600;  ///< [m] horizontal

  vec3 scanner;                       ///< [m] where it stood, in the frame of the terrain
  std::vector<std::uint16_t> ranges;  ///< [cm] row by row, 0 without return; empty where nothing is known

  bool empty() const { return ranges.empty(); }

  /// What a point at `offset` [m] from the scanner tells; nothing where it is too near, too far or too steep.
  static std::optional<ranged_return> return_at(const vec3f& offset) {
    constexpr float min_range = 1, max_range = max_distance;  // [m]
    const float range = std::sqrt(offset.x * offset.x + offset.y * offset.y);
    if (!(range >= min_range && range <= max_range && std::abs(offset.z) < max_slope * range)) return {};
    const int cell = row_of(offset.z / range) * columns + column_of(offset.x, offset.y);
    return ranged_return{static_cast<std::uint16_t>(cell), static_cast<std::uint16_t>(range * 100)};
  }

  void add(const ranged_return& seen) {
    if (ranges.empty()) ranges.assign(std::size_t(columns) * std::size_t(rows), 0);
    std::uint16_t& range = ranges[seen.cell];
    range = std::max(range, seen.range);
  }

  /// Whether a stem of some radius [m] at a horizontal distance [m] is wide enough to cover a cell.
  static bool is_covered(double distance, double radius) {
    constexpr double widest_cell = 2.0 / (columns / 4);  // [rad]
    constexpr double min_distance = 2;                   // [m]
    return distance > min_distance && radius >= widest_cell * distance;
  }

  /// Whether the scanner saw past a stem with the given base [m], axis (pointing up, z 1) and radius [m],
  /// wherever within `error` [m] to either side it stands: in half of the rows that it would cover the
  /// furthest returns are all behind it.
  bool sees_past(const vec3& base, const vec3& axis, double radius, double error) const {
    constexpr double margin = 0.5;                                    // [m] behind the stem
    constexpr double min_height = 0.5, max_height = 2.6, step = 0.5;  // [m] above the ground
    constexpr double max_turn = 0.5;  // [rad] a stem that may stand anywhere is not seen past
    int last_row = -1, covered = 0, past = 0;
    for (double height = min_height; height < max_height; height += step) {
      const vec3 offset = base + height * axis - scanner;
      const double distance = std::hypot(offset.x, offset.y);
      if (!(std::abs(offset.z) < max_slope * distance)) continue;
      if (!(error <= max_turn * distance && distance < max_distance)) return false;
      const int row = row_of(float(offset.z / distance));
      if (row == last_row) continue;
      last_row = row;
      ++covered;
      past += is_past(row, offset, error / distance, distance + radius + margin);
    }
    return covered > 0 && 2 * past >= covered;
  }

 private:
  static int row_of(float slope) {
    return std::clamp(static_cast<int>((slope + max_slope) * (rows / (2 * max_slope))), 0, rows - 1);
  }
  /// Counter-clockwise from x.
  static int column_of(float x, float y) {
    const float along = x / (std::abs(x) + std::abs(y));
    const float turn = y >= 0 ? 1 - along : 3 + along;  // in quadrants
    return std::min(static_cast<int>(turn * (columns / 4)), columns - 1);
  }

  /// Whether all cells of a row are beyond `distance` [m] that lie within `turn` [rad] of a direction.
  bool is_past(int row, const vec3& direction, double turn, double distance) const {
    const auto column_turned = [&](double by) {
      return column_of(float(direction.x - by * direction.y), float(direction.y + by * direction.x));
    };
    const int last = column_turned(turn);
    for (int c = column_turned(-turn);; c = c + 1 == columns ? 0 : c + 1) {
      if (ranges[std::size_t(row) * columns + std::size_t(c)] < distance * 100) return false;
      if (c == last) return true;
    }
  }
};

}  // namespace globalmatch::detail
