// Robust re-estimation: the motion of a hypothesis from all its pairs, weighed by how certain the stems are
// and by how well they fit, until it stands.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::detail {

/// Variance [m^2] of each coordinate of the residual of a pair, as the caller knows the stems.
inline double known_variance(const matching_context& context, const correspondence& c) {
  const auto of = [](const position_set& stems, stem_index i) {
    return stems.sigma.empty() ? 0 : stems.sigma[i] * stems.sigma[i];
  };
  return of(context.source, c.source) + of(context.target, c.target);
}

/// Variance [m^2] of each coordinate of the residuals, from their median, which some wrong pairs do not move.
inline double observed_variance(const matching_context& context, const local_hypothesis& h) {
  const std::size_t dimensions = context.horizontal_distances() ? 2 : 3,
                    unknowns = context.horizontal_distances() ? 3 : 6;
  const double median_of_chi_squared = context.horizontal_distances() ? 1.386 : 2.366;
  const std::size_t coordinates = dimensions * h.correspondences.size();
  std::vector<double> squares;
  for (const correspondence& c : h.correspondences)
    squares.push_back(std::pow(context.residual(h.target_from_source, c), 2));
  const double fitted = double(coordinates) / double(coordinates - std::min(coordinates - 1, unknowns));
  return fitted * median(squares) / median_of_chi_squared;
}

/// The first of `thresholds` [m], increasing, that three standard deviations of the residuals do not exceed,
/// or the last one; that of `h` where there are none.
inline double threshold_from_residuals(const matching_context& context, const local_hypothesis& h,
                                       std::span<const double> thresholds) {
  constexpr double deviations = 3;
  const double required_threshold = deviations * std::sqrt(observed_variance(context, h));
  const auto wide_enough = std::find_if(thresholds.begin(), thresholds.end(), [&](double inlier_threshold) {
    return inlier_threshold >= required_threshold;
  });
  if (thresholds.empty()) return h.inlier_threshold;
  return wide_enough == thresholds.end() ? thresholds.back() : *wide_enough;
}

/// What the known variances leave of it unexplained, as in a model of random effects.
inline double unknown_variance(const matching_context& context, const local_hypothesis& h) {
  std::vector<double> known;
  for (const correspondence& c : h.correspondences) known.push_back(known_variance(context, c));
  // No pair is much more certain than all of them look, and the weights of perfect maps are finite.
  constexpr double min_share = 0.1, minimum = 1e-6;  // [m]
  const double observed = observed_variance(context, h);
  return std::max({minimum * minimum, min_share * observed, observed - median(known)});
}

/// Of each pair: the inverse of its variance, less the further it is off, 0 for one that cannot belong to the
/// rest: Beaton and Tukey 1974, The fitting of power series, Technometrics 16(2), with the usual constant.
inline std::vector<double> robust_weights(const matching_context& context, const local_hypothesis& h,
                                          double unknown) {
  constexpr double tukey_constant = 4.685;  // standard deviations
  std::vector<double> weights;
  weights.reserve(h.correspondences.size());
  for (const correspondence& c : h.correspondences) {
    const double variance = known_variance(context, c) + unknown;
    const double off =
        std::pow(context.residual(h.target_from_source, c), 2) / (variance * tukey_constant * tukey_constant);
    weights.push_back(off < 1 ? std::pow(1 - off, 2) / variance : 0);
  }
  return weights;
}

/// Fits the motion to the pairs with weights that follow it, until it moves none of them by more than
/// `convergence_threshold` [m]. Returns whether it had to move.
inline bool reweight_and_fit(local_hypothesis& h, const matching_context& context, double unknown,
                             double convergence_threshold) {
  constexpr int max_iterations = 20;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    const auto transform = context.fit(h.correspondences, robust_weights(context, h, unknown));
    if (!transform) return false;
    double max_displacement = 0;
    for (const correspondence& c : h.correspondences) {
      const vec3& p = context.source.at[c.source];
      max_displacement = std::max(max_displacement, stem_distance(*transform * p, h.target_from_source * p,
                                                                  context.horizontal_distances()));
    }
    h.target_from_source = *transform;
    if (max_displacement < convergence_threshold) return iteration > 0;
  }
  return true;
}

/// Fits the motion of a hypothesis anew and pairs all stems under it at its tolerance, until it stands: stems
/// count as much as `position_sigma` makes them certain, and pairs that fit badly count less. The scatter is
/// that of the hypothesis as given, so that it cannot shrink onto a few pairs. Hypotheses of fewer than six
/// pairs tell no scatter and stay as they are. In 4-DoF weights are of distances in plan, and the height
/// stays the median of what the pairs ask for. Cost: linear in the stems.
inline void fit_robustly(local_hypothesis& h, const matching_context& context) {
  constexpr std::size_t minimum = 6;
  constexpr int max_iterations = 10;
  constexpr double relative_convergence_threshold = 0.01;  // of the tolerance
  if (h.correspondences.size() < minimum) return;
  const double unknown = unknown_variance(context, h);
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    local_hypothesis fitted = h;
    const bool has_moved =
        reweight_and_fit(fitted, context, unknown, relative_convergence_threshold * h.inlier_threshold);
    fitted.correspondences = context.pair_stems(fitted.target_from_source, h.inlier_threshold);
    if (fitted.correspondences.size() < minimum) return;
    fitted.rms = context.rms(fitted.target_from_source, fitted.correspondences);
    h = std::move(fitted);
    if (!has_moved) return;
  }
}

/// Pairs stems also beyond the tolerance at which chance explains least, which leaves out one true pair in
/// ten or more: within the first of `thresholds` [m], increasing, that three standard deviations of the
/// residuals do not exceed; then fits robustly. What chance makes of the hypothesis is left as it was judged.
inline void complete_pairs(local_hypothesis& h, const matching_context& context,
                           std::span<const double> thresholds) {
  constexpr std::size_t minimum = 6;
  if (h.correspondences.size() < minimum) return;
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
