// All poses of a survey adjusted to pairs of its scans, and what depends on them. In: a survey, refined
// pairs. Out: its poses, heights, uncertainties, trees and residuals.
#pragma once

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/disjoint_sets.hpp"
#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/keyed_sort.hpp"
#include "globalmatch/detail/core/matrices.hpp"
#include "globalmatch/detail/survey/adjust_links.hpp"
#include "globalmatch/detail/survey/follow_scans.hpp"
#include "globalmatch/detail/survey/levelled_survey.hpp"
#include "globalmatch/detail/survey/pairs_in_common.hpp"
#include "globalmatch/detail/survey/place_targets.hpp"
#include "globalmatch/detail/survey/plan_pose.hpp"
#include "globalmatch/detail/survey/pose_uncertainty.hpp"
#include "globalmatch/detail/survey/refined_adjustment.hpp"
#include "globalmatch/detail/survey/survey_link.hpp"
#include "globalmatch/refinement_options.hpp"
#include "globalmatch/survey_options.hpp"

namespace globalmatch::detail {

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
    levelled.is_adjusted[m] = true;
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
    for (const survey::observation& o : t.seen) {
      trees.observations.stems.push_back({std::uint32_t(o.scan), stem_index(o.stem)});
      trees.weights.push_back(o.weight);
    }
    trees.observations.first.push_back(trees.observations.stems.size());
    trees.places.push_back(
        from_eigen(Eigen::Vector3d(levelled.level_from_survey[t.seen[0].scan] * t.position)).xy());
  }
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

/// What priors do.
enum class prior_use {
  test,     ///< move scans, whose uncertainties are then those in the frame of the priors
  measure,  ///< move scans, whose uncertainties stay those against a reference
  keep      ///< are part of the survey as it is
};

/// What was adjusted: nothing, where no measurement says anything of it or not all is determined.
struct adjusted_parts {
  bool shifts = false, heights = false;  ///< the former with turns
};

/// What targets say of heights: each two scans that show one, of the weight that they have where its height
/// is eliminated. Where trees are taken as they are, because priors move scans, so are targets, to which
/// heights were adjusted as well.
inline std::vector<measured_difference> heights_by_targets(const survey& s, const levelled_survey& levelled,
                                                           prior_use use) {
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
              {std::uint32_t(a.scan), std::uint32_t(b.scan),
               use == prior_use::keep ? height_of(b) - height_of(a) : 0,
               total * a.sigma * a.sigma * b.sigma * b.sigma / (a.height_weight * b.height_weight)});
  }
  return differences;
}

/// What pairs say of a survey: those of refined scans, and those of scans with the frame that their priors
/// are measured in.
struct levelled_pairs {
  std::vector<levelled_pair> refined, of_priors;
};

/// Adds the pairs of priors, as far as `says(pair)`, whose scans `connected` ties to held ones: it is scans
/// that hold together that a prior moves, and not what is held by itself. Returns the maps that are adjusted.
template <class Says, class Add>
adjusted_maps add_priors(const levelled_pairs& pairs, const std::vector<std::uint8_t>& held,
                         disjoint_sets connected, const Says& says, const Add& add) {
  const adjusted_maps tied(held, connected);
  for (const levelled_pair& p : pairs.of_priors) {
    const bool is_held = held[p.link.source] != 0;
    if (!says(p) || !(is_held || tied(p.link.source)) || (is_held && held[p.link.target])) continue;
    add(p);
    connected.join(p.link.source, p.link.target);
  }
  return adjusted_maps(held, connected);
}

/// New uncertainties, levelled: those of the start where nothing was adjusted.
using levelled_uncertainties = std::vector<transform_uncertainty>;

inline bool adjust_shifts_and_turns(const survey& s, const levelled_pairs& all, prior_use use,
                                    levelled_survey& levelled, levelled_uncertainties& uncertainties) {
  constexpr std::size_t min_trees = 3;  // that determine shift and turn, with one to spare
  disjoint_sets connected(s.scans.size());
  std::vector<survey_link> pairs;
  const auto add = [&](const levelled_pair& p) { pairs.push_back(p.link); };
  for (const levelled_pair& p : all.refined)
    if (p.has_shift) {
      add(p);
      connected.join(p.link.source, p.link.target);
    }
  for (const scans_in_common& c : all_in_common(s))
    if (c.trees >= min_trees) connected.join(c.first, c.second);
  join_by_targets(s, connected);
  const adjusted_maps adjusted = add_priors(
      all, levelled.plan_held, connected, [](const levelled_pair& p) { return p.has_shift; }, add);
  if (pairs.empty()) return false;
  const unknown_poses unknowns(s.scans.size(), [&](std::size_t m) {
    return !levelled.is_unknown(m, adjusted(m), levelled.plan_held[m] != 0);
  });
  const double stem_sigma = stem_sigma_of(s, levelled);
  const seen_trees trees = levelled_landmarks(s, levelled, stem_sigma);
  refined_plan_adjustment adjustment(levelled.start, trees, stem_sigma, pairs, unknowns);
  std::vector<plan_pose> poses = levelled.start;
  if (!adjustment.adjust(poses, use == prior_use::keep)) return false;
  levelled.poses = std::move(poses);
  const auto covariances = adjustment.covariances();
  const int of[3] = {0, 1, 3};
  for (std::size_t m = 0; m < s.scans.size(); ++m) {
    if (unknowns.of[m] == unknown_poses::fixed) continue;
    levelled.is_adjusted[m] = true;
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < 3; ++r)
        uncertainties[m].covariance(of[r], of[c]) = covariances[unknowns.of[m]](r, c);
  }
  return true;
}

