// Which priors of a survey the others and the stems contradict. In: a survey with priors, and how it is
// adjusted to them. Out: what each prior counts.
#pragma once

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/robust.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/matching/prior.hpp"
#include "globalmatch/detail/survey/adjust_to_pairs.hpp"
#include "globalmatch/detail/survey/survey_frames.hpp"
#include "globalmatch/survey_options.hpp"

namespace globalmatch::detail {

/// A weight of a prior, and its squared residual in standard deviations: where it counts of the residual,
/// which are smaller than those of the prior since the adjustment follows it, and else of the prior and the
/// adjusted value (data snooping: Baarda 1968).
struct prior_test {
  double* weight;
  double squared;
};

/// Tests of one kind of measurement: of shifts, yaws or heights.
struct prior_tests {
  double median_of_chi_squared;
  std::vector<prior_test> counted = {}, left_out = {};

  /// By which squared residuals are larger than standard deviations say; 1 where chance makes them so.
  double scale() const {
    constexpr double deviations = 4;  // the median of n is off by about one in the square root of n
    std::vector<double> squares;
    for (const prior_test& t : counted) squares.push_back(t.squared);
    if (squares.empty()) return 1;
    const double factor = median(squares) / median_of_chi_squared;
    return factor > 1 + deviations / std::sqrt(double(squares.size())) ? factor : 1;
  }
  double largest() const {
    double most = 0;
    for (const prior_test& t : counted) most = std::max(most, t.squared);
    return most;
  }
  /// What is further off is left out at once: more than half of the largest, but where that is most of them,
  /// as if all were off alike, the worst alone.
  double next_limit() const {
    constexpr std::size_t few = 3;  // of these none says which is wrong
    std::vector<double> squares;
    for (const prior_test& t : counted) squares.push_back(t.squared);
    std::sort(squares.begin(), squares.end());
    const double half = squares.back() / 2;
    const auto near = squares.end() - std::upper_bound(squares.begin(), squares.end(), half);
    return squares.size() > few && 2 * std::size_t(near) > squares.size() ? squares[squares.size() - 2]
                                                                          : half;
  }
  /// Takes their weight from those that are further off than the limit, and returns which.
  std::vector<double*> leave_out(double limit) const {
    std::vector<double*> weights;
    for (const prior_test& t : counted)
      if (t.squared > limit) *t.weight = 0, weights.push_back(t.weight);
    return weights;
  }
  /// The weight of what was left out and fits best, of others than `tried`; null where nothing fits within
  /// the limit.
  double* best_left_out(double limit, std::span<double* const> tried) const {
    double* weight = nullptr;
    for (const prior_test& t : left_out)
      if (t.squared <= limit && std::ranges::find(tried, t.weight) == tried.end())
        weight = t.weight, limit = t.squared;
    return weight;
  }
  /// Takes as much of the weight of those that count as their residuals ask for.
  void scale_weights() const {
    const double factor = scale();
    for (const prior_test& t : counted) *t.weight /= factor;
  }
};

/// The tests of all priors of a component by a survey that was adjusted to those that count.
struct tests_of_priors {
  prior_tests shifts{1.386}, yaws{0.4549}, heights{0.4549};  // of two degrees of freedom, and of one

  tests_of_priors(survey& s, int component, const survey& adjusted, const adjusted_parts& parts) {
    for (survey::adjusted_prior& p : s.priors) {
      const survey::scan& scan = adjusted.scans[p.given.scan];
      if (scan.component != component || !scan.uncertainty) continue;
      const Eigen::Isometry3d& pose = scan.survey_from_scan;
      const Eigen::Vector3d off = pose.translation() - p.given.position;
      const Eigen::Matrix3d there = scan.uncertainty->at(pose.translation());
      if (parts.shifts) {
        add_shift(p, off.head<2>(), there.topLeftCorner<2, 2>());
        add(yaws, p.yaw_weight, wrapped(std::atan2(pose(1, 0), pose(0, 0)) - p.given.yaw),
            variance_of_yaw(p.given.sigma_yaw), scan.uncertainty->covariance(3, 3));
      }
      if (parts.heights && scan.is_height_known)
        add(heights, p.height_weight, off.z(), variance_of_shift(p.given.sigma_height), there(2, 2));
    }
  }

