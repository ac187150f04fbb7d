// Poses of a survey adjusted to priors, the frame of which is one more scan. In: a survey in the frame of its
// priors, refined pairs. Out: its poses, and all that depends on them.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/keyed_sort.hpp"
#include "globalmatch/detail/core/local_frame.hpp"
#include "globalmatch/detail/core/rigid.hpp"
#include "globalmatch/detail/matching/prior.hpp"
#include "globalmatch/detail/survey/adjust_to_pairs.hpp"
#include "globalmatch/detail/survey/pairs_in_common.hpp"
#include "globalmatch/detail/survey/pose_uncertainty.hpp"
#include "globalmatch/detail/survey/prior_tests.hpp"
#include "globalmatch/detail/survey/survey_frames.hpp"
#include "globalmatch/refinement_options.hpp"
#include "globalmatch/survey_options.hpp"

namespace globalmatch::detail {

/// What a prior leaves open, along the levelled axes; of what was not measured all.
inline transform_uncertainty uncertainty_of(const survey::adjusted_prior& p, const Eigen::Vector3d& center,
                                            const Eigen::Vector3d& up) {
  constexpr double unknown = std::numeric_limits<double>::infinity();
  const auto of = [](double sigma, double weight) {
    return weight > 0 ? sigma / std::sqrt(weight) : unknown;
  };
  const double horizontal = variance_of_shift(of(p.given.sigma_plan, p.weight));
  rigid level;
  level.rotation = levelling_rotation(from_eigen(up));
  transform_uncertainty levelled{center, Eigen::Vector3d::UnitZ(), {}};
  levelled.covariance =
      Eigen::Vector4d(horizontal, horizontal, variance_of_shift(of(p.given.sigma_height, p.height_weight)),
                      variance_of_yaw(of(p.given.sigma_yaw, p.yaw_weight)))
          .asDiagonal();
  transform_uncertainty u = in_frame(levelled, to_eigen(level.inverse()));
  u.center = center;
  u.up = up;
  return u;
}

/// A prior as a pair of its scan with the frame `frame`, which has the number of a scan. Priors that were
/// adjusted to, as the trees are, say what they said, about where the scan is.
inline refined_pair pair_of(const survey::adjusted_prior& p, const survey& s, std::size_t frame,
                            prior_use use) {
  const survey_options::prior& given = p.given;
  const survey::scan& scan = s.scans[given.scan];
  refined_pair pair;
  pair.start.source = given.scan;
  pair.start.target = frame;
  pair.is_refined = p.weight > 0 || p.yaw_weight > 0;
  pair.is_height_refined = p.height_weight > 0;
  pair.target_from_source = scan.survey_from_scan;
  if (use != prior_use::keep) {
    Eigen::Isometry3d& pose = pair.target_from_source;
    const double yaw = std::atan2(pose(1, 0), pose(0, 0));
    if (p.yaw_weight > 0)
      pose.linear() = Eigen::AngleAxisd(wrapped(given.yaw - yaw), scan.uncertainty->up).toRotationMatrix() *
                      pose.linear();
    if (p.weight > 0) pose.translation().head<2>() = given.position.head<2>();
    if (p.height_weight > 0) pose.translation().z() = given.position.z();
  }
  pair.uncertainty = uncertainty_of(p, pair.target_from_source.translation(), scan.uncertainty->up);
  return pair;
}

/// The frame of a component as one more scan, at the middle of the others. Held where it is that of fixed
/// scans; else it is the reference that others are placed beside.
inline survey::scan scan_of_frame(const survey& s, int component) {
  survey::scan frame;
  frame.component = component;
  frame.is_height_known = true;
  transform_uncertainty u;
  double count = 0;
  for (const survey::scan& scan : s.scans) {
    if (scan.component != component || !scan.uncertainty) continue;
    u.center += scan.uncertainty->center;
    u.up = scan.uncertainty->up;
    ++count;
  }
  u.center /= count;
  const bool is_held = s.frames[std::size_t(component)].source == survey::frame_source::fixed;
  u.covariance = is_held ? Eigen::Matrix4d::Zero().eval() : Eigen::Matrix4d::Identity().eval();
  frame.uncertainty = u;
  return frame;
}

/// What trees say of heights: each two scans that see one, of the weight that they have where its height is
/// eliminated. `stem_sigma` [m] of the height of a stem.
inline std::vector<refined_pair> heights_by_trees(const survey& s, double stem_sigma) {
  const double variance = std::max(1e-6, stem_sigma * stem_sigma);
  std::vector<std::pair<std::uint64_t, double>> information;  // of pairs of scans [1/m^2]
  for (const survey::tree& t : s.trees) {
    double total = 0;
    for (const survey::observation& o : t.seen) total += o.height_weight;
    for (const survey::observation& a : t.seen)
      for (const survey::observation& b : t.seen)
        if (a.scan < b.scan && a.height_weight > 0 && b.height_weight > 0)
          information.emplace_back(key_of(std::uint32_t(a.scan), std::uint32_t(b.scan)),
                                   a.height_weight * b.height_weight / (total * variance));
  }
  std::sort(information.begin(), information.end());
  std::vector<refined_pair> pairs;
  for (std::size_t i = 0; i < information.size();) {
    const std::uint64_t key = information[i].first;
    double sum = 0;
    for (; i < information.size() && information[i].first == key; ++i) sum += information[i].second;
    refined_pair pair;
    pair.start = placed_pair(s, second_of(key), first_of(key));
    pair.target_from_source = pair.start.target_from_source;
    pair.uncertainty = pair.start.uncertainty;
    pair.uncertainty.covariance(2, 2) = 1 / sum;
    pairs.push_back(std::move(pair));
  }
  return pairs;
}

/// Adjusts all poses to refined pairs, trees, targets, and the priors that count, of one component or of all
/// (-1). The frame of the priors is that of the survey afterwards as well.
inline adjusted_parts adjust_with_frames(survey& s, std::span<const refined_pair> refined, prior_use use,
                                         int of_component = -1) {
  constexpr std::size_t none = std::numeric_limits<std::size_t>::max();
  const std::size_t scans = s.scans.size();
  std::vector<std::size_t> frame_of(s.components, none);
  std::vector<refined_pair> of_priors;
  for (const survey::adjusted_prior& p : s.priors) {
    const int component = s.scans[p.given.scan].component;
    if (component < 0 || !s.scans[p.given.scan].uncertainty) continue;
    if (of_component >= 0 && component != of_component) continue;
    std::size_t& frame = frame_of[std::size_t(component)];
    if (frame == none) {
      frame = s.scans.size();
      s.scans.push_back(scan_of_frame(s, component));
    }
    of_priors.push_back(pair_of(p, s, frame, use));
  }
  const adjusted_parts adjusted = adjust_to_pairs(s, refined, of_priors, use);
  const std::vector<survey::scan> frames(s.scans.begin() + std::ptrdiff_t(scans), s.scans.end());
  s.scans.resize(scans);
  for (const survey::scan& frame : frames)
    if (s.frames[std::size_t(frame.component)].source != survey::frame_source::fixed)
      move_component(s, frame.component, frame.survey_from_scan.inverse());
  return adjusted;
}

/// Adjusts the survey to refined pairs where it was adjusted to its priors before.
inline void adjust_beside_priors(survey& s, std::span<const refined_pair> refined) {
  adjust_with_frames(s, refined, prior_use::keep);
  note_deviations(s);
}

/// Leaves out what the others and the stems contradict, and adjusts the survey to the priors that are left,
/// each component by itself. `stem_height_sigma` [m] of the height of a stem.
inline void adjust_to_priors(survey& s, double stem_height_sigma) {
  const std::vector<refined_pair> heights = heights_by_trees(s, stem_height_sigma);
  for (int component = 0; component < int(s.components); ++component) {
    const bool has_priors = std::ranges::any_of(
        s.priors, [&](const auto& p) { return s.scans[p.given.scan].component == component; });
    if (!has_priors) continue;
    const double yaw_sigma = leave_out_contradicted(s, component, [&](survey& trial) {
      return adjust_with_frames(trial, heights, prior_use::test, component);
    });
    survey::frame& frame = s.frames[std::size_t(component)];
    const auto size =
        std::ranges::count_if(s.scans, [&](const auto& scan) { return scan.component == component; });
    if (frame.source == survey::frame_source::priors && size > 1) frame.yaw_sigma = yaw_sigma;
    adjust_with_frames(s, heights, prior_use::measure, component);
  }
  note_deviations(s);
}

}  // namespace globalmatch::detail
