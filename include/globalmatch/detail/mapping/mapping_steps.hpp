// The steps of mapping for which [GM] has another way: the default ones.
#pragma once

#include <vector>

#include "globalmatch/detail/core/local_points.hpp"
#include "globalmatch/detail/mapping/bare_ground.hpp"
#include "globalmatch/detail/mapping/ground.hpp"
#include "globalmatch/detail/mapping/stem_points.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/mapping_options.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

/// Finds stem points in the understory, which comes in parts.
using stem_point_finder = stem_points(std::vector<local_points>, const mapping_options&, stem_map&,
                                      const execution&);

struct mapping_steps {
  bare_ground_finder* find_bare_ground = &planes_under_vegetation;
  stem_point_finder* find_stem_points = &stem_points_by_cells;
  double min_spacing = 0;  ///< [m] of the understory points, along the scan
};

}  // namespace globalmatch::detail
