// Robust estimates by Student's t of three degrees of freedom: the most likely parameters and scale where
// some residuals are much larger than most (Lange, Little and Taylor 1989, Robust statistical modeling using
// the t distribution, J. American Statistical Association 84).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "globalmatch/detail/core/small_solver.hpp"
#include "globalmatch/detail/core/threads.hpp"

namespace globalmatch::detail {

/// One coordinate of an observation: `right` is the product of `row` and the parameters, but for noise.
struct observed_coordinate {
  small_vector row{};
  double right = 0;
};

/// What was observed together: `dimensions` coordinates, whose noise has the standard deviation `relative`
/// times a scale that is not known.
struct observation {
  std::array<observed_coordinate, 2> coordinates;
  double relative = 1;
  double square = 0, weight = 1;  ///< of the residual, in units of `relative`; estimated
};

/// Observations of one kind share a scale.
struct observation_kind {
  std::size_t dimensions = 1;  ///< 1 or 2
  std::vector<observation> of = {};
  double scale = 0;  ///< estimated

  double squared_residual(const observation& o, const small_vector& parameters) const {
    double squares = 0;
    for (std::size_t d = 0; d < dimensions; ++d) {
      double rest = o.coordinates[d].right;
      for (std::size_t k = 0; k < parameters.size(); ++k) rest -= o.coordinates[d].row[k] * parameters[k];
      squares += rest * rest;
    }
    return squares / (o.relative * o.relative);
  }
};

inline constexpr double t_degrees = 3;  // of freedom

/// Weight of an observation whose squared residual is `square` of a unit.
inline double t_weight(const observation_kind& kind, double square) {
  return (t_degrees + double(kind.dimensions)) / (t_degrees + square / (kind.scale * kind.scale));
}

/// The most likely parameters and scales.
struct t_estimate {
  small_vector parameters{};
  small_matrix covariance;    ///< of the parameters, for many observations
  double scale = 0;           ///< of the first kind
  double log_likelihood = 0;  ///< but for constants that depend on the observations alone
};

/// Information [1 / unit^2] of one coordinate of an observation, whatever the distribution of residuals: that
/// of an M-estimate (Huber 1964, Robust estimation of a location parameter, Annals of Mathematical Statistics
/// 35), and of few that of normal noise.
inline double information_of(const observation_kind& kind, double min_scale) {
  const auto n = double(kind.dimensions), count = double(kind.of.size());
  double weights = 0, squares = 0, slopes = 0;  // of the influence function
  for (const observation& o : kind.of) {
    const double unit = o.square / (kind.scale * kind.scale);
    weights += o.weight;
    squares += o.weight * o.weight * unit / n;
    slopes += o.weight * (1 - 2 * unit / n / (t_degrees + unit));
  }
  const double of_normal = weights / (kind.dimensions == 1 ? 1.868 : 1.736);
  if (!(kind.scale > min_scale)) return of_normal / (kind.scale * kind.scale * count);
  constexpr double prior = 10;  // numbers; influences of fewer do not tell much
  const double of_all = (prior * of_normal + count * n * slopes * slopes / squares) / (prior + count * n);
  return of_all / (kind.scale * kind.scale * count);
}

inline small_matrix covariance_of(std::span<const observation_kind> kinds, std::size_t unknowns,
                                  double min_scale) {
  small_matrix normal;
  normal.size = unknowns;
  for (const observation_kind& kind : kinds) {
    const double information = information_of(kind, min_scale);
    for (const observation& o : kind.of)
      for (std::size_t d = 0; d < kind.dimensions; ++d)
        normal.add_square(o.coordinates[d].row, information / (o.relative * o.relative));
  }
  return small_solver(normal).inverse();
}

/// The parameters of weighted least squares.
inline small_vector weighted_least_squares(std::span<const observation_kind> kinds, std::size_t unknowns) {
  small_matrix normal;
  normal.size = unknowns;
  small_vector right{};
  for (const observation_kind& kind : kinds)
    for (const observation& o : kind.of) {
      const double unit = kind.scale > 0 ? kind.scale * o.relative : o.relative;
      const double weight = o.weight / (unit * unit);
      for (std::size_t d = 0; d < kind.dimensions; ++d) {
        const observed_coordinate& coordinate = o.coordinates[d];
        normal.add_square(coordinate.row, weight);
        for (std::size_t k = 0; k < unknowns; ++k) right[k] += weight * coordinate.row[k] * coordinate.right;
      }
    }
  return small_solver(normal).solve(right);
}

/// Reweights the observations by their residuals and a new scale, `min_scale` at least; returns the relative
/// change of that. The scale is divided by the sum of weights, with which it converges in fewer iterations
/// than with their number, to the same value (Kent, Tyler and Vardi 1994, A curious likelihood identity for
/// the multivariate t-distribution, Communications in Statistics 23).
inline double reweight(observation_kind& kind, const small_vector& parameters, double min_scale) {
  double squares = 0, weights = 0;
  for (observation& o : kind.of) {
    o.square = kind.squared_residual(o, parameters);
    squares += o.weight * o.square;
    weights += o.weight;
  }
  const double before = kind.scale;
  kind.scale = std::max(min_scale, std::sqrt(squares / (double(kind.dimensions) * weights)));
  for (observation& o : kind.of) o.weight = t_weight(kind, o.square);
  return before > 0 ? std::abs(kind.scale / before - 1) : 1;
}

/// Estimates `unknowns` parameters, 6 at most, that all kinds have in common, and the scale of each kind,
/// which is `min_scale` at least. Parameters that nothing determines stay 0. Cost: linear in the
/// observations.
inline t_estimate estimate_by_t(std::span<observation_kind> kinds, std::size_t unknowns, double min_scale) {
  constexpr int max_iterations = 100;
  constexpr double convergence_threshold = 1e-4;  // relative change of scales
  t_estimate result;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    poll_cancelled();
    result.parameters = weighted_least_squares(kinds, unknowns);
    double change = 0;
    for (observation_kind& kind : kinds)
      if (!kind.of.empty()) change = std::max(change, reweight(kind, result.parameters, min_scale));
    if (change < convergence_threshold) break;
  }
  result.covariance = covariance_of(kinds, unknowns, min_scale);
  result.scale = kinds.front().scale;
  for (const observation_kind& kind : kinds)
    for (const observation& o : kind.of) {
      const double unit = o.square / (kind.scale * kind.scale);
      const auto dimensions = double(kind.dimensions);
      result.log_likelihood -=
          dimensions * std::log(kind.scale) + (t_degrees + dimensions) / 2 * std::log1p(unit / t_degrees);
    }
  return result;
}

}  // namespace globalmatch::detail
