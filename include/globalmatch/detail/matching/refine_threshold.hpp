// A hypothesis, refitted at other thresholds than its own. In: the best one of the proposal. Out: the same,
// or one of a smaller NFA near it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "globalmatch/detail/matching/evidence.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/detail/matching/matching_context.hpp"
#include "globalmatch/detail/matching/position_evidence.hpp"
#include "globalmatch/detail/matching/robust_fit.hpp"

namespace globalmatch::detail {

/// Refits `finer` at each threshold below its own, from the transform of the coarser one, and puts that of
/// the smallest NFA in place of `best` where it is smaller; returns whether it did.
inline bool refit_below(local_hypothesis& best, local_hypothesis finer, const position_evidence& positions,
                        const matching_context& context) {
  const double coarsest = finer.inlier_threshold;
  const auto thresholds = positions.pairing();
  bool found = false;
  for (std::size_t i = thresholds.size(); i-- > 0;) {
    if (thresholds[i] >= coarsest) continue;
    finer.inlier_threshold = thresholds[i];
    // Pairs are taken nearest first: those within a threshold are the same whatever the coarser one was.
    std::erase_if(finer.correspondences, [&](const correspondence& c) {
      return context.residual(finer.target_from_source, c) >= thresholds[i];
    });
    if (finer.correspondences.size() < min_robust_pairs) break;
    fit_robustly(finer, context);
    const evidence_score scored = positions.score(finer);
    finer.log10_nfa = scored.log10_nfa;
    finer.log10_nfa_poisson = scored.log10_nfa_poisson;
    if (!(finer.log10_nfa < best.log10_nfa)) continue;
    best = finer;
    found = true;
  }
  return found;
}

/// Refits a hypothesis at finer thresholds, as a few stems that are paired wrongly at a coarse one hold the
/// transform off the place where most fit closely; and from the coarsest where many more fit at that, as a
/// few at a fine one hold it off the place where many more do. Not in large maps, where a few have no say.
/// Returns whether it changed.
inline bool refine_threshold(local_hypothesis& best, const position_evidence& positions,
                             const matching_context& context) {
  constexpr std::size_t max_pairs = 4096;
  constexpr double many_more = 1.5;
  bool changed = false;
  if (best.correspondences.size() <= max_pairs) changed = refit_below(best, best, positions, context);
  if (std::min(context.source.size(), context.target.size()) > max_pairs) return changed;
  local_hypothesis coarse = best;
  coarse.correspondences = context.pair_stems(best.target_from_source, positions.pairing().back());
  if (double(coarse.correspondences.size()) <= many_more * double(best.correspondences.size()))
    return changed;
  coarse.inlier_threshold = std::numeric_limits<double>::infinity();  // refitted at the coarsest as well
  return refit_below(best, std::move(coarse), positions, context) || changed;
}

}  // namespace globalmatch::detail
