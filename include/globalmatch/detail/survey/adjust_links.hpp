// Adjustment of poses in plan to the links between them: sparse least squares, robust against wrong links.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/matrices.hpp"
#include "globalmatch/detail/core/robust.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/survey/block_system.hpp"
#include "globalmatch/detail/survey/plan_pose.hpp"
#include "globalmatch/detail/survey/survey_link.hpp"

namespace globalmatch::detail {

/// The numbers of maps among the unknowns of an adjustment; fixed ones have none.
struct unknown_poses {
  static constexpr std::uint32_t fixed = ~std::uint32_t(0);
  std::vector<std::uint32_t> of;  ///< each map
  std::size_t count = 0;

  template <class IsFixed>
  unknown_poses(std::size_t maps, const IsFixed& is_fixed) : of(maps, fixed) {
    for (std::size_t m = 0; m < maps; ++m)
      if (!is_fixed(m)) of[m] = std::uint32_t(count++);
  }
};

/// How far the poses place the stems of a link apart, along the axes of its target.
struct link_residual {
  vec2 shift;       ///< [m] of the link's center
  double turn = 0;  ///< [rad]

  link_residual(const survey_link& link, const plan_pose& source, const plan_pose& target) {
    const plan_pose target_from_source = target.inverse() * source;
    shift = target_from_source * link.center_in_source() - link.center;
    turn = wrapped(target_from_source.yaw - link.target_from_source.yaw);
  }
};

/// Adds the link's part of the normal equations; `information` is along the axes of the target.
inline void add_link(block_system<3>& system, const unknown_poses& unknowns, const survey_link& link,
                     const plan_pose& source, const plan_pose& target, const mat3& information) {
  using matrix = block_system<3>::block;
  using vector = block_system<3>::vector;
  const link_residual r(link, source, target);
  const vec2 placed = source * link.center_in_source();
  const vec2 of_source = quarter_turned(placed - source.shift),
             of_target = quarter_turned(placed - target.shift);
  const double cosine = std::cos(target.yaw), sine = std::sin(target.yaw);
  // Shifts of the survey's axes in those of the target.
  matrix to_target, by_source, by_target, weight;
  to_target << cosine, sine, 0, -sine, cosine, 0, 0, 0, 1;
  by_source << 1, 0, of_source.x, 0, 1, of_source.y, 0, 0, 1;
  by_target << -1, 0, -of_target.x, 0, -1, -of_target.y, 0, 0, -1;
  for (int c = 0; c < 3; ++c)
    for (int row = 0; row < 3; ++row) weight(row, c) = information(row, c);
  const matrix js = to_target * by_source, jt = to_target * by_target;
  const vector residual(r.shift.x, r.shift.y, r.turn);
  const std::uint32_t s = unknowns.of[link.source], t = unknowns.of[link.target];
  const auto add = [&](std::uint32_t own, const matrix& j, std::uint32_t other, const matrix& k) {
    if (own == unknown_poses::fixed) return;
    system.add(own, own, j.transpose() * weight * j);
    system.add_right(own, -(j.transpose() * weight * residual));
    if (other != unknown_poses::fixed && own > other) system.add(own, other, j.transpose() * weight * k);
  };
  add(s, js, t, jt);
  add(t, jt, s, js);
}

/// Moves the poses by a solution, and returns the largest shift [m].
inline double move_poses(std::span<plan_pose> poses, const unknown_poses& unknowns,
                         const Eigen::VectorXd& solution) {
  double largest = 0;
  for (std::size_t m = 0; m < poses.size(); ++m) {
    if (unknowns.of[m] == unknown_poses::fixed) continue;
    const auto at = Eigen::Index(unknowns.of[m]) * 3;
    const vec2 shift = {solution[at], solution[at + 1]};
    poses[m].shift += shift;
    poses[m].yaw = wrapped(poses[m].yaw + solution[at + 2]);
    largest = std::max(largest, shift.norm());
  }
  return largest;
}

/// Squared residual in standard deviations, with what the covariance of a few stems leaves out of account.
inline double squared_deviations(const survey_link& link, const link_residual& r) {
  constexpr double shift_floor = 0.03, yaw_floor = 0.002;  // [m] [rad]
  mat3 covariance = link.covariance;
  covariance +=
      mat3::diagonal_of({shift_floor * shift_floor, shift_floor * shift_floor, yaw_floor * yaw_floor});
  const vec3 residual = {r.shift.x, r.shift.y, r.turn};
  return residual.dot(covariance.inverse() * residual);
}

/// Standard deviations from which on links do not agree.
inline constexpr double max_link_deviations = 5;

/// What a link counts beside its covariance: 0 where it does not agree with the poses.
inline double weight_of(const survey_link& link, const link_residual& r) {
  return tukey_weight(squared_deviations(link, r) / (max_link_deviations * max_link_deviations));
}

/// Adjusts the poses to the links that are used, and says of all links how they agree; those that do not are
/// not used any more. What is far off counts less from the first iteration on, what is off by few standard
/// deviations from the last ones on: errors that add up along a chain of links are no contradiction
/// (graduated non-convexity: Black and Rangarajan 1996, Int. J. Computer Vision 19(1)). False where the links
/// do not determine all unknowns.
inline bool adjust_links(std::span<plan_pose> poses, const unknown_poses& unknowns,
                         std::vector<survey_link>& links) {
  constexpr int max_iterations = 30;
  constexpr double first_scale = 8, last_scale = 0.25, arm = 10;  // [m]
  constexpr double converged = 1e-5;                              // [m]
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (const survey_link& l : links)
    if (l.used && unknowns.of[l.source] != unknown_poses::fixed &&
        unknowns.of[l.target] != unknown_poses::fixed)
      pairs.emplace_back(unknowns.of[l.source], unknowns.of[l.target]);
  block_system<3> system(unknowns.count, std::move(pairs));
  double scale = first_scale;
  for (int iteration = 0; iteration < max_iterations && unknowns.count > 0; ++iteration) {
    poll_cancelled();
    const bool last = scale < last_scale;
    system.set_zero();
    for (const survey_link& l : links) {
      if (!l.used) continue;
      const link_residual r(l, poses[l.source], poses[l.target]);
      const double squared = r.shift.squared_norm() + r.turn * r.turn * arm * arm;
      double weight = std::pow(1 + squared / (scale * scale), -2);
      constexpr double least = 1e-6;  // that keeps the system positive definite
      if (last) weight = std::max(least, weight_of(l, r));
      add_link(system, unknowns, l, poses[l.source], poses[l.target], (l.covariance / weight).inverse());
    }
    if (!system.factorize()) return false;
    const double moved = move_poses(poses, unknowns, system.solve());
    if (last && moved < converged) break;
    scale /= 2;
  }
  for (survey_link& l : links) {
    if (!l.used) continue;
    const link_residual r(l, poses[l.source], poses[l.target]);
    l.used = weight_of(l, r) > 0;
  }
  return true;
}

}  // namespace globalmatch::detail
