// One pair of a survey refined by its samples: the height by the ground that both scans see, shift and turn
// by ICP.
#pragma once

#include <Eigen/Geometry>

#include <cmath>
#include <cstddef>
#include <string>

#include "globalmatch/detail/core/compiled.hpp"
#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/matching/uncertainty.hpp"
#include "globalmatch/detail/survey/pose_uncertainty.hpp"
#include "globalmatch/detail/survey/survey_link.hpp"
#include "globalmatch/detail/verbs/refine_by_samples.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/icp_options.hpp"
#include "globalmatch/refinement_options.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

/// Moves the pair to the height at which the ground that both maps see coincides, if they see enough.
inline void refine_height(const stem_map& source, const stem_map& target, refined_pair& pair) {
  pair.reason = why_without_ground(source, target);
  if (!pair.reason.empty()) return;
  const auto found = offset_of_ground(source, target, pair.target_from_source);
  if (!found) {
    pair.reason = "too little ground is seen by both scans";
    return;
  }
  const Eigen::Vector3d shift = found->offset * pair.uncertainty.up;
  pair.target_from_source.pretranslate(shift);
  pair.uncertainty.center += shift;
  set_height_variance(pair.uncertainty, found->sigma * found->sigma);
  pair.is_height_refined = true;
}

/// The part of an uncertainty of ICP that shift and the turn about the vertical have, in the target's frame.
inline transform_uncertainty uncertainty_of(const icp_uncertainty& icp, const stem_map& target) {
  const std::size_t turn = icp.covariance.size - 1;
  local_uncertainty local;
  local.center = icp.center;
  local.covariance.size = 4;
  for (std::size_t c = 0; c < 4; ++c)
    for (std::size_t r = 0; r < 4; ++r)
      local.covariance(r, c) = icp.covariance(r < 3 ? r : turn, c < 3 ? c : turn);
  add_shared_variance(local.covariance);
  local.covariance(3, 3) += shared_yaw_sigma * shared_yaw_sigma;
  return in_caller_frame(local, levelled_frame(target));
}

/// Gives what ICP found the height that the pair has, if that is not the ground's or ICP contradicts it.
inline void keep_height_of(const refined_pair& pair, const Eigen::Vector3d& up, icp_result& icp,
                           transform_uncertainty& uncertainty) {
  constexpr double deviations = 3,
                   min_sigma = 5e-4;  // [m] of the ground, which both scans see at other places
  const Eigen::Isometry3d moved = icp.target_from_source * pair.target_from_source.inverse();
  const double change = (uncertainty.center - moved.inverse() * uncertainty.center).dot(up);
  double sigma = height_sigma(pair.uncertainty);
  if (pair.is_height_refined && std::abs(change) <= deviations * sigma) {
    sigma = std::hypot(min_sigma, height_sigma(uncertainty));
  } else {
    icp.target_from_source.pretranslate(-change * up);
    uncertainty.center -= change * up;
  }
  set_height_variance(uncertainty, sigma * sigma);
}

/// Whether the start turns the vertical of one map against that of the other: the survey found one to lean.
inline bool leans(const stem_map& source, const stem_map& target, const refined_pair& pair) {
  constexpr double min_lean = 1e-3;  // [rad]
  return (pair.target_from_source.linear() * source.up).cross(target.up).norm() > min_lean;
}

/// Follows ICP where it converges, and moves no further in plan than its uncertainty and that of the start
/// allow.
inline void refine_shift_and_turn(const stem_map& source, const stem_map& target, const icp_options& options,
                                  const execution& exec, refined_pair& pair) {
  icp_uncertainty found;
  icp_result icp =
      refine_by_samples(source, target, pair.target_from_source,
                        leans(source, target, pair) ? degrees_of_freedom::six : degrees_of_freedom::four,
                        pair.is_height_refined, options, exec, &found);
  if (!icp.converged || !found.is_determined) {
    pair.reason = "too few samples of both scans are of the same surfaces for ICP to converge";
    return;
  }
  transform_uncertainty uncertainty = uncertainty_of(found, target);
  keep_height_of(pair, pair.uncertainty.up, icp, uncertainty);
  if (!moves_within(sum_of(pair.start.uncertainty, uncertainty), pair.start.target_from_source,
                    icp.target_from_source)) {
    pair.reason = "ICP moves further than the stems allow";
    return;
  }
  pair.target_from_source = icp.target_from_source;
  pair.uncertainty = uncertainty;
  pair.is_refined = true;
  if (found.covariance.size == 6)
    pair.tilt_sigma =
        std::hypot(shared_yaw_sigma, std::sqrt((found.covariance(3, 3) + found.covariance(4, 4)) / 2));
  pair.samples = icp.pairs;
  pair.rms = icp.rms;
}

GLOBALMATCH_INLINE refined_pair refine_stem_maps(const stem_map& source, const stem_map& target,
                                                 const pair_to_refine& pair,
                                                 const refinement_options& options, const execution& exec,
                                                 build_mode) {
  require_four_rows(pair.uncertainty);
  const parallel_scope scope(exec, "refinement");
  refined_pair result;
  result.start = pair;
  result.target_from_source = pair.target_from_source;
  result.uncertainty = pair.uncertainty;
  refine_height(source, target, result);
  if (options.icp.metric != icp_metric::none)
    refine_shift_and_turn(source, target, options.icp, exec, result);
  return result;
}

}  // namespace globalmatch::detail
