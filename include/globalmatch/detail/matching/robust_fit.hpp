// Robust refit: the transform of a hypothesis from all its pairs, weighted by how certain the stems are and by
// how well they fit, until convergence.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/detail/matching/matching_context.hpp"
#include "globalmatch/matching.hpp"

namespace globalmatch::detail {

/// Pairs that a robust fit needs: fewer do not determine their noise.
inline constexpr std::size_t min_robust_pairs = 6;

/// Variance [m^2] of each coordinate of the residual of a pair, as the caller knows the stems.
inline double known_variance(const matching_context& context, const correspondence& c) {
  const auto of = [](const position_set& stems, stem_index i) {
    return stems.sigma.empty() ? 0 : stems.sigma[i] * stems.sigma[i];
  };
  return of(context.source, c.source) + of(context.target, c.target);
}

/// Variance [m^2] of each coordinate of the residuals, from their median, which some wrong pairs do not change.
inline double observed_variance(const matching_context& context, const local_hypothesis& h) {
  const std::size_t dimensions = context.horizontal_distances() ? 2 : 3,
                    unknowns = context.horizontal_distances() ? 3 : 6;
  const double median_of_chi_squared = context.horizontal_distances() ? 1.386 : 2.366;
  const std::size_t coordinates = dimensions * h.correspondences.size();
  std::vector<double> squares = context.residuals(h.target_from_source, h.correspondences);
  for (double& r : squares) r *= r;
  const double fitted = double(coordinates) / double(coordinates - std::min(coordinates - 1, unknowns));
  return fitted * median(squares) / median_of_chi_squared;
}

/// The first of `thresholds` [m], increasing, that three standard deviations of the residuals do not exceed,
/// or the last one; that of `h` where there are none.
inline double threshold_from_residuals(const matching_context& context, const local_hypothesis& h,
                                       std::span<const double> thresholds) {
  constexpr double deviations = 3;
  const double required = deviations * std::sqrt(observed_variance(context, h));
  for (const double inlier_threshold : thresholds)
    if (inlier_threshold >= required) return inlier_threshold;
  return thresholds.empty() ? h.inlier_threshold : thresholds.back();
}

/// What the known variances leave unexplained of the observed one [m^2], as in a model of random effects.
inline double unknown_variance(const matching_context& context, const local_hypothesis& h) {
  // No pair is much more certain than all of them look, and the weights of perfect maps are finite.
  constexpr double min_share = 0.1, minimum = 1e-6;  // [m]
  std::vector<double> known;
  for (const correspondence& c : h.correspondences) known.push_back(known_variance(context, c));
  const double observed = observed_variance(context, h), least = std::max(minimum * minimum, min_share * observed);
  const double rest = observed - median(known);
  return least < rest ? rest : least;
}

/// Of each pair: the inverse of its variance, less the larger its residual is, 0 for one that cannot belong to
/// the rest: Beaton and Tukey 1974, The fitting of power series, Technometrics 16(2), with the usual constant.
inline std::vector<double> robust_weights(const matching_context& context, const local_hypothesis& h,
                                          double unknown) {
  constexpr double tukey_constant = 4.685;  // standard deviations
  std::vector<double> weights = context.residuals(h.target_from_source, h.correspondences);
  for (std::size_t i = 0; i < weights.size(); ++i) {
    const double variance = known_variance(context, h.correspondences[i]) + unknown;
    const double off = weights[i] * weights[i] / (variance * tukey_constant * tukey_constant);
    weights[i] = off < 1 ? (1 - off) * (1 - off) / variance : 0;
  }
  return weights;
}

/// Fits the transform to the pairs with weights that follow it, until it moves none of them by more than
/// `convergence_threshold` [m]. Returns whether it had to move.
inline bool reweight_and_fit(local_hypothesis& h, const matching_context& context, double unknown,
                             double convergence_threshold) {
  constexpr int max_iterations = 20;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    poll_cancelled();
    const auto transform = context.fit(h.correspondences, robust_weights(context, h, unknown));
    if (!transform) return false;
    double max_displacement = 0;
    for (const correspondence& c : h.correspondences)
      max_displacement =
          std::max(max_displacement, context.displacement(*transform, h.target_from_source, c.source));
    h.target_from_source = *transform;
    if (max_displacement < convergence_threshold) return iteration > 0;
  }
  return true;
}

/// Refits the transform of a hypothesis and re-pairs all stems at its threshold, until convergence: stems count
/// as much as `position_sigma` makes them certain, and pairs that fit badly count less. The noise is that of
/// the hypothesis as given, so that it cannot shrink onto a few pairs. Hypotheses of fewer than six pairs stay
/// as they are. In 4-DoF weights are of horizontal distances, and the height stays the median of what the
/// pairs ask for. Cost: linear in the stems.
inline void fit_robustly(local_hypothesis& h, const matching_context& context) {
  constexpr int max_iterations = 10;
  constexpr double relative_convergence_threshold = 0.01;  // of the inlier threshold
  if (h.correspondences.size() < min_robust_pairs) return;
  const double unknown = unknown_variance(context, h);
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    local_hypothesis fitted = h;
    const bool has_moved =
        reweight_and_fit(fitted, context, unknown, relative_convergence_threshold * h.inlier_threshold);
    fitted.correspondences = context.pair_stems(fitted.target_from_source, h.inlier_threshold);
    if (fitted.correspondences.size() < min_robust_pairs) return;
    fitted.rms = context.rms(fitted.target_from_source, fitted.correspondences);
    h = std::move(fitted);
    if (!has_moved) return;
  }
}

/// Pairs stems also beyond the threshold of the smallest NFA, which leaves out one true pair in ten or more:
/// within the first of `thresholds` [m], increasing, that three standard deviations of the residuals do not
/// exceed; then fits robustly. The NFA stays what it was.
inline void complete_pairs(local_hypothesis& h, const matching_context& context,
                           std::span<const double> thresholds) {
  if (h.correspondences.size() < min_robust_pairs) return;
  local_hypothesis wider = h;
  wider.inlier_threshold = std::max(h.inlier_threshold, threshold_from_residuals(context, h, thresholds));
  if (wider.inlier_threshold > h.inlier_threshold) {
    wider.correspondences = context.pair_stems(h.target_from_source, wider.inlier_threshold);
    wider.rms = context.rms(h.target_from_source, wider.correspondences);
  }
  fit_robustly(wider, context);
  h = std::move(wider);
}

}  // namespace globalmatch::detail
