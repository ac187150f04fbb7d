// The digital terrain model: heights over a raster that knows where it has no data ([GM] 3.1).
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "globalmatch/detail/core/local_points.hpp"

namespace globalmatch {

/// Heights at the nodes of a regular raster in a levelled local frame; all lengths in metres, all coordinates
/// in that frame. Node (c, r) lies at x = (c + 0.5) resolution, y = (r + 0.5) resolution.
class terrain {
 public:
  local_frame frame;
  double resolution = 0;
  int columns = 0, rows = 0;
  std::vector<float> heights;               ///< row by row; interpolated where no ground was seen
  std::vector<std::uint8_t> has_data;       ///< 1 where ground was seen near the node
  std::vector<Eigen::Vector3f> ground;      ///< the ground points the heights were fitted to, node by node
  std::vector<std::uint32_t> first_ground;  ///< of each node, in `ground`; one more than nodes, or empty

  bool empty() const { return heights.empty(); }
  std::size_t node(int c, int r) const { return std::size_t(r) * std::size_t(columns) + std::size_t(c); }

  /// Whether (x, y) lies on the raster.
  bool covers(double x, double y) const {
    return !empty() && x >= 0 && y >= 0 && x <= columns * resolution && y <= rows * resolution;
  }

  /// Height at (x, y), bilinear between nodes, also where no ground was seen. Requires `covers(x, y)`.
  double interpolated_height(double x, double y) const {
    const double per_node = 1 / resolution, gx = x * per_node - 0.5, gy = y * per_node - 0.5;
    const int c = std::clamp(static_cast<int>(gx), 0, std::max(columns - 2, 0));
    const int r = std::clamp(static_cast<int>(gy), 0, std::max(rows - 2, 0));
    const double u = gx - c, v = gy - r;
    const std::size_t lower = node(c, r), upper = node(c, std::min(r + 1, rows - 1));
    const std::size_t right = c + 1 < columns ? 1 : 0;
    return (1 - v) * ((1 - u) * heights[lower] + u * heights[lower + right]) +
           v * ((1 - u) * heights[upper] + u * heights[upper + right]);
  }

  /// Whether ground was seen near (x, y).
  bool is_known(double x, double y) const {
    if (!covers(x, y)) return false;
    const int c = std::min(static_cast<int>(x / resolution), columns - 1);
    const int r = std::min(static_cast<int>(y / resolution), rows - 1);
    return has_data[node(c, r)] != 0;
  }

  /// Calls `visit(p)` for the ground points of the nodes within `search_radius` [m] of (x, y), in each
  /// coordinate.
  template <class Visit>
  void for_each_ground_near(double x, double y, double search_radius, const Visit& visit) const {
    if (first_ground.empty()) return;
    const auto number = [&](double v, int maximum) {
      return static_cast<int>(std::clamp(std::floor(v / resolution), 0.0, double(maximum - 1)));
    };
    const int left = number(x - search_radius, columns), right = number(x + search_radius, columns);
    const int top = number(y + search_radius, rows);
    for (int r = number(y - search_radius, rows); r <= top; ++r)
      for (std::uint32_t i = first_ground[node(left, r)]; i < first_ground[node(right, r) + 1]; ++i)
        visit(ground[i]);
  }

  /// Height at (x, y), or nothing outside the raster and where no ground was seen.
  std::optional<double> height_at(double x, double y) const {
    if (!is_known(x, y)) return std::nullopt;
    return interpolated_height(x, y);
  }
};

}  // namespace globalmatch
