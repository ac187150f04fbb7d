// Poses of a survey adjusted to pairs of scans that were refined by their samples. In: levelled poses at the
// start, pairs, trees. Out: how much each pose changes, and covariances.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/matrices.hpp"
#include "globalmatch/detail/core/robust.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/detail/survey/adjust_links.hpp"
#include "globalmatch/detail/survey/block_system.hpp"
#include "globalmatch/detail/survey/plan_pose.hpp"
#include "globalmatch/detail/survey/survey_link.hpp"
#include "globalmatch/detail/survey/survey_trees.hpp"

namespace globalmatch::detail {

/// Weights of measurements by their squared residuals [standard deviations^2]: Tukey's, at first for what is
/// far off as well, so that it is the measurements that disagree with most others that lose their weight, and
/// not those that disagree with the start (graduated non-convexity: Black and Rangarajan 1996).
class graduated_weights {
 public:
  /// `median_of_chi_squared`: of as many degrees of freedom as a residual has. Otherwise than `robust` all
  /// weights are 1.
  graduated_weights(double median_of_chi_squared, bool robust)
      : median_(median_of_chi_squared), robust_(robust) {}

  /// To be called once an iteration.
  void update(std::span<const double> squares) {
    if (squares.empty()) return;
    if (!robust_) return weights_.assign(squares.size(), 1);
    std::vector<double> sample(squares.begin(), squares.end());
    sigma_ = std::max(1.0, std::sqrt(median(sample) / median_));
    const double largest = std::sqrt(*std::max_element(squares.begin(), squares.end()));
    scale_ = first_ ? largest : scale_ / 2;
    first_ = false;
    const double limit = tukey_constant * std::max(sigma_, scale_);
    weights_.clear();
    for (const double s : squares)
      weights_.push_back(std::max(min_weight, tukey_weight(s / (limit * limit))));
  }

  bool is_last() const { return scale_ <= sigma_; }
  /// By which the standard deviations of measurements must be multiplied.
  double sigma() const { return sigma_; }
  /// What the information of a measurement is to be multiplied by.
  double factor(std::size_t i) const { return weights_[i] / (sigma_ * sigma_); }

 private:
  static constexpr double min_weight = 1e-6;  // that keeps the system positive definite

  double median_, sigma_ = 1, scale_ = 0;
  bool robust_, first_ = true;
  std::vector<double> weights_;
};

/// Trees, and the maps that saw them; targets as well.
struct seen_trees {
  tree_observations observations;
  std::vector<vec2> places;  ///< [m] of each tree, along the levelled axes of the survey
  /// Of observations, as multiples of that of a stem; empty: all are stems.
  std::vector<double> weights = {};

  double weight(std::size_t observation) const { return weights.empty() ? 1 : weights[observation]; }
};

/// The adjustment in plan. What the trees say is a quadratic form about the start, which is their own
/// adjustment: that of their places, eliminated. Refers to all that it is given.
class refined_plan_adjustment {
 public:
  /// `start`: pose of each map, whose own frame has the axes of the survey, so that yaws are 0. `stem_sigma`
  /// [m] of a stem of a map.
  refined_plan_adjustment(std::span<const plan_pose> start, const seen_trees& trees, double stem_sigma,
                          std::span<const survey_link> pairs, const unknown_poses& unknowns)
      : start_(start),
        trees_(trees),
        stem_sigma_(stem_sigma),
        pairs_(pairs),
        unknowns_(unknowns),
        system_(unknowns.count, connected()) {}

  /// False where trees and pairs do not determine all poses. `robust`: pairs that disagree lose their weight.
  bool adjust(std::span<plan_pose> poses, bool robust = true) {
    constexpr int max_iterations = 50;
    constexpr double converged = 1e-6, median_of_chi_squared = 2.366;  // [m]; of three degrees of freedom
    graduated_weights weights(median_of_chi_squared, robust);
    for (int iteration = 0; iteration < max_iterations && unknowns_.count > 0; ++iteration) {
      poll_cancelled();
      weights.update(squared_residuals(poses));
      system_.set_zero();
      add_trees(poses);
      for (std::size_t i = 0; i < pairs_.size(); ++i) {
        const survey_link& p = pairs_[i];
        add_link(system_, unknowns_, p, poses[p.source], poses[p.target],
                 (p.covariance / weights.factor(i)).inverse());
      }
      if (!system_.factorize()) return false;
      if (move_poses(poses, unknowns_, system_.solve()) < converged && weights.is_last()) break;
    }
    return true;
  }

  /// Covariances of shift and yaw of the unknown poses, in their order. After `adjust`.
  std::vector<block_system<3>::block> covariances() const {
    return unknowns_.count > 0 ? system_.inverse_blocks() : std::vector<block_system<3>::block>();
  }

 private:
  std::vector<std::pair<std::uint32_t, std::uint32_t>> connected() const {
    auto pairs = pairs_of_maps(trees_.observations, unknowns_);
    for (const survey_link& p : pairs_)
      if (const std::uint32_t s = unknowns_.of[p.source], t = unknowns_.of[p.target];
          s != unknown_poses::fixed && t != unknown_poses::fixed)
        pairs.emplace_back(s, t);
    return pairs;
  }

