// All poses of a survey adjusted to its refined pairs, and what depends on them.
#pragma once

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/compiled.hpp"
#include "globalmatch/detail/core/disjoint_sets.hpp"
#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/keyed_sort.hpp"
#include "globalmatch/detail/core/local_frame.hpp"
#include "globalmatch/detail/core/matrices.hpp"
#include "globalmatch/detail/survey/adjust_links.hpp"
#include "globalmatch/detail/survey/follow_scans.hpp"
#include "globalmatch/detail/survey/pairs_in_common.hpp"
#include "globalmatch/detail/survey/place_targets.hpp"
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
  std::vector<plan_pose> start, poses;               ///< of frames about the centers
  std::vector<double> raise;                         ///< [m]
  std::vector<vec3> tilts;  ///< [rad] by which each was turned about its center before

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
  }

  bool is_moved(std::size_t scan) const {
    return tilts[scan].squared_norm() > 0 || raise[scan] != 0 || poses[scan].yaw != start[scan].yaw ||
           !(poses[scan].shift == start[scan].shift);
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
  vec3 turn;  ///< [rad] of the source against the target

  levelled_pair(const refined_pair& pair, const survey& s, const levelled_survey& levelled) {
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

/// Turns scans about their centers to where ICP found their verticals to agree. Pairs in which it did not
/// turn freely are of scans that are level, but for what a compensator leaves. Beside a held scan that was
/// not refined, as ground control, verticals keep the mean that they have.
inline void adjust_tilts(survey& s, std::span<const refined_pair> refined, levelled_survey& levelled) {
  constexpr double level_sigma = 5e-4;  // [rad] a thirtieth of a degree
  constexpr double start_sigma = 5e-3;  // [rad] what the survey is good to: some tenths of a degree
  if (std::none_of(refined.begin(), refined.end(), [](const auto& p) { return p.tilt_sigma > 0; })) return;
  disjoint_sets connected(s.scans.size());
  std::vector<measured_difference> about_x, about_y;
  for (const refined_pair& p : refined) {
    if (!p.is_refined && !levelled.plan_held[p.start.source] && !levelled.plan_held[p.start.target]) continue;
    const levelled_pair pair(p, s, levelled);
    const bool is_free = p.tilt_sigma > 0;
    const double sigma = is_free ? p.tilt_sigma : p.is_refined ? level_sigma : start_sigma;
    measured_difference difference = pair.height;
    difference.variance = sigma * sigma;
    difference.change = is_free ? pair.turn.x : 0;
    about_x.push_back(difference);
    difference.change = is_free ? pair.turn.y : 0;
    about_y.push_back(difference);
    connected.join(difference.source, difference.target);
  }
  const adjusted_maps adjusted(levelled.plan_held, connected);
  const unknown_poses unknowns(s.scans.size(), [&](std::size_t m) { return !adjusted(m); });
  std::vector<double> x(s.scans.size(), 0), y = x;
  if (adjust_differences(about_x, unknowns, x).empty() || adjust_differences(about_y, unknowns, y).empty())
    return;
  for (std::size_t m = 0; m < s.scans.size(); ++m) {
    if (!adjusted(m)) continue;
    levelled.tilts[m] = {x[m], y[m], 0};
    const double angle = levelled.tilts[m].norm();
    if (!(angle > 0)) continue;
    const rigid back{mat3::identity(), -levelled.centers[m]},
        turned{rotation_about(levelled.tilts[m] / angle, angle), levelled.centers[m]};
    const Eigen::Isometry3d& level = levelled.level_from_survey[m];
    s.scans[m].survey_from_scan =
        level.inverse() * to_eigen(turned * back) * level * s.scans[m].survey_from_scan;
  }
}

/// Standard deviation [m] of stems in plan, with what tilts that were not known have done to them.
inline double stem_sigma_of(const survey& s, const levelled_survey& levelled) {
  double squares = 0, count = 0;
  for (const survey::tree& t : s.trees)
    for (const survey::observation& o : t.seen) {
      const vec3 place = from_eigen(Eigen::Vector3d(levelled.level_from_survey[o.scan] * t.position));
      squares += levelled.tilts[o.scan].cross(place - levelled.centers[o.scan]).xy().squared_norm() / 2;
      ++count;
    }
  return std::sqrt(s.stem_sigma * s.stem_sigma + squares / std::max(1.0, count));
}

/// The trees that more than one scan sees, and the targets, as observations of maps.
inline seen_trees levelled_landmarks(const survey& s, const levelled_survey& levelled, double stem_sigma) {
  seen_trees trees;
  for (const survey::tree& t : s.trees) {
    if (t.seen.size() < 2) continue;
    for (const survey::observation& o : t.seen)
      trees.observations.stems.push_back({std::uint32_t(o.scan), stem_index(o.stem)});
    trees.observations.first.push_back(trees.observations.stems.size());
    trees.places.push_back(
        from_eigen(Eigen::Vector3d(levelled.level_from_survey[t.seen[0].scan] * t.position)).xy());
  }
  trees.weights.assign(trees.observations.stems.size(), 1);
  for (const survey::target& t : s.targets) {
    if (t.seen.size() < 2) continue;
    for (const survey::target_observation& o : t.seen) {
      trees.observations.stems.push_back({std::uint32_t(o.scan), 0});
      trees.weights.push_back(o.weight * stem_sigma * stem_sigma / (o.sigma * o.sigma));
    }
    trees.observations.first.push_back(trees.observations.stems.size());
    trees.places.push_back(
        from_eigen(Eigen::Vector3d(levelled.level_from_survey[t.seen[0].scan] * t.position)).xy());
  }
  return trees;
}

/// Joins scans that targets hold together in plan: two that count for both.
inline void join_by_targets(const survey& s, disjoint_sets& connected) {
  constexpr double min_weight = 0.01;
  std::vector<std::uint64_t> keys;
  for (const survey::target& t : s.targets)
    for (const survey::target_observation& a : t.seen)
      for (const survey::target_observation& b : t.seen)
        if (a.scan < b.scan && std::min(a.weight, b.weight) > min_weight)
          keys.push_back(key_of(std::uint32_t(a.scan), std::uint32_t(b.scan)));
  std::sort(keys.begin(), keys.end());
  for (std::size_t i = 1; i < keys.size(); ++i)
    if (keys[i] == keys[i - 1]) connected.join(first_of(keys[i]), second_of(keys[i]));
}

/// What targets say of heights: each two scans that show one, of the weight that they have where its height
/// is eliminated.
inline std::vector<measured_difference> heights_by_targets(const survey& s, const levelled_survey& levelled) {
  constexpr double min_weight = 0.01;
  std::vector<measured_difference> differences;
  for (const survey::target& t : s.targets) {
    double total = 0;
    for (const survey::target_observation& o : t.seen) total += o.height_weight / (o.sigma * o.sigma);
    const auto height_of = [&](const survey::target_observation& o) {
      return (levelled.level_from_survey[o.scan] * (s.scans[o.scan].survey_from_scan * o.position)).z();
    };
    for (const survey::target_observation& a : t.seen)
      for (const survey::target_observation& b : t.seen)
        if (a.scan < b.scan && std::min(a.height_weight, b.height_weight) > min_weight)
          differences.push_back(
              {std::uint32_t(a.scan), std::uint32_t(b.scan), height_of(b) - height_of(a),
               total * a.sigma * a.sigma * b.sigma * b.sigma / (a.height_weight * b.height_weight)});
  }
  return differences;
}

/// New uncertainties, levelled: those of the start where nothing was adjusted.
using levelled_uncertainties = std::vector<transform_uncertainty>;

inline void adjust_shifts_and_turns(const survey& s, std::span<const refined_pair> refined,
                                    std::span<const levelled_pair> levelled_pairs, levelled_survey& levelled,
                                    levelled_uncertainties& uncertainties) {
  constexpr std::size_t min_trees = 3;  // that determine shift and turn, with one to spare
  disjoint_sets connected(s.scans.size());
  std::vector<survey_link> pairs;
  for (std::size_t i = 0; i < refined.size(); ++i)
    if (refined[i].is_refined) {
      pairs.push_back(levelled_pairs[i].link);
      connected.join(pairs.back().source, pairs.back().target);
    }
  if (pairs.empty()) return;
  for (const scans_in_common& c : all_in_common(s))
    if (c.trees >= min_trees) connected.join(c.first, c.second);
  join_by_targets(s, connected);
  const adjusted_maps adjusted(levelled.plan_held, connected);
  const unknown_poses unknowns(s.scans.size(), [&](std::size_t m) { return !adjusted(m); });
  const double stem_sigma = stem_sigma_of(s, levelled);
  const seen_trees trees = levelled_landmarks(s, levelled, stem_sigma);
  refined_plan_adjustment adjustment(levelled.start, trees, stem_sigma, pairs, unknowns);
  std::vector<plan_pose> poses = levelled.start;
  if (!adjustment.adjust(poses)) return;
  levelled.poses = std::move(poses);
  const auto covariances = adjustment.covariances();
  const int of[3] = {0, 1, 3};
  for (std::size_t m = 0; m < s.scans.size(); ++m)
    if (adjusted(m))
      for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r)
          uncertainties[m].covariance(of[r], of[c]) = covariances[unknowns.of[m]](r, c);
}

inline void adjust_in_height(survey& s, std::span<const refined_pair> refined,
                             std::span<const levelled_pair> levelled_pairs, levelled_survey& levelled,
                             levelled_uncertainties& uncertainties) {
  disjoint_sets connected(s.scans.size());
  std::vector<measured_difference> differences;
  for (std::size_t i = 0; i < refined.size(); ++i)
    if (refined[i].is_height_refined || refined[i].start.is_height_known) {
      differences.push_back(levelled_pairs[i].height);
      connected.join(differences.back().source, differences.back().target);
    }
  std::vector<std::uint8_t> has_pair(s.scans.size());
  for (const measured_difference& d : differences) has_pair[d.source] = has_pair[d.target] = true;
  for (const measured_difference& d : heights_by_targets(s, levelled)) {
    if (!has_pair[d.source] || !has_pair[d.target]) continue;  // its height is that of trees
    differences.push_back(d);
    connected.join(d.source, d.target);
  }
  const adjusted_maps adjusted(levelled.height_held, connected);
  std::erase_if(differences,
                [&](const measured_difference& d) { return !adjusted(d.source) && !adjusted(d.target); });
  const unknown_poses unknowns(s.scans.size(), [&](std::size_t m) { return !adjusted(m); });
  std::vector<double> raise = levelled.raise;
  const std::vector<double> variances = adjust_differences(differences, unknowns, raise);
  if (variances.empty()) return;
  levelled.raise = std::move(raise);
  for (std::size_t m = 0; m < s.scans.size(); ++m) {
    if (!adjusted(m)) continue;
    s.scans[m].is_height_known = true;
    uncertainties[m].covariance.row(2).setZero();
    uncertainties[m].covariance.col(2).setZero();
    uncertainties[m].covariance(2, 2) = variances[unknowns.of[m]];
  }
}

GLOBALMATCH_INLINE void adjust_to_refinements(survey& result, std::span<const refined_pair> refined,
                                              build_mode) {
  require_valid_pairs(result, refined);
  const survey before = result;
  levelled_survey levelled(before);
  adjust_tilts(result, refined, levelled);
  std::vector<levelled_pair> pairs;
  for (const refined_pair& p : refined) pairs.emplace_back(p, result, levelled);
  levelled_uncertainties uncertainties(before.scans.size());
  for (std::size_t m = 0; m < before.scans.size(); ++m)
    if (before.scans[m].uncertainty)
      uncertainties[m] = in_frame(*before.scans[m].uncertainty, levelled.level_from_survey[m]);
  adjust_shifts_and_turns(before, refined, pairs, levelled, uncertainties);
  adjust_in_height(result, refined, pairs, levelled, uncertainties);
  std::vector<Eigen::Isometry3d> changes(before.scans.size(), Eigen::Isometry3d::Identity());
  for (std::size_t m = 0; m < before.scans.size(); ++m) {
    survey::scan& scan = result.scans[m];
    if (!levelled.is_moved(m)) continue;
    scan.survey_from_scan = levelled.change_of(m) * scan.survey_from_scan;
    changes[m] = scan.survey_from_scan * before.scans[m].survey_from_scan.inverse();
    uncertainties[m].center = to_eigen(levelled.centers[m] + vec3{0, 0, levelled.raise[m]});
    uncertainties[m].center.head<2>() = to_eigen(levelled.poses[m].shift);
    scan.uncertainty = in_frame(uncertainties[m], levelled.level_from_survey[m].inverse());
  }
  follow_scans(result.trees, before, result, changes);
  place_targets(result);
  update_residuals(result);
}

}  // namespace globalmatch::detail
