// Scoring of a hypothesis by positions, with the threshold that fits it best.
#pragma once

#include <limits>
#include <span>

#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/detail/matching/matching_context.hpp"
#include "globalmatch/detail/matching/null_model.hpp"

namespace globalmatch::detail {

/// Mean distance [m] between where two transforms place the source stems of pairs.
inline double mean_displacement(const rigid& a, const rigid& b, std::span<const correspondence> pairs,
                                const matching_context& context) {
  double mean = 0;
  for (const correspondence& c : pairs) mean += context.displacement(a, b, c.source) / double(pairs.size());
  return mean;
}

/// Scores a hypothesis, in the frames of `context`, and re-pairs and refits it at the threshold [m] among
/// `thresholds`, increasing, of the smallest NFA. Cost: linear in the stems.
inline void score_hypothesis(local_hypothesis& h, const matching_context& context, const null_model& null,
                             std::span<const double> thresholds) {
  constexpr int max_iterations = 4;
  constexpr double relative_convergence_threshold = 0.1;  // of the inlier threshold
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    const double before = h.inlier_threshold;
    const null_model::residual_set set = null.residuals_under(h.target_from_source, thresholds.back());
    double smallest = std::numeric_limits<double>::infinity();
    for (const double inlier_threshold : thresholds) {
      const double log10_nfa = null.log10_nfa(set, inlier_threshold);
      if (!(log10_nfa < smallest)) continue;
      smallest = log10_nfa;
      h.inlier_threshold = inlier_threshold;
    }
    null.score(h, set);
    const auto pairs = context.pair_stems(h.target_from_source, h.inlier_threshold);
    const auto transform = context.fit(pairs);
    if (!transform) break;
    const double moved = mean_displacement(*transform, h.target_from_source, pairs, context);
    h.target_from_source = *transform;
    if (moved < relative_convergence_threshold * h.inlier_threshold && h.inlier_threshold == before) break;
  }
  h.correspondences = context.pair_stems(h.target_from_source, h.inlier_threshold);
  h.rms = context.rms(h.target_from_source, h.correspondences);
}

}  // namespace globalmatch::detail
