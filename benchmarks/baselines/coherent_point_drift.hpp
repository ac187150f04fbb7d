// Rigid coherent point drift (Myronenko and Song 2010, "Point set registration: coherent point drift", IEEE
// TPAMI 32(12), Fig. 2) on stems in plan: the source stems are centroids of a mixture of Gaussians of equal
// variance, beside a uniform part for outliers, that is fitted to the target stems by expectation
// maximization. Steps and formulas are theirs, with the scale held at 1.
//
// Ours: rotation about the vertical alone; as EM finds the nearest optimum it starts at several yaws, and the
// most likely end is taken; the weight of outliers, which they leave to the user; the height is the median of
// what stems ask for that correspond. Radii are not used. Cost: iterations times source times target stems.
#pragma once

#include <globalmatch/detail/core/rigid_fit.hpp>
#include <globalmatch/detail/core/statistics.hpp>

#include "baselines/stem_alignment.hpp"

#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

namespace globalmatch::benchmarks {

struct drift_options {
  double outlier_weight = 0.5;  ///< w: about as many stems are not in both maps
  int yaws = 12;                ///< starts, evenly spaced
  int max_iterations = 150;
  double relative_tolerance = 1e-6;  ///< of the negative log-likelihood, to end
  double min_sigma = 1e-3;           ///< [m] of the Gaussians
};

/// Where EM stands.
struct drift_state {
  rigid target_from_source = {};
  double variance = 0;  ///< sigma^2 [m^2]
  double negative_log_likelihood = std::numeric_limits<double>::infinity();
};

/// What the E-step sums for each source stem: with the posteriors P, P 1 and P X, and of all P |x|^2.
struct drift_posteriors {
  std::vector<double> weights = {};
  std::vector<vec3> sums = {};
  double squares = 0, negative_log_likelihood = 0;
  std::vector<double> vertical_offsets = {};  ///< [m] of stems that correspond with a posterior above a half
};

inline drift_posteriors drift_expectation(const position_set& source, const position_set& target,
                                          const drift_state& state, double outlier_weight) {
  drift_posteriors all{.weights = std::vector<double>(source.size()),
                       .sums = std::vector<vec3>(source.size())};
  std::vector<vec2> transformed;
  for (const vec3& p : source.at) transformed.push_back((state.target_from_source * p).xy());
  const double m = double(source.size()), n = double(target.size());
  const double uniform_part =
      2 * std::numbers::pi * state.variance * outlier_weight / (1 - outlier_weight) * m / n;
  std::vector<double> densities(source.size());
  for (const vec3& x : target.at) {
    poll_cancelled();
    double sum = uniform_part;
    for (std::size_t s = 0; s < source.size(); ++s)
      sum += densities[s] = std::exp(-(x.xy() - transformed[s]).squared_norm() / (2 * state.variance));
    all.negative_log_likelihood -= std::log(sum / state.variance);
    for (std::size_t s = 0; s < source.size(); ++s) {
      const double posterior = densities[s] / sum;
      all.weights[s] += posterior;
      all.sums[s] += posterior * x;
      all.squares += posterior * x.xy().squared_norm();
      if (posterior > 0.5) all.vertical_offsets.push_back(x.z - source.at[s].z);
    }
  }
  return all;
}

/// The M-step: the weighted fit of the source stems to the means of their posteriors, and the variance that
/// is left. Nothing where no stem corresponds to any.
inline std::optional<drift_state> drift_maximization(const position_set& source, const drift_posteriors& all,
                                                     double min_sigma) {
  std::vector<vec3> means(source.size());
  double total = 0;
  for (std::size_t s = 0; s < source.size(); ++s) {
    total += all.weights[s];
    if (all.weights[s] > 0) means[s] = all.sums[s] / all.weights[s];
  }
  const auto transform = fit_rigid(source.at, means, degrees_of_freedom::four, all.weights);
  if (!transform) return std::nullopt;
  double squares = all.squares;
  for (std::size_t s = 0; s < source.size(); ++s) {
    const vec2 at = (*transform * source.at[s]).xy();
    squares += all.weights[s] * at.squared_norm() - 2 * at.dot(all.sums[s].xy());
  }
  constexpr double dimension = 2;
  return drift_state{*transform, std::max(squares / (dimension * total), min_sigma * min_sigma),
                     all.negative_log_likelihood};
}

/// Mean square distance [m^2] by coordinate of any two stems under a transform: where EM starts.
inline double initial_variance(const position_set& source, const position_set& target,
                               const rigid& target_from_source) {
  double squares = 0;
  for (const vec3& p : source.at)
    for (const vec3& x : target.at) squares += (x.xy() - (target_from_source * p).xy()).squared_norm();
  return squares / (2 * double(source.size()) * double(target.size()));
}

/// EM from one yaw [rad], the centroids of both maps upon each other. Nothing where no height follows.
inline std::optional<drift_state> drift_from(const position_set& source, const position_set& target,
                                             double yaw, const drift_options& options,
                                             matching_funnel& funnel) {
  vec3 source_mean, target_mean;
  for (const vec3& p : source.at) source_mean += p / double(source.size());
  for (const vec3& p : target.at) target_mean += p / double(target.size());
  drift_state state{.target_from_source = {rotation_about_z(yaw), {}}};
  state.target_from_source.translation = target_mean - state.target_from_source.rotation * source_mean;
  state.variance = initial_variance(source, target, state.target_from_source);
  if (!(state.variance > 0)) return std::nullopt;
  for (int i = 0; i < options.max_iterations; ++i) {
    ++funnel.tested;
    const auto posteriors = drift_expectation(source, target, state, options.outlier_weight);
    const auto next = drift_maximization(source, posteriors, options.min_sigma);
    if (!next) return std::nullopt;
    const double before = state.negative_log_likelihood;
    state = *next;
    if (std::abs(before - state.negative_log_likelihood) <=
        options.relative_tolerance * std::abs(state.negative_log_likelihood))
      break;
  }
  auto offsets = drift_expectation(source, target, state, options.outlier_weight).vertical_offsets;
  if (offsets.empty()) return std::nullopt;
  state.target_from_source.translation.z = median(offsets);
  return state;
}

/// The most likely of all starts; nothing for fewer than three stems.
inline std::optional<drift_state> drift(const position_set& source, const position_set& target,
                                        matching_funnel& funnel, const drift_options& options = {}) {
  std::optional<drift_state> best;
  if (std::min(source.size(), target.size()) < 3) return best;
  for (int k = 0; k < options.yaws; ++k) {
    const double yaw = 2 * std::numbers::pi * k / options.yaws;
    const auto end = drift_from(source, target, yaw, options, funnel);
    if (end && (!best || end->negative_log_likelihood < best->negative_log_likelihood)) best = end;
  }
  return best;
}

inline match_run run_coherent_point_drift(const two_maps& maps, const run_limits& limits) {
  return run_within(limits, 0, [&](const execution&) {
    const position_set source = import_stems(maps.source, {}, "source");
    const position_set target = import_stems(maps.target, {}, "target");
    match_run run{.funnel = {.source_stems = source.size(), .target_stems = target.size()}};
    if (const auto best = drift(source, target, run.funnel))
      run.target_from_source = in_scan_frames(best->target_from_source, source, target);
    return run;
  });
}

}  // namespace globalmatch::benchmarks
