// Surveys along their levelled axes, and what refined pairs say there. In: a survey, pairs of its scans. Out:
// links in plan, differences of heights, turns.
#pragma once

#include <Eigen/Geometry>

#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "globalmatch/detail/core/disjoint_sets.hpp"
#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/local_frame.hpp"
#include "globalmatch/detail/core/matrices.hpp"
#include "globalmatch/detail/survey/plan_pose.hpp"
#include "globalmatch/detail/survey/pose_uncertainty.hpp"
#include "globalmatch/detail/survey/refined_adjustment.hpp"
#include "globalmatch/detail/survey/survey_link.hpp"
#include "globalmatch/refinement_options.hpp"
#include "globalmatch/survey_options.hpp"

namespace globalmatch::detail {

/// The placed scans of a survey along its levelled axes, as they are before the adjustment, and how it
/// changes them.
struct levelled_survey {
  std::vector<Eigen::Isometry3d> level_from_survey;  ///< a rotation
  std::vector<vec3> centers;                         ///< [m] levelled, about which uncertainties are
  std::vector<std::uint8_t> plan_held, height_held;  ///< what others refer to
  std::vector<std::uint8_t> frame_held, released;    ///< in place of these, see `hold_frames`
  std::vector<plan_pose> start, poses;               ///< of frames about the centers
  std::vector<double> raise;                         ///< [m]
  std::vector<vec3> tilts;                ///< [rad] by which each was turned about its center before
  std::vector<std::uint8_t> is_adjusted;  ///< also where it did not move: its uncertainty is another one

  explicit levelled_survey(const survey& s) {
    constexpr double min_variance = 1e-20;  // [m^2] rounding leaves of none
    for (const survey::scan& scan : s.scans) {
      const transform_uncertainty u = scan.uncertainty.value_or(transform_uncertainty());
      rigid level;
      level.rotation = levelling_rotation(from_eigen(u.up));
      level_from_survey.push_back(to_eigen(level));
      centers.push_back(level * from_eigen(u.center));
      start.push_back({centers.back().xy(), 0});
      plan_held.push_back(scan.uncertainty &&
                          place_variance(u, u.center).horizontal + u.covariance(3, 3) < min_variance);
      height_held.push_back(scan.uncertainty && scan.is_height_known &&
                            place_variance(u, u.center).height < min_variance);
    }
    poses = start;
    raise.assign(s.scans.size(), 0);
    tilts.resize(s.scans.size());
    is_adjusted.resize(s.scans.size());
    frame_held.resize(s.scans.size());
    released.resize(s.scans.size());
  }

  /// Leaves components without pairs as they are: scans that nothing held is connected with are not adjusted.
  void hold_only_in(const survey& s, std::span<const refined_pair> pairs) {
    std::vector<std::uint8_t> has_pair(s.components);
    for (const refined_pair& p : pairs) has_pair[std::size_t(s.scans[p.start.source].component)] = true;
    for (std::size_t m = 0; m < s.scans.size(); ++m)
      if (s.scans[m].component < 0 || !has_pair[std::size_t(s.scans[m].component)])
        plan_held[m] = height_held[m] = false;
  }

  /// Holds the targets of the pairs, which are frames, in place of what is held in their components; but not
  /// those that are held anyway.
  void hold_frames(const survey& s, std::span<const refined_pair> pairs) {
    std::vector<std::uint8_t> is_released(s.components);
    for (const refined_pair& p : pairs) {
      const std::size_t frame = p.start.target;
      if (plan_held[frame]) continue;
      frame_held[frame] = true;
      is_released[std::size_t(s.scans[frame].component)] = true;
    }
    for (std::size_t m = 0; m < s.scans.size(); ++m)
      released[m] = s.scans[m].component >= 0 && is_released[std::size_t(s.scans[m].component)] != 0;
  }
  /// Whether a scan is adjusted; `adjusted`: by what it is connected with, `held`: if nothing is released.
  bool is_unknown(std::size_t scan, bool adjusted, bool held) const {
    return (adjusted && !frame_held[scan]) || (held && released[scan]);
  }

  /// From where the adjustment finds a scan to where it places it, in the frame of the survey.
  Eigen::Isometry3d change_of(std::size_t scan) const {
    const rigid back{mat3::identity(), -centers[scan]},
        forth = in_space(poses[scan], centers[scan].z + raise[scan]);
    return level_from_survey[scan].inverse() * to_eigen(forth * back) * level_from_survey[scan];
  }
};

/// What a refined pair says, along the levelled axes of the survey.
struct levelled_pair {
  survey_link link;
  measured_difference height;
  vec3 turn;                   ///< [rad] of the source against the target
  bool has_shift, has_height;  ///< whether it says anything of these

  levelled_pair(const refined_pair& pair, const survey& s, const levelled_survey& levelled)
      : has_shift(pair.is_refined), has_height(pair.is_height_refined || pair.start.is_height_known) {
    const std::size_t source = pair.start.source, target = pair.start.target;
    const Eigen::Isometry3d level = levelled.level_from_survey[target],
                            level_from_target = level * s.scans[target].survey_from_scan,
                            level_from_source = level * s.scans[source].survey_from_scan;
    const transform_uncertainty u = in_frame(pair.uncertainty, level_from_target);
    const rigid moved = from_eigen(level_from_target * pair.target_from_source * level_from_source.inverse());
    const vec3 center = from_eigen(u.center), before = moved.inverse() * center;
    link.source = height.source = std::uint32_t(source);
    link.target = height.target = std::uint32_t(target);
    link.center = (center - levelled.centers[target]).xy();
    link.target_from_source.yaw = plan_of(moved).yaw;
    link.target_from_source.shift =
        link.center - link.target_from_source.turned((before - levelled.centers[source]).xy());
    const int of[3] = {0, 1, 3};
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < 3; ++r) link.covariance(r, c) = u.covariance(of[r], of[c]);
    const mat3& r = moved.rotation;
    turn = 0.5 * vec3{r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1)};
    height.change = center.z - before.z;
    height.variance = u.covariance(2, 2);
  }
};

inline void require_valid_pairs(const survey& s, std::span<const refined_pair> pairs) {
  for (const refined_pair& p : pairs) {
    for (const std::size_t scan : {p.start.source, p.start.target})
      if (scan >= s.scans.size() || !s.scans[scan].uncertainty || p.start.source == p.start.target)
        throw std::invalid_argument("pairs: scan " + std::to_string(scan) + " was not placed");
    require_four_rows(p.uncertainty);
  }
}

/// Maps that measurements connect with one that is held, and those alone are adjusted.
class adjusted_maps {
 public:
  adjusted_maps(const std::vector<std::uint8_t>& held, disjoint_sets connected) {
    std::vector<std::uint8_t> has_held(held.size());
    for (std::uint32_t m = 0; m < held.size(); ++m)
      if (held[m]) has_held[connected.find(m)] = true;
    for (std::uint32_t m = 0; m < held.size(); ++m)
      is_adjusted_.push_back(!held[m] && has_held[connected.find(m)]);
  }
  bool operator()(std::size_t map) const { return is_adjusted_[map] != 0; }

 private:
  std::vector<std::uint8_t> is_adjusted_;
};

}  // namespace globalmatch::detail
