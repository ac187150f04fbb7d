// Stem mapping ([GM] 3.1): a scan -> its stem map. The steps composed, nothing else.
#pragma once

#include <Eigen/Core>

#include <utility>

#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/detail/mapping/ground.hpp"
#include "globalmatch/detail/mapping/mapping_steps.hpp"
#include "globalmatch/detail/mapping/samples.hpp"
#include "globalmatch/detail/mapping/stem_cylinders.hpp"
#include "globalmatch/detail/mapping/stem_points.hpp"
#include "globalmatch/detail/mapping/stem_positions.hpp"
#include "globalmatch/detail/mapping/stem_taper.hpp"
#include "globalmatch/detail/mapping/understory.hpp"
#include "globalmatch/detail/mapping/vertical_direction.hpp"
#include "globalmatch/detail/published/published_steps.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/mapping_options.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch {

namespace detail {

/// `map_stems` with a vertical that is known.
template <point_range R>
stem_map map_stems_along(const R& scan, const mapping_options& options, const vec3& up,
                         const execution& exec) {
  const mapping_steps steps = steps_for(options);
  stem_map map = empty_map(up);

  // Digital terrain model
  ground_model ground = model_ground(scan, options.ground, up, steps.find_bare_ground, exec);
  map.funnel.ground = ground.funnel;
  map.terrain = std::move(ground.terrain);

  // Understory layer
  understory_parts layer =
      select_understory_parts(scan, map.terrain, options.understory, steps.min_spacing, exec);
  map.funnel.understory = layer.in_layer;

  // Stem points, by verticality, in clusters
  const stem_points vertical = steps.find_stem_points(std::move(layer.parts), options, map, exec);
  const local_points& understory = vertical.understory.points();

  // Individual stems: cylinders
  stem_cylinders found =
      find_stem_cylinders(vertical.understory, vertical.clusters, vertical.fitter(), options.stems, exec);
  count_cylinders(vertical.clusters, found, map);
  map.funnel.likely = drop_unlikely(found, options.min_quality);

  // Stem positions: where the axes meet the terrain
  auto stems = merge_fragments(std::move(found), understory, map.terrain, options.stems.cylinder);
  refit_with_common_taper(stems, understory, map.terrain, map.distance_tolerance, options.stems.cylinder,
                          exec);
  drop_second_finds(stems, map.terrain);
  map.stems = locate_stems(stems, understory, map.terrain, exec);
  map.funnel.stems = map.stems.size();
  map.upright = upright_of(axes_of(map.stems));
  collect_samples(stems, understory, map, exec);
  return map;
}

}  // namespace detail

/// Maps the stems of a scan. `up` points away from the ground, in the frame of the scan. The caller's points
/// are read in two forward passes, up to three more where noise below the ground is left out, and as often
/// again where the vertical is taken from the stems and far off. Some thousand points are looked at before,
/// for their unit, and a range that has no random access is also counted before each pass. No stems is an
/// answer: the funnel then says where they were lost. Throws `std::invalid_argument` naming a bad option.
/// Cost: linear in the points, n log n in the understory.
template <point_range R>
stem_map map_stems(const R& scan, const mapping_options& options = {}, const Eigen::Vector3d& up = {0, 0, 1},
                   const execution& exec = {}) {
  require_valid(options);
  const detail::parallel_scope scope(exec, "ground");
  try {
    stem_map map = detail::map_stems_along(scan, options, detail::vec3::from(up), exec);
    if (detail::takes_vertical_from_stems(map, options)) {
      if (detail::is_far_from_upright(map)) {  // stems were lost: map along theirs
        const Eigen::Vector3d given = map.given_up;
        map = detail::map_stems_along(scan, options, detail::vec3::from(map.upright->up), exec);
        map.given_up = given;
      }
      detail::take_vertical_from_stems(map);
    }
    return map;
  } catch (const operation_cancelled&) {
    stem_map map;
    map.cancelled = true;
    return map;
  }
}

}  // namespace globalmatch
