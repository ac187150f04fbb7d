// The surface under the vegetation as [GM] 3.1 has it: a cloth over the lowest points.
#pragma once

#include <cstddef>
#include <vector>

#include "globalmatch/detail/mapping/lowest_raster.hpp"
#include "globalmatch/detail/published/cloth.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/mapping_options.hpp"

namespace globalmatch::detail {

inline std::vector<float> cloth_cell_minima(const lowest_raster& lowest, int columns, int rows) {
  std::vector<float> minima(std::size_t(columns) * std::size_t(rows), not_known);
  for (int r = 0; r < lowest.rows; ++r)
    for (int c = 0; c < lowest.columns; ++c) {
      if (!lowest.holds(c, r)) continue;
      float& minimum = minima[std::size_t(r / lowest_cells_a_node) * std::size_t(columns) +
                              std::size_t(c / lowest_cells_a_node)];
      const float z = lowest.points[lowest.cell(c, r)].z;
      if (!(minimum <= z)) minimum = z;
    }
  return minima;
}

/// Heights [m] of the cloth at the nodes of a raster of `columns` x `rows`.
inline std::vector<float> cloth_under_vegetation(const lowest_raster& lowest, int columns, int rows,
                                                 const ground_options& options, const execution& exec = {}) {
  return simulate_cloth(cloth_cell_minima(lowest, columns, rows), columns, rows, options.cloth, exec).heights;
}

}  // namespace globalmatch::detail
