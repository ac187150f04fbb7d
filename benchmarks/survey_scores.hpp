// How far a survey is from the truth.
#pragma once

#include <globalmatch/detail/core/eigen_border.hpp>
#include <globalmatch/detail/core/rigid_fit.hpp>
#include <globalmatch/detail/core/statistics.hpp>
#include <globalmatch/detail/verbs/describe_survey.hpp>
#include <globalmatch/survey.hpp>

#include "normalised_errors.hpp"
#include "survey_layouts.hpp"
#include "survey_scenes.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

namespace globalmatch::benchmarks {

using poses = std::vector<Eigen::Isometry3d>;

/// Least squares transform of a survey's poses onto the true ones, without those that are far off. Two poses
/// determine it.
inline Eigen::Isometry3d align(const poses& estimated, const poses& truth) {
  constexpr double arm = 10, far_off = 0.5, in_medians = 4;  // [m]
  constexpr int iterations = 10;
  std::vector<bool> counts(estimated.size(), true);
  Eigen::Isometry3d aligned = Eigen::Isometry3d::Identity();
  for (int iteration = 0; iteration < iterations; ++iteration) {
    std::vector<vec3> from, to;
    for (std::size_t i = 0; i < estimated.size(); ++i)
      for (const Eigen::Vector3d& p : {Eigen::Vector3d(arm, 0, 0), Eigen::Vector3d(-arm, 0, 0)})
        if (counts[i]) from.push_back(from_eigen(estimated[i] * p)), to.push_back(from_eigen(truth[i] * p));
    const auto fitted = fit_rigid(from, to, degrees_of_freedom::four);
    if (!fitted) break;
    aligned = to_eigen(*fitted);
    std::vector<double> off;
    for (std::size_t i = 0; i < estimated.size(); ++i)
      off.push_back((aligned * estimated[i].translation() - truth[i].translation()).head<2>().norm());
    const double limit = std::max(far_off, in_medians * median(off));
    for (std::size_t i = 0; i < off.size(); ++i) counts[i] = off[i] < limit;
  }
  return aligned;
}

inline bool is_wrong(const Eigen::Isometry3d& pose, const Eigen::Isometry3d& truth) {
  constexpr double max_shift = 0.5, max_turn = 3 * std::numbers::pi / 180;  // [m] [rad]
  return (pose.translation() - truth.translation()).head<2>().norm() > max_shift ||
         Eigen::AngleAxisd(truth.linear().transpose() * pose.linear()).angle() > max_turn;
}

/// Errors [m] of stations.
struct station_errors {
  double median = 0, worst = 0, height_median = 0, height_worst = 0;
};

inline station_errors errors_of(const poses& estimated, const poses& truth) {
  const Eigen::Isometry3d aligned = align(estimated, truth);
  std::vector<double> horizontal, vertical;
  for (std::size_t i = 0; i < estimated.size(); ++i) {
    const Eigen::Vector3d off = aligned * estimated[i].translation() - truth[i].translation();
    horizontal.push_back(off.head<2>().norm());
    vertical.push_back(std::abs(off.z()));
  }
  if (horizontal.empty()) return {};
  return {median(horizontal), *std::max_element(horizontal.begin(), horizontal.end()), median(vertical),
          *std::max_element(vertical.begin(), vertical.end())};
}

struct survey_counts {
  std::size_t maps = 0, aliens = 0;
  std::size_t placed = 0;                   ///< in the component of the most maps
  std::size_t reachable = 0, of_these = 0;  ///< maps with 12 stems in common with a placed one; those placed
  std::size_t wrong = 0;                    ///< of all components
  std::size_t ambiguous = 0, unplaced = 0;
  std::size_t mixed = 0;  ///< components of maps of different stands
  std::size_t placed_aliens = 0;

