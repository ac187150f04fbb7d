// Decision: is the best hypothesis to be trusted?
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "globalmatch/detail/core/decompositions.hpp"
#include "globalmatch/detail/core/matrices.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/detail/matching/matching_context.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/matching_options.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::detail {

struct decision {
  globalmatch::outcome outcome = outcome::not_registered;
  std::string reason;  ///< names the step and the remedy; empty when registered
};

/// Probability that the best of ranked hypotheses is right: a logistic regression on the logarithm of its
/// NFA, fitted to windows of real stem maps of which half overlap and half have nothing in common
/// (`benchmarks/window_probabilities --pairs 3000 --seed 2`; how well it holds for others is in
/// docs/records/significance.md). Of maps that surely overlap more are right. 0 for fewer pairs than are
/// needed, and 0.9 at most where it is not significant.
inline double probability_of(std::span<const local_hypothesis> hypotheses,
                             const decision_options& options = {}) {
  constexpr double constant = -1.31, nfa_coefficient = -1.83,
                   min_log10_nfa = -6;  // beyond it nothing changes
  constexpr double max_if_insignificant = 0.9;
  if (hypotheses.empty() || hypotheses[0].correspondences.size() < std::size_t(options.min_correspondences))
    return 0;
  const double log10_nfa = hypotheses[0].log10_nfa;
  const double log_odds = constant + nfa_coefficient * std::max(log10_nfa, min_log10_nfa);
  const double probability = 1 / (1 + std::exp(-log_odds));
  return log10_nfa > max_log10_nfa(options) ? std::min(probability, max_if_insignificant) : probability;
}

/// Horizontal standard deviation [m] of the paired source stems, across the line that fits them best.
inline double minor_axis_sigma(const local_hypothesis& h, const position_set& source) {
  vec2 mean = vec2{};
  for (const correspondence& c : h.correspondences) mean += source.at[c.source].xy();
  mean /= double(h.correspondences.size());
  mat2 covariance = mat2{};
  for (const correspondence& c : h.correspondences) {
    const vec2 d = source.at[c.source].xy() - mean;
    covariance += outer(d, d) / double(h.correspondences.size());
  }
  return std::sqrt(std::max(0.0, symmetric_eigen(covariance).values.x));
}

/// Text of several parts.
inline std::string text(std::initializer_list<std::string_view> parts) {
  std::string result;
  for (const std::string_view part : parts) result.append(part);
  return result;
}

/// Why the stems that two maps have, or that the best hypothesis pairs, are too few; empty where they are
/// not.
inline std::string describe_few_stems(std::span<const local_hypothesis> hypotheses,
                                      const matching_context& context, std::size_t minimum) {
  const std::string needed = text({" stems, at least ", std::to_string(minimum), " are needed; "});
  const char* const remedy = "scan a larger part of the plot, or look at where its stems were lost";
  if (const std::size_t size = context.source.size(); size < minimum)
    return text({"source: ", std::to_string(size), needed, remedy});
  if (const std::size_t size = context.target.size(); size < minimum)
    return text({"target: ", std::to_string(size), needed, remedy});
  const std::size_t best = hypotheses.empty() ? 0 : hypotheses.front().correspondences.size();
  if (best >= minimum) return {};
  return text({"matching: the best transform pairs ", std::to_string(best), needed,
               "the scans overlap too little or the tolerance is too small"});
}

/// Whether the best hypothesis is to be trusted: enough stems, not in a line, significant, and no
/// alternative that explains the stems nearly as well. Heights have no say (`vertical_fit`). `hypotheses` are
/// ranked, distinct, scored at one threshold, and in the frames of `context`.
inline decision decide(std::span<const local_hypothesis> hypotheses, const matching_context& context,
                       const decision_options& options = {}) {
  require_valid(options);
  const auto minimum = std::size_t(options.min_correspondences);
  if (std::string few = describe_few_stems(hypotheses, context, minimum); !few.empty())
    return {outcome::not_registered, std::move(few)};
  const local_hypothesis& best = hypotheses.front();
  const std::string pairs = std::to_string(best.correspondences.size());
  if (minor_axis_sigma(best, context.source) < options.min_minor_axis_sigma)
    return {outcome::not_registered,
            text({"matching: the ", pairs,
                  " paired stems lie in a line; scans with a wider overlap are needed"})};
  const std::size_t second = hypotheses.size() > 1 ? hypotheses[1].correspondences.size() : 0;
  const bool not_significant = best.log10_nfa > max_log10_nfa(options);
  // A plantation explains every shift along itself: so many stems are paired, and that is no evidence.
  const bool alternative_on_lattice = not_significant && best.log10_nfa_poisson <= max_log10_nfa(options);
  const bool alternative =
      second > 0 && hypotheses[1].log10_nfa <= options.alternative_share * best.log10_nfa;
  if (alternative_on_lattice || (!not_significant && alternative))
    return {outcome::ambiguous,
            text({"matching: the best transform pairs ", pairs, " stems and another one ",
                  std::to_string(second), "; more overlap is needed to tell them apart"})};
  if (not_significant)
    return {outcome::not_registered, text({"matching: the best transform pairs ", pairs,
                                           " stems, which is not significant; more overlap is needed"})};
  return {outcome::registered, ""};
}

}  // namespace globalmatch::detail
