// Links of a survey. In: two maps, and stems of both that may be the same. Out: the transform in plan over
// all stems, its NFA and its covariance.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/matrices.hpp"
#include "globalmatch/detail/core/rigid_fit.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/detail/matching/matching_context.hpp"
#include "globalmatch/detail/matching/null_model.hpp"
#include "globalmatch/detail/matching/position_evidence.hpp"
#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "globalmatch/detail/matching/robust_fit.hpp"
#include "globalmatch/detail/matching/score_hypothesis.hpp"
#include "globalmatch/detail/matching/uncertainty.hpp"
#include "globalmatch/detail/matching/verify.hpp"
#include "globalmatch/detail/survey/overlap_index.hpp"
#include "globalmatch/detail/survey/plan_pose.hpp"
#include "globalmatch/matching.hpp"

namespace globalmatch::detail {

/// Two maps whose stems agree, in their levelled local frames.
struct survey_link {
  std::uint32_t source = 0, target = 0;
  plan_pose target_from_source;
  vec2 center;      ///< [m] centroid of the paired stems, in the target
  mat3 covariance;  ///< of a shift of `center` [m] and a turn about it [rad], along the axes of the target
  double log10_nfa = 0;
  double inlier_threshold = 0, rms = 0;  ///< [m]
  std::vector<correspondence> correspondences;
  std::size_t supporting_cycles = 0;
  double residual = 0;  ///< [m] from the adjusted poses, root mean square over the paired stems
  bool used = true;

  vec2 center_in_source() const { return target_from_source.inverse() * center; }
};

/// What of a covariance of shift and turn about the vertical is in plan.
inline mat3 plan_covariance(const local_uncertainty& u) {
  mat3 covariance;
  const std::size_t of[3] = {0, 1, 3};
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r) covariance(r, c) = u.covariance(of[r], of[c]);
  return covariance;
}

/// The link of two maps from pairs of stems, most of them right; nothing where chance does as well. Cost:
/// linear in the stems.
inline std::optional<survey_link> link_maps(std::span<const prepared_stems> maps, std::uint32_t source,
                                            std::uint32_t target, std::span<const correspondence> start) {
  constexpr double start_threshold = 0.2;  // [m] as the coarser of those that triangles are matched at
  constexpr double max_log10_nfa = 0;      // one that is expected among unrelated maps
  constexpr std::size_t min_pairs = 4;     // that determine their noise
  const prepared_stems &from = maps[source], &to = maps[target];
  const matching_context context(from.stems, to.stems, from.index, to.index, true, degrees_of_freedom::four);
  auto found = verify(context, start, start_threshold);
  if (!found || found->correspondences.size() < min_pairs) return std::nullopt;
  null_model null(context, to.background, pairing_thresholds);
  null.include_reversed(from.background);
  local_hypothesis& h = *found;
  score_hypothesis(h, context, null, pairing_thresholds);
  if (h.log10_nfa > max_log10_nfa || h.correspondences.size() < min_pairs) return std::nullopt;
  null.include_lattice_of(paired_background(h, context));
  null.score(h, null.residuals_under(h.target_from_source, h.inlier_threshold));
  if (h.log10_nfa > max_log10_nfa) return std::nullopt;
  complete_pairs(h, context, pairing_thresholds);
  const auto uncertainty = uncertainty_of(h, context);
  if (!uncertainty) return std::nullopt;
  survey_link link;
  link.source = source;
  link.target = target;
  link.target_from_source = plan_of(h.target_from_source);
  link.center = uncertainty->center.xy();
  link.covariance = plan_covariance(*uncertainty);
  link.log10_nfa = h.log10_nfa;
  link.inlier_threshold = h.inlier_threshold;
  link.rms = h.rms;
  link.correspondences = std::move(h.correspondences);
  return link;
}

}  // namespace globalmatch::detail
