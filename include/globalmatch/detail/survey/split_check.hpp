// An independent check of where a map was placed: each half of its stems is placed by the other half.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "globalmatch/detail/core/rigid_fit.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "globalmatch/detail/survey/plan_pose.hpp"
#include "globalmatch/detail/survey/survey_trees.hpp"

namespace globalmatch::detail {

/// Distances [m] in plan between stems and their trees as other maps see them; not a number where too few are
/// shared.
struct split_check {
  double median = std::numeric_limits<double>::quiet_NaN();
  double worst = std::numeric_limits<double>::quiet_NaN();
};

/// A stem, and where the others of its tree are.
struct shared_stem {
  vec3 stem, tree;  ///< [m] the map's local frame; the survey, without height
};

/// The stems of each map that are seen by others, too: those that the adjustment took for one tree.
inline std::vector<std::vector<shared_stem>> shared_stems(std::span<const prepared_stems> maps,
                                                          std::span<const plan_pose> poses,
                                                          const tree_observations& trees,
                                                          std::span<const double> weights) {
  std::vector<std::vector<shared_stem>> shared(maps.size());
  const std::vector<vec2> placed = placed_stems(maps, trees, poses);
  for (std::size_t t = 0; t < trees.size(); ++t) {
    vec2 sum = vec2{};
    double total = 0;
    for (std::size_t i = trees.first[t]; i < trees.first[t + 1]; ++i)
      sum += weights[i] * placed[i], total += weights[i];
    for (std::size_t i = trees.first[t]; i < trees.first[t + 1]; ++i) {
      const double rest = total - weights[i];
      if (!(weights[i] > 0 && rest > 1e-3)) continue;
      const stem_of_map& o = trees.stems[i];
      const vec2 others = (sum - weights[i] * placed[i]) / rest;
      shared[o.map].push_back({maps[o.map].stems.at[o.stem], {others.x, others.y, 0}});
    }
  }
  return shared;
}

inline split_check check_by_halves(std::span<const shared_stem> stems) {
  constexpr std::size_t minimum = 8;
  if (stems.size() < minimum) return {};
  std::vector<double> off;
  for (const std::size_t half : {0u, 1u}) {
    std::vector<vec3> from, to;
    for (std::size_t i = half; i < stems.size(); i += 2)
      from.push_back(stems[i].stem), to.push_back(stems[i].tree);
    const auto transform = fit_rigid(from, to, degrees_of_freedom::four);
    if (!transform) return {};
    for (std::size_t i = 1 - half; i < stems.size(); i += 2)
      off.push_back((*transform * stems[i].stem - stems[i].tree).xy().norm());
  }
  const double worst = *std::max_element(off.begin(), off.end());
  return {median(off), worst};
}

}  // namespace globalmatch::detail
