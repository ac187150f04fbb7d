// Lattice alternatives: a regular plantation looks alike after a shift or a turn of its lattice onto itself.
// In: a hypothesis. Out: those that differ from it by such a shift or turn, so that what triangles did not
// happen to propose does not pass for absent.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/neighbor.hpp"
#include "globalmatch/detail/core/rigid.hpp"
#include "globalmatch/detail/matching/verify.hpp"
#include "globalmatch/points.hpp"

namespace globalmatch::detail {

/// Shifts of the target frame that move stem `t` to one of its nearest stems, and turns about it that move
/// its nearest stem to another one about as near.
inline std::vector<rigid> local_symmetries(const matching_context& context, stem_index t,
                                           double inlier_threshold) {
  constexpr std::size_t shifts = 4, turned_to = 6;
  std::vector<neighbor<double>> nearest;
  context.target_index->nearest(t, turned_to, nearest);
  const vec3& at = context.target.at[t];
  const auto arm = [&](std::size_t k) { return (context.target.at[nearest[k].index] - at).xy(); };
  const auto yaw = [&](std::size_t k) { return std::atan2(arm(k).y, arm(k).x); };
  std::vector<rigid> symmetries;
  for (std::size_t k = 0; k < std::min(shifts, nearest.size()); ++k)
    symmetries.push_back({mat3::identity(), {arm(k).x, arm(k).y, 0}});
  for (std::size_t k = 1; k < nearest.size(); ++k) {
    if (std::sqrt(nearest[k].squared_distance) - std::sqrt(nearest[0].squared_distance) >
        2 * inlier_threshold)
      break;
    symmetries.push_back(rigid::turn_about(at, yaw(k) - yaw(0)));
  }
  return symmetries;
}

/// Hypotheses at the threshold of `h` that differ from it by shifts and turns of the target onto itself,
/// around some of the stems that it pairs, where they pair half as many or more; verified, not scored. Few
/// where stems stand at random. Cost: some dozen looks at the stems around a stem, and at most `maximum`
/// verifications.
inline std::vector<local_hypothesis> lattice_alternatives(const local_hypothesis& h,
                                                          const matching_context& context) {
  constexpr std::size_t sampled = 4, maximum = 16;  // paired stems; alternatives that are enough
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
    for (const rigid& symmetry : local_symmetries(context, t, h.inlier_threshold)) {
      if (verified == maximum) break;
      const auto pairs =
          context.pair_stems(symmetry * h.target_from_source, 2 * h.inlier_threshold, center, radius);
      if (pairs.size() < minimum || 2 * pairs.size() < own_pairs.size()) continue;
      ++verified;
      if (auto alternative = verify(context, pairs, h.inlier_threshold))
        alternatives.push_back(std::move(*alternative));
    }
  }
  return alternatives;
}

}  // namespace globalmatch::detail