  void add(const survey_counts& c) {
    maps += c.maps, aliens += c.aliens, placed += c.placed, reachable += c.reachable, of_these += c.of_these;
    wrong += c.wrong, ambiguous += c.ambiguous, unplaced += c.unplaced, mixed += c.mixed;
    placed_aliens += c.placed_aliens;
  }
};

struct survey_score {
  survey_counts counts;
  station_errors errors, oracle;  ///< of the component of the most maps, without wrong places
  std::vector<bool> wrong;        ///< each map
};

/// The maps of each component.
inline std::vector<std::vector<std::size_t>> maps_of_components(const survey& found) {
  std::vector<std::vector<std::size_t>> of(found.components);
  for (std::size_t m = 0; m < found.scans.size(); ++m)
    if (found.scans[m].status == survey::status::placed)
      of[std::size_t(found.scans[m].component)].push_back(m);
  return of;
}

/// Whether each map is at a wrong place, of those of its component.
inline std::vector<bool> find_wrong(const survey& found, const std::vector<surveyed_map>& maps) {
  std::vector<bool> wrong(maps.size(), false);
  for (const auto& of : maps_of_components(found)) {
    poses estimated, truth;
    for (const std::size_t m : of) {
      estimated.push_back(found.scans[m].survey_from_scan);
      truth.push_back(maps[m].stand_from_scan);
    }
    const Eigen::Isometry3d aligned = align(estimated, truth);
    for (std::size_t i = 0; i < of.size(); ++i) wrong[of[i]] = is_wrong(aligned * estimated[i], truth[i]);
  }
  return wrong;
}

inline survey_counts count(const survey& found, const std::vector<surveyed_map>& maps,
                           const std::vector<bool>& wrong) {
  constexpr std::size_t enough = 12;  // stems in common
  survey_counts c;
  const auto is_placed = [&](std::size_t m) { return found.scans[m].status == survey::status::placed; };
  const auto common = stems_in_common(maps);
  for (std::size_t m = 0; m < maps.size(); ++m) {
    if (maps[m].stand != 0) {
      ++c.aliens;
      c.placed_aliens += is_placed(m);
      continue;
    }
    ++c.maps;
    c.placed += is_placed(m) && found.scans[m].component == 0;
    c.wrong += wrong[m];
    c.ambiguous += found.scans[m].status == survey::status::ambiguous;
    c.unplaced += !is_placed(m) && found.scans[m].status != survey::status::ambiguous;
    if (std::any_of(common[m].begin(), common[m].end(),
                    [&](const auto& o) { return o.second >= enough && is_placed(o.first); }))
      ++c.reachable, c.of_these += is_placed(m);
  }
  for (const auto& of : maps_of_components(found))
    c.mixed += std::any_of(of.begin(), of.end(),
                           [&](std::size_t m) { return maps[m].stand != maps[of.front()].stand; });
  return c;
}

/// Full least squares with the true associations, from the true poses: trees are those that the maps really
/// saw, and all else is as in the survey. Poses of `members`, whose first is held fixed.
inline poses adjust_to_true_trees(const local_survey& s, const std::vector<surveyed_map>& maps,
                                  std::span<const std::size_t> members, double noise) {
  std::vector<std::vector<stem_of_map>> seen;
  std::vector<plan_pose> at(maps.size());
  std::vector<bool> is_member(maps.size(), false);
  for (const std::size_t m : members) {
    is_member[m] = true;
    const position_set& stems = s.maps[m].stems;
    at[m] = plan_of(from_eigen(maps[m].stand_from_scan) * stems.frame.local_from_scan().inverse());
    for (stem_index i = 0; i < stems.size(); ++i) {
      const std::size_t tree = maps[m].trees[stems.original[i]];
      if (tree == no_tree) continue;
      if (tree >= seen.size()) seen.resize(tree + 1);
      seen[tree].push_back({std::uint32_t(m), i});
    }
  }
  tree_observations trees;
  for (const auto& of_tree : seen) {
    trees.stems.insert(trees.stems.end(), of_tree.begin(), of_tree.end());
    trees.first.push_back(trees.stems.size());
  }
  const auto fixed = std::uint32_t(members.front());
  const unknown_poses unknowns(maps.size(), [&](std::size_t m) { return !is_member[m] || m == fixed; });
  tree_adjustment adjustment(s.maps, trees, {}, unknowns, std::vector<double>(maps.size(), noise));
  if (!adjustment.adjust(at)) return {};
  const link_graph used(maps.size(), s.links, [&](const survey_link& l) { return l.used; });
  const std::vector<std::vector<std::uint32_t>> one_component = {{members.begin(), members.end()}};
  const survey_heights heights = find_heights(s.maps, trees, used, one_component);
  poses adjusted;
  for (const std::size_t m : members)
    adjusted.push_back(
        to_eigen(in_space(at[m], heights.of_map[m]) * s.maps[m].stems.frame.local_from_scan()));
  return adjusted;
}

/// Adds the errors of all placed maps that are not wrong, against the references of their components.
inline void add_normalised_errors(const survey& found, const local_survey& s,
                                  const std::vector<surveyed_map>& maps, const std::vector<bool>& wrong,
                                  normalised_errors& errors) {
  for (std::size_t m = 0; m < maps.size(); ++m) {
    const survey::scan& scan = found.scans[m];
    const std::size_t reference = s.placed.parts.reference[s.placed.parts.of[m]];
    if (scan.status != survey::status::placed || wrong[m] || m == reference || wrong[reference] ||
        maps[m].stand != maps[reference].stand)
      continue;
    errors.add(scan.survey_from_scan, maps[reference].stand_from_scan.inverse() * maps[m].stand_from_scan,
               *scan.uncertainty, scan.is_height_known);
  }
}

inline survey_score score(const survey& found, const local_survey& s, const std::vector<surveyed_map>& maps,
                          double noise) {
  survey_score result;
  result.wrong = find_wrong(found, maps);
  result.counts = count(found, maps, result.wrong);
  const auto components = maps_of_components(found);
  if (components.empty() || components[0].empty()) return result;
  const std::size_t reference = s.placed.parts.reference[s.placed.parts.of[components[0][0]]];
  std::vector<std::size_t> members = {reference};
  for (const std::size_t m : components[0])
    if (m != reference && !result.wrong[m] && maps[m].stand == maps[reference].stand) members.push_back(m);
  poses estimated, truth;
  for (const std::size_t m : members) {
    estimated.push_back(found.scans[m].survey_from_scan);
    truth.push_back(maps[m].stand_from_scan);
  }
  result.errors = errors_of(estimated, truth);
  result.oracle = errors_of(adjust_to_true_trees(s, maps, members, noise), truth);
  return result;
}

}  // namespace globalmatch::benchmarks
