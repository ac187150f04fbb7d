// Poses that are known beforehand compared with those of a survey. In: a solved survey in which each
// component refers to one known pose. Out: known poses that agree, which may be held.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "globalmatch/detail/core/local_frame.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "globalmatch/detail/matching/prior.hpp"
#include "globalmatch/detail/survey/adjust_to_trees.hpp"
#include "globalmatch/detail/survey/known_poses.hpp"
#include "globalmatch/detail/survey/plan_pose.hpp"
#include "globalmatch/detail/survey/survey_heights.hpp"

namespace globalmatch::detail {

/// How far a known pose is from where the survey has the map beside another known one.
struct known_pose_error {
  double distance = 0;  ///< [m] at the centroid of its stems; in plan where a height is not known
  bool agrees = true;   ///< within what the survey knows
};

class known_pose_comparison {
 public:
  known_pose_comparison(std::span<const prepared_stems> maps, const adjusted_survey& adjusted,
                        const survey_heights& heights, const known_poses& known)
      : maps_(maps), adjusted_(adjusted), heights_(heights), known_(known) {}

  known_pose_error operator()(std::size_t reference, std::size_t map) const {
    constexpr double deviations = 4, max_lean = 0.01;          // [rad]
    constexpr double shift_floor = 0.005, yaw_floor = 0.0005;  // [m] [rad] of what covariances leave out
    if (map == reference) return {};
    const vec3 centroid = centroid_of(map);
    const rigid expected = known_.transform_beside(reference, map),
                found = placed(reference).inverse() * placed(map);
    const vec3 off = expected * centroid - found * centroid;
    const bool has_height = heights_.known[reference] && heights_.known[map];
    mat3 covariance = adjusted_.covariance[reference];
    covariance += adjusted_.covariance[map];
    const double arm = centroid.xy().norm();
    const double variance =
        shift_floor * shift_floor + covariance(0, 0) + covariance(1, 1) + covariance(2, 2) * arm * arm;
    const double yaw_variance = yaw_floor * yaw_floor + covariance(2, 2);
    const double height_variance = shift_floor * shift_floor +
                                   heights_.sigma[reference] * heights_.sigma[reference] +
                                   heights_.sigma[map] * heights_.sigma[map];
    const double turn = wrapped(plan_of(expected).yaw - plan_of(found).yaw);
    known_pose_error error;
    error.distance = has_height ? off.norm() : off.xy().norm();
    error.agrees = off.xy().norm() < deviations * std::sqrt(variance) &&
                   std::abs(turn) < deviations * std::sqrt(yaw_variance) &&
                   (!has_height || std::abs(off.z) < deviations * std::sqrt(height_variance)) &&
                   angle_between(vec3{0, 0, 1}, expected.rotation * vec3{0, 0, 1}) < max_lean;
    return error;
  }

 private:
  vec3 centroid_of(std::size_t map) const {
    const auto& at = maps_[map].stems.at;
    vec3 centroid;
    for (const vec3& p : at) centroid += p / double(at.size());
    return centroid;
  }
  rigid placed(std::size_t map) const { return in_space(adjusted_.poses[map], heights_.of_map[map]); }

  std::span<const prepared_stems> maps_;
  const adjusted_survey& adjusted_;
  const survey_heights& heights_;
  const known_poses& known_;
};

/// Holds in each component the largest set of known poses that agree with one of them, and refers to that
/// one. `members`: the maps of each component, the reference first. Returns how far the others are off [m],
/// and whether anything changed.
inline bool hold_agreeing(const known_pose_comparison& compare,
                          const std::vector<std::vector<std::uint32_t>>& members, known_poses& known,
                          std::vector<double>& distances) {
  bool changes = false;
  for (const auto& of_component : members) {
    std::vector<std::uint32_t> candidates, best;
    for (const std::uint32_t m : of_component)
      if (known.is_known(m)) candidates.push_back(m);
    if (candidates.size() < 2) continue;
    std::uint32_t chosen = candidates.front();
    for (const std::uint32_t r : candidates) {
      std::vector<std::uint32_t> agreeing;
      for (const std::uint32_t m : candidates)
        if (compare(r, m).agrees) agreeing.push_back(m);
      if (agreeing.size() > best.size()) best = std::move(agreeing), chosen = r;
    }
    for (const std::uint32_t m : candidates)
      if (const known_pose_error error = compare(chosen, m); !error.agrees) distances[m] = error.distance;
    known.refer_to(chosen);
    for (const std::uint32_t m : best) known.hold(m);
    changes = changes || best.size() > 1 || chosen != of_component.front();
  }
  return changes;
}

}  // namespace globalmatch::detail
