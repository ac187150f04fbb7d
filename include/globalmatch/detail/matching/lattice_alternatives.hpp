// Lattice rivals: a stand in rows looks alike after a shift or a turn onto itself. In: a hypothesis. Out:
// those that lay the source on the stand so moved, for what triangles did not happen to propose must not pass
// for absent.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/neighbor.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/points.hpp"

namespace globalmatch::detail {

/// Calls `visit(transform)` for shifts of the target frame that lay stem `t` on one of its nearest stems, and
/// for turns about it that lay its nearest stem on another one about as near.
template <class Visit>
void for_each_symmetry(const matching_context& context, stem_index t, double inlier_threshold,
                       const Visit& visit) {
  constexpr std::size_t shifts = 4, turned_to = 6;
  std::vector<neighbor<double>> nearest;
  context.target_index->nearest(t, turned_to, nearest);
  const vec3& at = context.target.at[t];
  const auto arm = [&](std::size_t k) { return context.target.at[nearest[k].index] - at; };
  const auto yaw = [](const vec3& d) { return std::atan2(d.y, d.x); };
  const auto horizontal_part = [](const vec3& d) { return vec3{d.x, d.y, 0}; };
  for (std::size_t k = 0; k < std::min(shifts, nearest.size()); ++k)
    visit(rigid{mat3::identity(), horizontal_part(arm(k))});
  for (std::size_t k = 1; k < nearest.size(); ++k) {
    if (std::sqrt(nearest[k].squared_distance) - std::sqrt(nearest[0].squared_distance) >
        2 * inlier_threshold)
      break;
    visit(rigid::turn_about(at, yaw(arm(k)) - yaw(arm(0))));
  }
}

/// Hypotheses at the tolerance of `h` that come of it by shifts and turns of the stand onto itself, around
/// some of the stems that it pairs, where they pair half as many or more; verified, not weighed. Few where
/// stems stand at random. Cost: some dozen looks at the stems around a stem, and at most `maximum`
/// verifications.
inline std::vector<local_hypothesis> lattice_alternatives(const local_hypothesis& h, const matching_context& context) {
  constexpr std::size_t sampled = 4, maximum = 16;  // paired stems; rivals that are enough
  constexpr std::size_t minimum = 4;                // pairs around one that are worth a verification
  constexpr double around = 3;                      // spacings: some 28 stems
  std::vector<local_hypothesis> alternatives;
  const std::size_t step = std::max<std::size_t>(1, (h.correspondences.size() + sampled - 1) / sampled);
  std::size_t verified = 0;
  for (std::size_t i = step / 2; i < h.correspondences.size(); i += step) {
    const auto [s, t] = h.correspondences[i];
    const vec3& center = context.source.at[s];
    const double radius = around * context.source_index->spacing();
    const auto own_pairs = context.pair_stems(h.target_from_source, h.inlier_threshold, center, radius);
    for_each_symmetry(context, t, h.inlier_threshold, [&](const rigid& own) {
      if (verified == maximum) return;
      const auto pairs =
          context.pair_stems(own * h.target_from_source, 2 * h.inlier_threshold, center, radius);
      if (pairs.size() < minimum || 2 * pairs.size() < own_pairs.size()) return;
      ++verified;
      if (auto alternative = verify(context, pairs, h.inlier_threshold))
        alternatives.push_back(std::move(*alternative));
    });
  }
  return alternatives;
}

}  // namespace globalmatch::detail