 private:
  /// Squared residual in standard deviations; nothing where the adjustment does not follow a prior that
  /// counts, since nothing ties its scan.
  static std::optional<double> squared(double residual, double weight, double prior_variance,
                                       double variance) {
    constexpr double least = 1e-3, rounding = 1.01;  // of the variance of the prior
    const bool counts = weight > 0;
    if (counts) prior_variance /= weight;
    if (counts && variance > rounding * prior_variance) return std::nullopt;
    const double of_residual =
        counts ? std::max(least * prior_variance, prior_variance - variance) : prior_variance + variance;
    return residual * residual / of_residual;
  }
  static void add(prior_tests& tests, double& weight, double residual, double prior_variance,
                  double variance) {
    const auto square = squared(residual, weight, prior_variance, variance);
    if (square && std::isfinite(*square))
      (weight > 0 ? tests.counted : tests.left_out).push_back({&weight, *square});
  }
  void add_shift(survey::adjusted_prior& p, const Eigen::Vector2d& residual,
                 const Eigen::Matrix2d& covariance) {
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes;
    axes.computeDirect(covariance);
    const Eigen::Vector2d along = axes.eigenvectors().transpose() * residual;
    const double prior_variance = variance_of_shift(p.given.sigma_plan);
    const auto first = squared(along[0], p.weight, prior_variance, axes.eigenvalues()[0]),
               second = squared(along[1], p.weight, prior_variance, axes.eigenvalues()[1]);
    if (first && second && std::isfinite(*first + *second))
      (p.weight > 0 ? shifts.counted : shifts.left_out).push_back({&p.weight, *first + *second});
  }
};

/// Decides which priors of one kind count. `test()` adjusts to those that do and tests all. Those that are
/// furthest off are left out first, with what is half as far off and may be right; what fits then counts
/// again.
template <class Test>
void decide_priors(prior_tests tests_of_priors::*kind, const Test& test) {
  constexpr double limit = tukey_constant * tukey_constant;
  prior_tests tests = test().*kind;
  while (tests.largest() > limit) {
    const std::vector<double*> weights = tests.leave_out(std::max(limit, tests.next_limit()));
    if (weights.empty()) break;
    prior_tests left = test().*kind;
    if (!(tests.largest() / left.scale() > limit)) {  // it is the standard deviations that are too small
      for (double* weight : weights) *weight = 1;
      break;
    }
    tests = std::move(left);
  }
  std::vector<double*> tried;
  while (double* weight = tests.best_left_out(limit * tests.scale(), tried)) {
    tried.push_back(weight);
    *weight = 1;
    prior_tests with = test().*kind;
    if (with.largest() > limit * tests.scale())
      *weight = 0;
    else
      tests = std::move(with);
  }
}

/// Takes their weight from priors of a component that the others and the stems contradict; those that are
/// left count as much as they agree on the whole. `adjust(survey&)` adjusts to the priors that count and
/// returns what it adjusted; uncertainties are then those in the frame of the priors. Returns the standard
/// deviation [rad] of the yaw of that frame, infinite where it is not known.
template <class Adjust>
double leave_out_contradicted(survey& s, int component, const Adjust& adjust) {
  constexpr double unknown_yaw = 1;  // [rad] and more
  constexpr int max_scalings = 10;
  double yaw_variance = 0;
  const auto test = [&] {
    survey trial = s;
    const adjusted_parts parts = adjust(trial);
    yaw_variance = std::numeric_limits<double>::infinity();
    for (const survey::adjusted_prior& p : s.priors) {
      const survey::scan& scan = trial.scans[p.given.scan];
      if (parts.shifts && scan.component == component && scan.uncertainty &&
          (p.weight > 0 || p.yaw_weight > 0))
        yaw_variance = std::min(yaw_variance, scan.uncertainty->covariance(3, 3));
    }
    return tests_of_priors(s, component, trial, parts);
  };
  for (const auto kind : {&tests_of_priors::shifts, &tests_of_priors::yaws, &tests_of_priors::heights})
    decide_priors(kind, test);
  for (int scaling = 0; scaling < max_scalings; ++scaling) {
    const tests_of_priors tests = test();
    if (std::max({tests.shifts.scale(), tests.yaws.scale(), tests.heights.scale()}) == 1) break;
    for (const prior_tests* of_kind : {&tests.shifts, &tests.yaws, &tests.heights}) of_kind->scale_weights();
  }
  return yaw_variance < unknown_yaw * unknown_yaw ? std::sqrt(yaw_variance)
                                                  : std::numeric_limits<double>::infinity();
}

}  // namespace globalmatch::detail
