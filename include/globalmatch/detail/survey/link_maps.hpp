// A candidate of a survey tried on all stems. In: two maps, and stems of both that may be the same. Out: the
// link, with its NFA and its covariance in plan.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/rigid_fit.hpp"
#include "globalmatch/detail/matching/add_evidence.hpp"
#include "globalmatch/detail/matching/decision.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/detail/matching/matching_context.hpp"
#include "globalmatch/detail/matching/null_model.hpp"
#include "globalmatch/detail/matching/planting_lattice.hpp"
#include "globalmatch/detail/matching/position_evidence.hpp"
#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "globalmatch/detail/matching/robust_fit.hpp"
#include "globalmatch/detail/matching/score_hypothesis.hpp"
#include "globalmatch/detail/matching/uncertainty.hpp"
#include "globalmatch/detail/matching/verify.hpp"
#include "globalmatch/detail/survey/overlap_index.hpp"
#include "globalmatch/detail/survey/plan_pose.hpp"
#include "globalmatch/detail/survey/survey_link.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/matching_options.hpp"

namespace globalmatch::detail {

/// Tries of the evidence of plantations, each of which takes as long as some hundred others.
struct plantation_tries {
  std::size_t left = 0;
};

/// What the evidence of a regular plantation makes of a hypothesis: the best one in its place; nothing where
/// another transform of the lattice explains the stems about as well.
inline std::optional<local_hypothesis> decide_in_plantation(local_hypothesis&& h,
                                                            const matching_context& context,
                                                            const prepared_stems& target) {
  const matching_options options;
  matching_funnel funnel;
  position_evidence positions(context, target, options, funnel, false);
  std::vector<local_hypothesis> hypotheses;
  hypotheses.push_back(std::move(h));
  refine(hypotheses, positions, context);
  add_planting_evidence({find_lattice(*context.source_index), find_lattice(*context.target_index)}, positions,
                        context, hypotheses);
  keep_best(hypotheses, max_hypotheses);
  if (decide(hypotheses, context).outcome != outcome::registered) return std::nullopt;
  return std::move(hypotheses.front());
}

/// The transform of a candidate over all stems, scored; nothing where chance does as well. `sufficient`: the
/// log10 NFA up to which the evidence of a plantation is not asked.
inline std::optional<local_hypothesis> score_candidate(const overlap_candidate& candidate,
                                                       const matching_context& context,
                                                       const prepared_stems& source,
                                                       const prepared_stems& target, double sufficient,
                                                       plantation_tries& tries) {
  constexpr double start_threshold = 0.2;  // [m] the coarser of those that triangles are matched at
  constexpr double max_log10_nfa = 0;      // one that is expected among unrelated maps
  constexpr std::size_t min_pairs = 4;     // that determine their noise
  auto h = verify(context, candidate.pairs, start_threshold);
  if (!h || h->correspondences.size() < min_pairs) return std::nullopt;
  null_model null(context, target.background, pairing_thresholds);
  null.include_reversed(source.background);
  score_hypothesis(*h, context, null, pairing_thresholds);
  if (h->log10_nfa_poisson > max_log10_nfa) return std::nullopt;
  null.include_lattice_of(paired_background(*h, context), lattice_of_both(*h, context));
  null.score(*h, null.residuals_under(h->target_from_source, h->inlier_threshold));
  if (h->log10_nfa > sufficient && target.background->has_lattice() && tries.left > 0) {
    --tries.left;
    h = decide_in_plantation(std::move(*h), context, target);
  }
  if (!h || h->log10_nfa > max_log10_nfa || h->correspondences.size() < min_pairs) return std::nullopt;
  return h;
}

/// The link of two maps from pairs of stems, most of them right; nothing where chance does as well, or where
/// the maps stand in rows and a shift along them does. Cost: linear in the stems.
inline std::optional<survey_link> link_maps(std::span<const prepared_stems> maps,
                                            const overlap_candidate& candidate, double sufficient,
                                            plantation_tries& tries) {
  const prepared_stems &from = maps[candidate.source], &to = maps[candidate.target];
  const matching_context context(from.stems, to.stems, from.index, to.index, true, degrees_of_freedom::four);
  auto h = score_candidate(candidate, context, from, to, sufficient, tries);
  if (!h) return std::nullopt;
  complete_pairs(*h, context, pairing_thresholds);
  const auto uncertainty = uncertainty_of(*h, context);
  if (!uncertainty) return std::nullopt;
  survey_link link;
  link.source = candidate.source;
  link.target = candidate.target;
  link.target_from_source = plan_of(h->target_from_source);
  link.center = uncertainty->center.xy();
  link.covariance = plan_covariance(*uncertainty);
  link.log10_nfa = h->log10_nfa;
  link.inlier_threshold = h->inlier_threshold;
  link.rms = h->rms;
  link.correspondences = std::move(h->correspondences);
  return link;
}

}  // namespace globalmatch::detail
