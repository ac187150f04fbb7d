// The taper of stems, from the scan itself: cylinders refitted above the root flare, and with the taper
// that the best seen stems of the scan show. In: stems with their support. Out: the same stems, better
// placed. [GM] fits cylinders proper to all points. Parallel over stems.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "globalmatch/detail/core/local_points.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/mapping/cylinder.hpp"
#include "globalmatch/detail/mapping/cylinder_fit.hpp"
#include "globalmatch/detail/mapping/stem_base.hpp"
#include "globalmatch/detail/mapping/stem_cylinders.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/mapping_options.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

/// Points on a stem above the root flare, on which a taper that is no stem's would bend the axis; none where
/// the stem does not meet the terrain.
inline std::vector<vec3> above_root_flare(const stem_cylinder& stem, const local_points& points,
                                          const terrain& ground) {
  constexpr double root_flare = 0.4;       // [m] above the ground
  constexpr std::size_t max_points = 800;  // that are fitted
  std::vector<vec3> above;
  const auto base = intersect_terrain(stem.cylinder, ground);
  if (!base) return above;
  const std::size_t step = (stem.support.size() + max_points - 1) / max_points;
  for (std::size_t k = 0; k < stem.support.size(); k += step)
    if (const auto p = points[stem.support[k]]; p.z > base->z + root_flare) above.push_back(vec3(p));
  return above;
}

/// Refits a stem to its support above the root flare; it stays as it is where too little of it is seen
/// there. Its uncertainty is computed again.
inline void refit_above_root_flare(stem_cylinder& stem, const local_points& points, const terrain& ground,
                                   double tolerance, const cylinder_options& options) {
  const auto above = above_root_flare(stem, points, ground);
  const auto refined = refine_cylinder(stem.cylinder, above, tolerance, options);
  if (!refined) return;
  stem.cylinder = *refined;
  stem.covariance = cylinder_covariance(*refined, above, std::max(stem.rms, tolerance / 4), options);
}

/// The taper of the best seen stems as a share of their radius [1/m]: median over the quarter with most
/// support, each fitted with next to no taper expected. Nothing where that are too few to tell.
inline std::optional<double> common_taper(const std::vector<stem_cylinder>& stems, const local_points& points,
                                          const terrain& ground, double tolerance, cylinder_options options,
                                          const execution& exec = {}) {
  constexpr std::size_t min_stems = 10;
  std::vector<std::uint32_t> best = by_decreasing_support(stems);
  best.resize(stems.size() / 4);
  options.taper_weight = 1;
  std::vector<std::optional<double>> relative_tapers(best.size());
  parallel_for(
      exec, "stem positions", best.size(),
      [&](std::size_t i) {
        const stem_cylinder& stem = stems[best[i]];
        const auto above = above_root_flare(stem, points, ground);
        if (const auto fit = refine_cylinder(stem.cylinder, above, tolerance, options))
          relative_tapers[i] = fit->taper / fit->radius;
      },
      4);
  std::vector<double> tapers;
  for (const auto& taper : relative_tapers)
    if (taper) tapers.push_back(*taper);
  if (tapers.size() < min_stems) return std::nullopt;
  return upper_median(tapers);
}

/// Refits all stems above the root flare, with the taper that the scan's best seen stems tell in place of
/// `options.usual_taper`, where they do. One side of a stem tells its lean and its taper apart poorly, and a
/// taper that is too small leans the axis, so that it meets the ground too near to the scanner. Without
/// `options.usual_taper` the stems are cylinders proper and stay as they are.
inline void refit_with_common_taper(std::vector<stem_cylinder>& stems, const local_points& points,
                                    const terrain& ground, double tolerance, const cylinder_options& options,
                                    const execution& exec = {}) {
  constexpr double common_weight = 2;  // so many times as firmly it is then held
  if (!options.usual_taper) return;
  const auto relative_taper = common_taper(stems, points, ground, tolerance, options, exec);
  parallel_for(
      exec, "stem positions", stems.size(),
      [&](std::size_t i) {
        cylinder_options own = options;
        if (relative_taper) {
          own.usual_taper = *relative_taper * stems[i].cylinder.radius;
          own.taper_weight *= common_weight;
        }
        refit_above_root_flare(stems[i], points, ground, tolerance, own);
      },
      4);
}
}  // namespace globalmatch::detail
