// A hypothesis, refitted at other thresholds than its own. In: the best one of the proposal. Out: the same,
// or one of a smaller NFA near it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>

#include "globalmatch/detail/matching/evidence.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/detail/matching/matching_context.hpp"
#include "globalmatch/detail/matching/position_evidence.hpp"
#include "globalmatch/detail/matching/robust_fit.hpp"

namespace globalmatch::detail {

/// Refits a hypothesis at each threshold below `coarsest`, from the transform of the coarser one, and keeps
/// the one of the smallest NFA.
inline void refit_below(local_hypothesis& best, double coarsest, const position_evidence& positions,
                        const matching_context& context) {
  local_hypothesis finer = best;
  const auto thresholds = positions.pairing();
  for (std::size_t i = thresholds.size(); i-- > 0;) {
    if (thresholds[i] >= coarsest) continue;
    finer.inlier_threshold = thresholds[i];
    finer.correspondences = context.pair_stems(finer.target_from_source, thresholds[i]);
    if (finer.correspondences.size() < min_robust_pairs) return;
    fit_robustly(finer, context);
    const evidence_score scored = positions.score(finer);
    finer.log10_nfa = scored.log10_nfa;
    finer.log10_nfa_poisson = scored.log10_nfa_poisson;
    if (finer.log10_nfa < best.log10_nfa) best = finer;
  }
}

/// Refits a hypothesis at finer thresholds, as a few stems that are paired wrongly at a coarse one hold the
/// transform off the place where most fit closely; and from the coarsest where many more fit at that, as a
/// few at a fine one hold it off the place where many more do. Not in large maps, where a few have no say.
inline void refine_threshold(local_hypothesis& best, const position_evidence& positions,
                             const matching_context& context) {
  constexpr std::size_t max_pairs = 4096;
  constexpr double many_more = 1.5;
  if (best.correspondences.size() <= max_pairs) refit_below(best, best.inlier_threshold, positions, context);
  if (std::min(context.source.size(), context.target.size()) > max_pairs) return;
  const auto coarse = context.pair_stems(best.target_from_source, positions.pairing().back());
  if (double(coarse.size()) > many_more * double(best.correspondences.size()))
    refit_below(best, std::numeric_limits<double>::infinity(), positions, context);
}

}  // namespace globalmatch::detail
