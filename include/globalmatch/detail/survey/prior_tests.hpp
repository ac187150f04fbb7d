// Which priors of a survey the others and the stems contradict. In: a survey with priors, and how it is
// adjusted to them. Out: what each prior counts.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/robust.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/matching/prior.hpp"
#include "globalmatch/detail/survey/adjust_to_pairs.hpp"
#include "globalmatch/detail/survey/pose_uncertainty.hpp"
#include "globalmatch/detail/survey/survey_frames.hpp"
#include "globalmatch/survey_options.hpp"

namespace globalmatch::detail {

/// A weight of a prior, and its squared residual after the adjustment in standard deviations of that: smaller
/// than those of the prior, since the adjustment follows it (data snooping: Baarda 1968).
struct prior_test {
  double* weight;
  double squared;
};

/// Tests of one kind of measurement, of shift, of yaw or in height.
struct prior_tests {
  double median_of_chi_squared;
  std::vector<prior_test> all = {};

  /// `residual` and standard deviation of the prior, and the `variance` of the adjusted value.
  void add(double& weight, double residual, double prior_variance, double variance) {
    constexpr double least = 1e-3;  // of the variance of the prior: where nothing else measures the value
    if (weight > 0)
      all.push_back(
          {&weight, residual * residual / std::max(least * prior_variance, prior_variance - variance)});
  }
  /// By which squared residuals are larger than standard deviations say, if they are.
  double scale() const {
    std::vector<double> squares;
    for (const prior_test& t : all) squares.push_back(t.squared);
    return squares.empty() ? 1 : std::max(1.0, median(squares) / median_of_chi_squared);
  }
  double largest() const {
    double most = 0;
    for (const prior_test& t : all) most = std::max(most, t.squared);
    return most;
  }
  /// Takes their weight from those that are further off than the limit.
  void leave_out(double limit) const {
    for (const prior_test& t : all)
      if (t.squared > limit) *t.weight = 0;
  }
  /// Gives those that are left the weight that their residuals have.
  void scale_weights() const {
    const double weight = 1 / scale();
    for (const prior_test& t : all) *t.weight = weight;
  }
};

/// The tests of all priors of `s` by a survey that was adjusted to them.
struct tests_of_priors {
  prior_tests shift{1.386}, yaw{0.4549}, height{0.4549};  // of two degrees of freedom, and of one

  tests_of_priors(survey& s, const survey& adjusted, const adjusted_parts& parts) {
    for (survey::adjusted_prior& p : s.priors) {
      const survey::scan& scan = adjusted.scans[p.given.scan];
      if (!scan.uncertainty) continue;
      const Eigen::Isometry3d& pose = scan.survey_from_scan;
      const Eigen::Vector3d off = pose.translation() - p.given.position;
      const place_variance at(*scan.uncertainty, pose.translation());
      if (parts.shifts) {
        shift.add(p.weight, off.head<2>().norm(), variance_of_shift(p.given.sigma_plan), at.horizontal);
        yaw.add(p.yaw_weight, wrapped(std::atan2(pose(1, 0), pose(0, 0)) - p.given.yaw),
                variance_of_yaw(p.given.sigma_yaw), scan.uncertainty->covariance(3, 3));
      }
      if (parts.heights)
        height.add(p.height_weight, off.z(), variance_of_shift(p.given.sigma_height), at.height);
    }
  }

  double largest() const { return std::max({shift.largest(), yaw.largest(), height.largest()}); }
  void leave_out(double limit) const {
    for (const prior_tests* t : {&shift, &yaw, &height}) t->leave_out(limit);
  }
  void scale_weights() const {
    for (const prior_tests* t : {&shift, &yaw, &height}) t->scale_weights();
  }
  /// The largest, scaled as residuals are when what is furthest off is left out: one that is wrong makes
  /// others seem so.
  double max_scaled_by(const tests_of_priors& left) const {
    return std::max({shift.largest() / left.shift.scale(), yaw.largest() / left.yaw.scale(),
                     height.largest() / left.height.scale()});
  }
};

/// Takes their weight from priors that the others and the stems contradict, the worst first; those that are
/// left count as much as they agree on the whole. `adjust(survey&)` adjusts to the priors that count and
/// returns what it adjusted; uncertainties are then those in the frame of the priors.
template <class Adjust>
void leave_out_contradicted(survey& s, const Adjust& adjust) {
  constexpr double limit = tukey_constant * tukey_constant;
  const auto test = [&] {
    survey trial = s;
    const adjusted_parts parts = adjust(trial);
    return tests_of_priors(s, trial, parts);
  };
  tests_of_priors tests = test();
  while (tests.largest() > limit) {
    const std::vector<survey::adjusted_prior> before = s.priors;
    tests.leave_out(std::max(limit, tests.largest() / 2));
    tests_of_priors left = test();
    if (!(tests.max_scaled_by(left) > limit)) {  // it is the standard deviations that are too small
      std::copy(before.begin(), before.end(), s.priors.begin());
      break;
    }
    tests = std::move(left);
  }
  tests.scale_weights();
}

}  // namespace globalmatch::detail
