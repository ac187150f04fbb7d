// The steps of mapping as [GM] 3.1 has them, where the options ask for them: the one place where that is
// decided.
#pragma once

#include "globalmatch/detail/mapping/mapping_steps.hpp"
#include "globalmatch/detail/published/cloth_ground.hpp"
#include "globalmatch/detail/published/stem_points_by_points.hpp"
#include "globalmatch/mapping_options.hpp"

namespace globalmatch::detail {

inline mapping_steps steps_for(const mapping_options& options) {
  mapping_steps steps;
  if (options.ground.filter == ground_filter::cloth) steps.find_bare_ground = &cloth_under_vegetation;
  if (options.rule == stem_point_rule::points)
    steps.find_stem_points = &stem_points_by_points;
  else
    steps.min_spacing = options.voxel_size;
  return steps;
}

}  // namespace globalmatch::detail
