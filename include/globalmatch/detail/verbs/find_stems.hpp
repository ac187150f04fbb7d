// The steps of stem mapping composed, once the scan is read; the one place where those of `detail/published/`
// are selected.
#pragma once

#include <utility>

#include "globalmatch/detail/core/compiled.hpp"
#include "globalmatch/detail/core/local_points.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/detail/mapping/bare_ground.hpp"
#include "globalmatch/detail/mapping/ground.hpp"
#include "globalmatch/detail/mapping/samples.hpp"
#include "globalmatch/detail/mapping/single_station.hpp"
#include "globalmatch/detail/mapping/stem_cylinders.hpp"
#include "globalmatch/detail/mapping/stem_points.hpp"
#include "globalmatch/detail/mapping/stem_positions.hpp"
#include "globalmatch/detail/mapping/stem_taper.hpp"
#include "globalmatch/detail/mapping/terrain_model.hpp"
#include "globalmatch/detail/mapping/understory.hpp"
#include "globalmatch/detail/mapping/vertical_direction.hpp"
#include "globalmatch/detail/published/cloth_ground.hpp"
#include "globalmatch/detail/published/stem_points_by_points.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/mapping_options.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

GLOBALMATCH_INLINE ground_model model_terrain(lowest_raster lowest, const ground_funnel& funnel,
                                              const ground_options& options, const execution& exec,
                                              bool is_noisy, build_mode) {
  const auto find_bare_ground =
      options.filter == ground_filter::cloth ? &cloth_under_vegetation : &planes_under_vegetation;
  return model_terrain(std::move(lowest), funnel, options, find_bare_ground, exec, is_noisy);
}

GLOBALMATCH_INLINE stem_map find_stems(ground_model&& ground, understory_parts&& layer, const vec3& up,
                                       const mapping_options& options, const execution& exec, build_mode) {
  stem_map map = empty_map(up);
  map.funnel.ground = ground.funnel;
  map.terrain = std::move(ground.terrain);
  map.funnel.understory = layer.in_layer;

  // Stem points, by verticality, in clusters
  const auto find_stem_points =
      options.rule == stem_point_rule::points ? &stem_points_by_points : &stem_points_by_cells;
  stem_points vertical = find_stem_points(std::move(layer.points), options, map, exec);
  const local_points& understory = vertical.understory.points();

  // Individual stems: cylinders
  stem_cylinders found =
      find_stem_cylinders(vertical.understory, vertical.clusters, vertical.fitter(), options.stems, exec);
  count_cylinders(vertical.clusters, found, map);
  vertical.clusters = {};  // of a large scan a tenth of the memory
  map.funnel.likely = drop_unlikely(found, options.min_quality);

  // Stem positions: where the axes meet the terrain
  auto stems = merge_fragments(std::move(found), understory, map.terrain, options.stems.cylinder);
  refit_with_common_taper(stems, understory, map.terrain, map.distance_tolerance, options.stems.cylinder,
                          exec);
  drop_duplicates(stems, map.terrain);
  map.stems = locate_stems(stems, understory, map.terrain, exec);
  map.funnel.stems = map.stems.size();
  map.upright = upright_of(axes_of(map.stems));
  collect_samples(stems, understory, map, exec);
  map.visible = std::move(layer.visible);
  if (!is_seen_from_scanner(map)) map.visible = {};
  return map;
}

}  // namespace globalmatch::detail
