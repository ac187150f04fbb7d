// Lowest points of a scan -> those that are outliers left out, a surface under the vegetation, terrain by
// local planes. Cost: linear in the area.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "globalmatch/detail/mapping/bare_ground.hpp"
#include "globalmatch/detail/mapping/fit_terrain.hpp"
#include "globalmatch/detail/mapping/ground.hpp"
#include "globalmatch/detail/mapping/ground_surface.hpp"
#include "globalmatch/detail/mapping/low_noise.hpp"
#include "globalmatch/detail/mapping/lowest_raster.hpp"
#include "globalmatch/detail/mapping/outliers.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/mapping_options.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

/// Finds heights [m] under the vegetation at the nodes of a raster of `columns` x `rows`.
using bare_ground_finder = std::vector<float>(const lowest_raster&, int columns, int rows,
                                              const ground_options&, const execution&);

/// Ground at height 0 of the scan, wherever the scan has points.
inline terrain flat_terrain(const lowest_raster& lowest, double resolution) {
  terrain flat;
  flat.frame = lowest.frame;
  flat.resolution = resolution;
  flat.columns = lowest.columns / lowest_cells_a_node;
  flat.rows = lowest.rows / lowest_cells_a_node;
  const double zero = -(lowest.frame.rotation * lowest.frame.origin).z;
  flat.heights.assign(std::size_t(flat.columns) * std::size_t(flat.rows), static_cast<float>(zero));
  flat.has_data.assign(flat.heights.size(), 1);
  return flat;
}

/// How many cells of a node hold points, on the mean over the nodes that have any: 4 in dense scans.
inline double held_cells_a_node(const lowest_raster& lowest) {
  std::size_t cells = 0, nodes = 0;
  for (int r = 0; r < lowest.rows; r += lowest_cells_a_node)
    for (int c = 0; c < lowest.columns; c += lowest_cells_a_node) {
      const int held =
          lowest.holds(c, r) + lowest.holds(c + 1, r) + lowest.holds(c, r + 1) + lowest.holds(c + 1, r + 1);
      cells += std::size_t(held);
      nodes += held > 0;
    }
  return nodes > 0 ? double(cells) / double(nodes) : 0;
}

/// The ground under the lowest points of a scan, of which it empties the cells of outliers. The terrain is
/// empty where there are none. `funnel`: what is known of them.
inline ground_model model_terrain(lowest_raster lowest, const ground_funnel& funnel,
                                  const ground_options& options, bare_ground_finder* find_bare_ground,
                                  const execution& exec, bool is_noisy = false) {
  ground_model model{{}, funnel};
  if (lowest.points.empty()) {
    model.terrain.status = ground_status::none;
    return model;
  }
  if (options.filter == ground_filter::normalized) {
    model.terrain = flat_terrain(lowest, options.resolution);
    model.terrain.status = ground_status::normalised;
    model.funnel.ground_points = model.funnel.cells;  // no ground is looked for
    return model;
  }
  const double cells_a_node = held_cells_a_node(lowest);
  constexpr double clump_depth = 1;  // [m] no hollow of a forest floor is so deep and so narrow
  model.funnel.low_outliers = remove_low_outliers(lowest, options.low_point_depth, exec);
  constexpr double clump_step = 1;  // [m] of blocks that are 1 m wide: a slope of 45 degrees
  model.funnel.low_outliers += remove_low_clumps(lowest, clump_depth, clump_step);
  constexpr double noise_depth = 0.12;  // [m]
  for (int sweep = 0; is_noisy && sweep < 2; ++sweep)
    model.funnel.low_outliers += remove_below_pairs(lowest, noise_depth);
  model.funnel.unreachable = remove_unreachable(lowest, options.max_slope, options.ground_band, exec);
  const int columns = lowest.columns / lowest_cells_a_node, rows = lowest.rows / lowest_cells_a_node;
  std::vector<float> heights = find_bare_ground(lowest, columns, rows, options, exec);
  model.terrain = fit_terrain(lowest, std::move(heights), columns, rows, options, exec, is_noisy);
  determine_status(model.terrain, cells_a_node);
  model.funnel.ground_points = model.terrain.ground.size();
  return model;
}

}  // namespace globalmatch::detail
