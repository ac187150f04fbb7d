// Ground ([GM] 3.1): scan -> lowest points -> terrain; again where noise below the ground is left out.
// In: points of a scan, one pass. Out: `terrain` and its funnel. Cost: linear in points and in area.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "globalmatch/detail/mapping/low_noise.hpp"
#include "globalmatch/detail/mapping/lowest_points.hpp"
#include "globalmatch/detail/mapping/scan_units.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/mapping_options.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

struct ground_model {
  globalmatch::terrain terrain;
  ground_funnel funnel;
};

/// The ground under a scan. `model_of(lowest_raster, funnel, is_noisy)` is that under its lowest points. `up`
/// points away from it, in the frame of the scan. The terrain is empty when no point is finite. Reads the
/// scan once, and again where noise below the ground has to be left out. Throws `std::invalid_argument`
/// naming a bad option, `operation_cancelled` on request.
template <point_range R, class Model>
ground_model model_ground(const R& scan, const ground_options& options, const vec3& up, const Model& model_of,
                          const execution& exec) {
  require_valid(options);
  const std::vector<vec3> some = points_all_over(scan);
  require_metres(some, up);
  const double resolution = options.resolution / lowest_cells_a_node;
  ground_funnel funnel;
  scan_sample sample;
  lowest_raster lowest = gather_lowest_points(scan, resolution, up, funnel, exec, keep_all{}, &sample);
  ground_model model = model_of(std::move(lowest), funnel, false);
  constexpr std::size_t max_iterations = 3;  // noise hides under noise
  std::vector<noise_floor> floors;
  while (floors.size() < max_iterations && !model.terrain.ground.empty()) {
    floors.push_back(find_noise_floor(sample, model.terrain));
    if (!is_noisy(floors.back())) break;
    const auto keep = [&](const vec3& p) {
      return std::none_of(floors.begin(), floors.end(),
                          [&](const noise_floor& f) { return f.holds_above(p); });
    };
    sample = {.one_in = 4};
    lowest = gather_lowest_points(scan, resolution, up, funnel, exec, keep, &sample);
    model = model_of(std::move(lowest), funnel, true);
  }
  model.funnel.coordinate_step = coordinate_step(some);
  return model;
}

}  // namespace globalmatch::detail
