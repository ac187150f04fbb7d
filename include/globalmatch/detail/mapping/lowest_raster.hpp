// The raster of the lowest points of a scan.
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "globalmatch/detail/core/local_frame.hpp"
#include "globalmatch/detail/core/vectors.hpp"

namespace globalmatch::detail {

/// In place of a point where there is none.
inline constexpr float not_known = std::numeric_limits<float>::quiet_NaN();
inline constexpr vec3f no_point(not_known, not_known, not_known);

/// Each node of the terrain covers 2 x 2 cells of the lowest points.
constexpr int lowest_cells_a_node = 2;

/// The lowest point of each cell, NaN where a cell is empty. Coordinates [m] in `frame`, whose origin is the
/// raster's corner.
struct lowest_raster {
  local_frame frame;
  double resolution = 0;  ///< [m]
  int columns = 0, rows = 0;
  std::vector<vec3f> points;  ///< row by row

  std::size_t cell(int c, int r) const { return std::size_t(r) * std::size_t(columns) + std::size_t(c); }
  bool holds(int c, int r) const {
    return c >= 0 && r >= 0 && c < columns && r < rows && !std::isnan(points[cell(c, r)].z);
  }
};

}  // namespace globalmatch::detail
