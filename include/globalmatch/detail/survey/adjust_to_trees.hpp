// Poses of a survey adjusted with the trees of each component, and the targets, as landmarks.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/matrices.hpp"
#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "globalmatch/detail/survey/adjust_links.hpp"
#include "globalmatch/detail/survey/known_poses.hpp"
#include "globalmatch/detail/survey/link_graph.hpp"
#include "globalmatch/detail/survey/place_maps.hpp"
#include "globalmatch/detail/survey/plan_pose.hpp"
#include "globalmatch/detail/survey/stem_deviations.hpp"
#include "globalmatch/detail/survey/survey_link.hpp"
#include "globalmatch/detail/survey/survey_targets.hpp"
#include "globalmatch/detail/survey/survey_trees.hpp"
#include "globalmatch/detail/survey/tree_adjustment.hpp"

namespace globalmatch::detail {

/// Poses in plan, adjusted with the trees of each component and targets as landmarks; standard deviations.
struct adjusted_survey {
  std::vector<plan_pose> poses;
  std::vector<mat3> covariance;  ///< of shift and yaw of each pose, along the axes of the survey
  tree_observations trees;
  std::vector<double> weights;    ///< of the observations
  std::vector<double> agreement;  ///< of the observations: their weights without what is known of their maps
  double stem_sigma = 0;          ///< [m] of one of weight 1 in plan, along each axis
  target_observations targets;    ///< of each component by themselves
  std::vector<double> target_weights;  ///< of their observations, beside their standard deviations
};

/// Trees of all components, and of maps that stand alone none.
inline tree_observations trees_of_components(std::span<const prepared_stems> maps,
                                             std::span<const plan_pose> poses,
                                             const std::vector<std::vector<std::uint32_t>>& members,
                                             std::span<const double> radius) {
  tree_observations all;
  for (const auto& of_component : members) {
    if (of_component.size() < 2) continue;
    const tree_observations trees = find_trees(maps, of_component, poses, radius);
    const std::size_t before = all.stems.size();
    all.stems.insert(all.stems.end(), trees.stems.begin(), trees.stems.end());
    for (std::size_t t = 0; t < trees.size(); ++t) all.first.push_back(before + trees.first[t + 1]);
  }
  return all;
}

/// The poses that are adjusted to trees: those of maps in components of several, but not what these refer to.
inline unknown_poses unknown_poses_of(const placed_maps& placed,
                                      const std::vector<std::vector<std::uint32_t>>& members,
                                      const known_poses& known) {
  return unknown_poses(placed.poses.size(), [&](std::size_t m) {
    const std::uint32_t component = placed.parts.of[m];
    return members[component].size() < 2 || placed.parts.reference[component] == m || known.is_fixed(m);
  });
}

/// [m] within which the stems of maps are one tree, by the deviations [m] of their stems.
inline std::vector<double> tree_radii_of(std::span<const double> deviations) {
  constexpr double in_deviations = 6, min_radius = 0.05;  // [m]
  std::vector<double> radius;
  for (const double d : deviations) radius.push_back(std::max(min_radius, in_deviations * d));
  return radius;
}

/// Finds the trees by the poses, adjusts the poses to them, and does so again. Where that fails poses stay
/// those of the links, of an uncertainty that says nothing, and there are no trees.
inline adjusted_survey adjust_to_trees(std::span<const prepared_stems> maps, const placed_maps& placed,
                                       std::span<const survey_link> links,
                                       const std::vector<std::vector<std::uint32_t>>& members,
                                       const known_poses& known = {},
                                       const target_observations& targets = {}) {
  constexpr int iterations = 2;
  constexpr double unknown_shift = 1e6, unknown_yaw = 10;  // [m^2] [rad^2]
  adjusted_survey result;
  result.poses = placed.poses;
  result.covariance.resize(maps.size());
  result.targets = targets_of_components(targets, placed.parts.of);
  const unknown_poses unknowns = unknown_poses_of(placed, members, known);
  const std::vector<double> deviations = deviations_by_links(maps, links);
  const std::vector<double> radius = tree_radii_of(deviations);
  for (int iteration = 0; iteration < iterations; ++iteration) {
    result.trees = trees_of_components(maps, result.poses, members, radius);
    tree_adjustment adjustment(maps, result.trees, links, unknowns, deviations, result.targets);
    std::vector<plan_pose> poses = result.poses;
    if (!adjustment.adjust(poses)) {
      result.trees = {};
      result.weights.clear();
      result.agreement.clear();
      result.target_weights.assign(result.targets.seen.size(), 0);
      result.covariance.assign(maps.size(), mat3::diagonal_of({unknown_shift, unknown_shift, unknown_yaw}));
      break;
    }
    result.poses = std::move(poses);
    result.weights = adjustment.weights();
    result.agreement = adjustment.agreement();
    result.target_weights = adjustment.target_weights();
    result.stem_sigma = adjustment.sigma();
    if (iteration + 1 < iterations) continue;
    result.covariance = adjustment.covariances();
  }
  return result;
}

/// The maps of each component, in the order in which links lead to them from its reference.
inline std::vector<std::vector<std::uint32_t>> members_of(const placed_maps& placed, const link_graph& used) {
  std::vector<std::vector<std::uint32_t>> members(placed.parts.count());
  std::vector<std::uint8_t> reached(used.size());
  for (std::size_t c = 0; c < members.size(); ++c) {
    auto& of = members[c];
    of.assign(1, placed.parts.reference[c]);
    reached[of[0]] = true;
    for (std::size_t next = 0; next < of.size(); ++next)
      for (const auto& e : used.of(of[next]))
        if (!reached[e.neighbor]) reached[e.neighbor] = true, of.push_back(e.neighbor);
  }
  return members;
}

}  // namespace globalmatch::detail
