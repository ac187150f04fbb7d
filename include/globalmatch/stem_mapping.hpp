// Stem mapping ([GM] 3.1): a scan -> its stem map.
#pragma once

#include <Eigen/Core>

#include <utility>

#include "globalmatch/detail/core/compiled.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/detail/mapping/ground.hpp"
#include "globalmatch/detail/mapping/understory.hpp"
#include "globalmatch/detail/mapping/vertical_direction.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/mapping_options.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch {

namespace detail {

/// The ground under the lowest points of a scan.
GLOBALMATCH_INLINE ground_model model_terrain(lowest_raster lowest, const ground_funnel& funnel,
                                              const ground_options& options, const execution& exec,
                                              bool is_noisy, build_mode = {});

/// The stems in the understory over a ground.
GLOBALMATCH_INLINE stem_map find_stems(ground_model&& ground, understory_parts&& layer, const vec3& up,
                                       const mapping_options& options, const execution& exec,
                                       build_mode = {});

/// `map_stems` with a vertical that is known.
template <point_range R>
stem_map map_stems_along(const R& scan, const mapping_options& options, const vec3& up,
                         const execution& exec) {
  const auto model_of = [&](lowest_raster&& lowest, const ground_funnel& funnel, bool is_noisy) {
    return model_terrain(std::move(lowest), funnel, options.ground, exec, is_noisy);
  };
  ground_model ground = model_ground(scan, options.ground, up, model_of, exec);
  const double min_spacing = options.rule == stem_point_rule::points ? 0 : options.voxel_size;
  understory_parts layer =
      select_understory_parts(scan, ground.terrain, options.understory, min_spacing, exec, options.scanner);
  return find_stems(std::move(ground), std::move(layer), up, options, exec);
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

#if !defined(GLOBALMATCH_COMPILED)
#include "globalmatch/detail/verbs/find_stems.hpp"
#endif