  std::vector<double> squared_residuals(std::span<const plan_pose> poses) const {
    std::vector<double> squares;
    for (const survey_link& p : pairs_) {
      const link_residual r(p, poses[p.source], poses[p.target]);
      const vec3 residual = {r.shift.x, r.shift.y, r.turn};
      squares.push_back(residual.dot(p.covariance.inverse() * residual));
    }
    return squares;
  }

  void add_trees(std::span<const plan_pose> poses) {
    using jacobian = Eigen::Matrix<double, 2, 3>;
    const double information = stem_sigma_ > 0 ? 1 / (stem_sigma_ * stem_sigma_) : 0;
    std::vector<jacobian> of_pose;
    std::vector<Eigen::Vector2d> moved;
    for (std::size_t t = 0; t < trees_.observations.size(); ++t) {
      const auto seen = trees_.observations.of(t);
      const auto weight = [&](std::size_t i) { return trees_.weight(trees_.observations.first[t] + i); };
      of_pose.clear();
      moved.clear();
      Eigen::Vector2d mean = Eigen::Vector2d::Zero();
      double total = 0;
      for (std::size_t i = 0; i < seen.size(); ++i) total += weight(i);
      if (!(total > 0)) continue;
      for (const stem_of_map& o : seen) {
        const plan_pose &now = poses[o.map], &before = start_[o.map];
        const vec2 lever = quarter_turned(trees_.places[t] - before.shift);
        jacobian j;
        j << 1, 0, lever.x, 0, 1, lever.y;
        of_pose.push_back(j);
        moved.push_back(j * Eigen::Vector3d(now.shift.x - before.shift.x, now.shift.y - before.shift.y,
                                            now.yaw - before.yaw));
        mean += weight(moved.size() - 1) * moved.back() / total;
      }
      for (std::size_t i = 0; i < seen.size(); ++i) {
        const std::uint32_t own = unknowns_.of[seen[i].map];
        if (own == unknown_poses::fixed) continue;
        system_.add_right(own, -information * weight(i) * (of_pose[i].transpose() * (moved[i] - mean)));
        for (std::size_t k = 0; k < seen.size(); ++k) {
          const std::uint32_t other = unknowns_.of[seen[k].map];
          if (other == unknown_poses::fixed || other > own) continue;
          const double share = (k == i ? weight(i) : 0) - weight(i) * weight(k) / total;
          system_.add(own, other, information * share * (of_pose[i].transpose() * of_pose[k]));
        }
      }
    }
  }

  std::span<const plan_pose> start_;
  const seen_trees& trees_;
  double stem_sigma_;
  std::span<const survey_link> pairs_;
  const unknown_poses& unknowns_;
  block_system<3> system_;
};

/// By how much a value of the source, a height [m] or a tilt [rad], is to be changed against that of the
/// target.
struct measured_difference {
  std::uint32_t source = 0, target = 0;
  double change = 0, variance = 0;
};

/// Values of maps adjusted to differences between them, which connect every unknown one with a fixed one.
/// Returns the variances of the unknown ones, in their order; nothing where they are not determined.
inline std::vector<double> adjust_differences(std::span<const measured_difference> differences,
                                              const unknown_poses& unknowns, std::span<double> values,
                                              bool robust = true) {
  constexpr int max_iterations = 50;
  constexpr double converged = 1e-6, median_of_chi_squared = 0.4549;  // [m, rad]; of one degree of freedom
  using scalar = block_system<1>::block;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> connected;
  for (const measured_difference& d : differences)
    if (const std::uint32_t s = unknowns.of[d.source], t = unknowns.of[d.target];
        s != unknown_poses::fixed && t != unknown_poses::fixed)
      connected.emplace_back(s, t);
  block_system<1> system(unknowns.count, std::move(connected));
  graduated_weights weights(median_of_chi_squared, robust);
  const auto residual = [&](const measured_difference& d) {
    return values[d.source] - values[d.target] - d.change;
  };
  for (int iteration = 0; iteration < max_iterations && unknowns.count > 0; ++iteration) {
    std::vector<double> squares;
    for (const measured_difference& d : differences)
      squares.push_back(residual(d) * residual(d) / d.variance);
    weights.update(squares);
    system.set_zero();
    for (std::size_t i = 0; i < differences.size(); ++i) {
      const measured_difference& d = differences[i];
      const std::uint32_t s = unknowns.of[d.source], t = unknowns.of[d.target];
      const double information = weights.factor(i) / d.variance;
      const auto add = [&](std::uint32_t own, double sign) {
        if (own == unknown_poses::fixed) return;
        system.add(own, own, scalar::Constant(information));
        system.add_right(own, scalar::Constant(-sign * information * residual(d)));
      };
      add(s, 1), add(t, -1);
      if (s != unknown_poses::fixed && t != unknown_poses::fixed)
        system.add(s, t, scalar::Constant(-information));
    }
    if (!system.factorize()) return {};
    const Eigen::VectorXd change = system.solve();
    for (std::size_t m = 0; m < values.size(); ++m)
      if (unknowns.of[m] != unknown_poses::fixed) values[m] += change[Eigen::Index(unknowns.of[m])];
    if (change.cwiseAbs().maxCoeff() < converged && weights.is_last()) break;
  }
  std::vector<double> variances;
  if (unknowns.count > 0)
    for (const scalar& variance : system.inverse_blocks()) variances.push_back(variance(0, 0));
  return variances;
}

}  // namespace globalmatch::detail
