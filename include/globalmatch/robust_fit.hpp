// Robust re-estimation: the motion of a hypothesis from all its pairs, weighed by how certain the stems are
// and by how well they fit, until it stands.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/hypothesis.hpp"
#include "globalmatch/statistics.hpp"

namespace globalmatch {

namespace detail {

/// Variance [m^2] of each coordinate of the misfit of a pair, as the caller knows the stems.
inline double known_variance(const map_pair& maps, const correspondence& c) {
  const auto of = [](const position_set& stems, stem_index i) {
    return stems.sigma.empty() ? 0 : stems.sigma[i] * stems.sigma[i];
  };
  return of(maps.source, c.source) + of(maps.target, c.target);
}

/// Variance [m^2] of each coordinate of the misfits, from their median, which some wrong pairs do not move.
inline double observed_variance(const map_pair& maps, const hypothesis& h) {
  const std::size_t dimensions = maps.in_plan() ? 2 : 3, unknowns = maps.in_plan() ? 3 : 6;
  const double median_of_chi_squared = maps.in_plan() ? 1.386 : 2.366;
  const std::size_t coordinates = dimensions * h.correspondences.size();
  std::vector<double> squares;
  for (const correspondence& c : h.correspondences)
    squares.push_back(std::pow(maps.misfit(h.target_from_source, c), 2));
  const double fitted = double(coordinates) / double(coordinates - std::min(coordinates - 1, unknowns));
  return fitted * median(squares) / median_of_chi_squared;
}

/// The first of `tolerances` [m], increasing, that three standard deviations of the misfits do not exceed, or
/// the last one; that of `h` where there are none.
inline double tolerance_of_scatter(const map_pair& maps, const hypothesis& h,
                                   std::span<const double> tolerances) {
  constexpr double deviations = 3;
  const double wanted = deviations * std::sqrt(observed_variance(maps, h));
  const auto wide_enough = std::find_if(tolerances.begin(), tolerances.end(),
                                        [&](double tolerance) { return tolerance >= wanted; });
  if (tolerances.empty()) return h.tolerance;
  return wide_enough == tolerances.end() ? tolerances.back() : *wide_enough;
}

/// What the known variances leave of it unexplained, as in a model of random effects.
inline double unknown_variance(const map_pair& maps, const hypothesis& h) {
  std::vector<double> known;
  for (const correspondence& c : h.correspondences) known.push_back(known_variance(maps, c));
  // No pair is much more certain than all of them look, and the weights of perfect maps are finite.
  constexpr double least_share = 0.1, least = 1e-6;  // [m]
  const double observed = observed_variance(maps, h);
  return std::max({least * least, least_share * observed, observed - median(known)});
}

/// Of each pair: the inverse of its variance, less the further it is off, 0 for one that cannot belong to the
/// rest: Beaton and Tukey 1974, The fitting of power series, Technometrics 16(2), with the usual constant.
inline std::vector<double> robust_weights(const map_pair& maps, const hypothesis& h, double unknown) {
  constexpr double farthest = 4.685;  // standard deviations
  std::vector<double> weights;
  weights.reserve(h.correspondences.size());
  for (const correspondence& c : h.correspondences) {
    const double variance = known_variance(maps, c) + unknown;
    const double off = std::pow(maps.misfit(h.target_from_source, c), 2) / (variance * farthest * farthest);
    weights.push_back(off < 1 ? std::pow(1 - off, 2) / variance : 0);
  }
  return weights;
}

/// Fits the motion to the pairs with weights that follow it, until it moves none of them by more than `still`
/// [m]. Returns whether it had to move.
inline bool reweigh_and_fit(hypothesis& h, const map_pair& maps, double unknown, double still) {
  constexpr int rounds = 20;
  for (int round = 0; round < rounds; ++round) {
    const auto motion = maps.fit(h.correspondences, robust_weights(maps, h, unknown));
    if (!motion) return false;
    double moved = 0;
    for (const correspondence& c : h.correspondences) {
      const Eigen::Vector3d& p = maps.source.at[c.source];
      moved = std::max(moved, stem_distance(*motion * p, h.target_from_source * p, maps.in_plan()));
    }
    h.target_from_source = *motion;
    if (moved < still) return round > 0;
  }
  return true;
}

}  // namespace detail

/// Fits the motion of a hypothesis anew and pairs all stems under it at its tolerance, until it stands: stems
/// count as much as `position_sigma` makes them certain, and pairs that fit badly count less. The scatter is
/// that of the hypothesis as given, so that it cannot shrink onto a few pairs. Hypotheses of fewer than six
/// pairs tell no scatter and stay as they are. In 4-DoF weights are of distances in plan, and the height
/// stays the median of what the pairs ask for. Cost: linear in the stems.
inline void fit_robustly(hypothesis& h, const map_pair& maps) {
  constexpr std::size_t least = 6;
  constexpr int rounds = 10;
  constexpr double still = 0.01;  // of the tolerance
  if (h.correspondences.size() < least) return;
  const double unknown = detail::unknown_variance(maps, h);
  for (int round = 0; round < rounds; ++round) {
    hypothesis fitted = h;
    const bool moved = detail::reweigh_and_fit(fitted, maps, unknown, still * h.tolerance);
    fitted.correspondences = maps.pair_stems(fitted.target_from_source, h.tolerance);
    if (fitted.correspondences.size() < least) return;
    fitted.rms = maps.rms(fitted.target_from_source, fitted.correspondences);
    h = std::move(fitted);
    if (!moved) return;
  }
}

/// Pairs stems also beyond the tolerance at which chance explains least, which leaves out one true pair in
/// ten or more: within the first of `tolerances` [m], increasing, that three standard deviations of the
/// misfits do not exceed; then fits robustly. What chance makes of the hypothesis is left as it was judged.
inline void complete_pairs(hypothesis& h, const map_pair& maps, std::span<const double> tolerances) {
  constexpr std::size_t least = 6;
  if (h.correspondences.size() < least) return;
  hypothesis wider = h;
  wider.tolerance = std::max(h.tolerance, detail::tolerance_of_scatter(maps, h, tolerances));
  if (wider.tolerance > h.tolerance) {
    wider.correspondences = maps.pair_stems(h.target_from_source, wider.tolerance);
    wider.rms = maps.rms(h.target_from_source, wider.correspondences);
  }
  fit_robustly(wider, maps);
  h = std::move(wider);
}

}  // namespace globalmatch