inline bool adjust_in_height(survey& s, const levelled_pairs& all, prior_use use, levelled_survey& levelled,
                             levelled_uncertainties& uncertainties) {
  disjoint_sets connected(s.scans.size());
  std::vector<measured_difference> differences;
  const auto add = [&](const levelled_pair& p) { differences.push_back(p.height); };
  for (const levelled_pair& p : all.refined)
    if (p.has_height) {
      add(p);
      connected.join(p.height.source, p.height.target);
    }
  // Beside refined pairs the height of a scan without any is that of trees, and is left.
  std::vector<std::uint8_t> has_pair(s.scans.size(), use != prior_use::keep);
  for (const measured_difference& d : differences) has_pair[d.source] = has_pair[d.target] = true;
  for (const measured_difference& d : heights_by_targets(s, levelled, use)) {
    if (!has_pair[d.source] || !has_pair[d.target]) continue;
    differences.push_back(d);
    connected.join(d.source, d.target);
  }
  const adjusted_maps adjusted = add_priors(
      all, levelled.height_held, connected, [](const levelled_pair& p) { return p.has_height; }, add);
  const unknown_poses unknowns(s.scans.size(), [&](std::size_t m) {
    return !levelled.is_unknown(m, adjusted(m), levelled.height_held[m] != 0);
  });
  const auto is_known = [&](std::size_t m) { return unknowns.of[m] == unknown_poses::fixed; };
  std::erase_if(differences,
                [&](const measured_difference& d) { return is_known(d.source) && is_known(d.target); });
  std::vector<double> raise = levelled.raise;
  const std::vector<double> variances =
      adjust_differences(differences, unknowns, raise, use == prior_use::keep);
  if (variances.empty()) return false;
  levelled.raise = std::move(raise);
  for (std::size_t m = 0; m < s.scans.size(); ++m) {
    if (is_known(m)) continue;
    levelled.is_adjusted[m] = true;
    s.scans[m].is_height_known = true;
    uncertainties[m].covariance.row(2).setZero();
    uncertainties[m].covariance.col(2).setZero();
    uncertainties[m].covariance(2, 2) = variances[unknowns.of[m]];
  }
  return true;
}

/// Adjusts all poses to refined pairs and to priors, and in plan to the trees and targets as they are.
/// Components that neither say anything of stay.
inline adjusted_parts adjust_to_pairs(survey& result, std::span<const refined_pair> refined,
                                      std::span<const refined_pair> of_priors, prior_use use) {
  const survey before = result;
  levelled_survey levelled(before);
  if (use != prior_use::keep) levelled.hold_only_in(before, of_priors);
  if (use == prior_use::test) levelled.hold_frames(before, of_priors);
  adjust_tilts(result, refined, levelled);
  levelled_pairs pairs;
  for (const refined_pair& p : refined) pairs.refined.emplace_back(p, result, levelled);
  for (const refined_pair& p : of_priors) pairs.of_priors.emplace_back(p, result, levelled);
  levelled_uncertainties uncertainties(before.scans.size());
  for (std::size_t m = 0; m < before.scans.size(); ++m)
    if (before.scans[m].uncertainty)
      uncertainties[m] = in_frame(*before.scans[m].uncertainty, levelled.level_from_survey[m]);
  const adjusted_parts adjusted = {adjust_shifts_and_turns(before, pairs, use, levelled, uncertainties),
                                   adjust_in_height(result, pairs, use, levelled, uncertainties)};
  std::vector<Eigen::Isometry3d> changes(before.scans.size(), Eigen::Isometry3d::Identity());
  for (std::size_t m = 0; m < before.scans.size(); ++m) {
    survey::scan& scan = result.scans[m];
    if (!levelled.is_adjusted[m]) continue;
    scan.survey_from_scan = levelled.change_of(m) * scan.survey_from_scan;
    changes[m] = scan.survey_from_scan * before.scans[m].survey_from_scan.inverse();
    uncertainties[m].center = to_eigen(levelled.centers[m] + vec3{0, 0, levelled.raise[m]});
    uncertainties[m].center.head<2>() = to_eigen(levelled.poses[m].shift);
    scan.uncertainty = in_frame(uncertainties[m], levelled.level_from_survey[m].inverse());
  }
  follow_scans(result.trees, before, result, changes);
  place_targets(result);
  update_residuals(result);
  return adjusted;
}

}  // namespace globalmatch::detail