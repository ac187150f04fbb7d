// A further map of a survey that was solved without it. In: the survey, links as they are with the map. Out:
// the survey with the map placed and all adjusted, where the links contradict nothing.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "globalmatch/detail/survey/adjust_links.hpp"
#include "globalmatch/detail/survey/adjust_to_trees.hpp"
#include "globalmatch/detail/survey/confirm_links.hpp"
#include "globalmatch/detail/survey/known_poses.hpp"
#include "globalmatch/detail/survey/link_graph.hpp"
#include "globalmatch/detail/survey/plan_pose.hpp"
#include "globalmatch/detail/survey/proposed_places.hpp"
#include "globalmatch/detail/survey/stem_deviations.hpp"
#include "globalmatch/detail/survey/survey_heights.hpp"
#include "globalmatch/detail/survey/survey_link.hpp"
#include "globalmatch/detail/survey/survey_trees.hpp"
#include "globalmatch/detail/survey/tree_adjustment.hpp"
#include "globalmatch/detail/verbs/describe_survey.hpp"
#include "globalmatch/execution.hpp"

namespace globalmatch::detail {

/// Takes links over into a survey that was solved with the first of them, as they were `before`. Returns
/// those that are used since; nothing where one is not used any more that the survey used.
inline std::optional<std::vector<std::uint32_t>> take_links(local_survey& s,
                                                            std::span<const survey_link> before,
                                                            std::span<const survey_link> now) {
  std::vector<std::uint32_t> since;
  s.placed.tried.resize(now.size());
  for (std::uint32_t l = 0; l < now.size(); ++l) {
    const bool was_used = l < before.size() && before[l].used;
    if (l == s.links.size()) s.links.push_back(now[l]);
    if (was_used && !now[l].used && s.links[l].used) return std::nullopt;
    s.links[l].supporting_cycles = now[l].supporting_cycles;
    s.placed.tried[l] = now[l].used;
    if (!now[l].used || was_used) continue;
    s.links[l].used = true;
    since.push_back(l);
  }
  return since;
}

/// Adds the last map as a component of its own.
inline void add_alone(local_survey& s) {
  const auto last = std::uint32_t(s.maps.size() - 1);
  s.placed.poses.push_back({});
  s.placed.ambiguous.push_back(false);
  s.placed.parts.of.push_back(std::uint32_t(s.members.size()));
  s.placed.parts.reference.push_back(last);
  s.members.push_back({last});
  s.adjusted.poses.push_back({});
  s.adjusted.covariance.push_back({});
}

/// Moves the last map, which is alone, into another component.
inline void join_last(local_survey& s, std::uint32_t component, const plan_pose& pose) {
  const auto last = std::uint32_t(s.maps.size() - 1);
  s.placed.parts.of[last] = component;
  s.placed.parts.reference.pop_back();
  s.members.pop_back();
  s.members[component].push_back(last);
  s.placed.poses[last] = s.adjusted.poses[last] = pose;
}

/// Where links place a map whose other maps are held; nothing unless they all agree.
inline std::optional<plan_pose> place_by_links(std::uint32_t map, std::vector<survey_link> links,
                                               std::vector<plan_pose> poses) {
  const link_graph graph(poses.size(), links, [](const survey_link&) { return true; });
  std::vector<proposed_place> places;
  for (const auto& e : graph.of(map)) {
    const survey_link& l = graph.link(e);
    places.push_back({poses[e.neighbor] * graph.neighbor_from(map, e),
                      l.source == map ? l.center_in_source() : l.center, e.link});
  }
  poses[map] = places[max_agreement(places).one].pose;
  const unknown_poses unknowns(poses.size(), [&](std::size_t m) { return m != map; });
  if (!adjust_links(poses, unknowns, links)) return std::nullopt;
  if (!std::all_of(links.begin(), links.end(), [](const survey_link& l) { return l.used; }))
    return std::nullopt;
  return poses[map];
}

/// Places the last map by the links that are used `since` it came; false where these contradict each other or
/// the survey, or connect what was not connected.
inline bool place_last(local_survey& s, std::span<const std::uint32_t> since) {
  const auto last = std::uint32_t(s.maps.size() - 1);
  std::vector<survey_link> own;
  std::vector<std::uint32_t> components_of_links;
  for (const std::uint32_t i : since) {
    const survey_link& l = s.links[i];
    for (const std::uint32_t m : {l.source, l.target})
      if (m != last) components_of_links.push_back(s.placed.parts.of[m]);
    if (l.source == last || l.target == last)
      own.push_back(l);
    else if (!(weight_of(l, link_residual(l, s.adjusted.poses[l.source], s.adjusted.poses[l.target])) > 0))
      return false;
  }
  add_alone(s);
  if (since.empty()) return true;
  const std::uint32_t component = components_of_links.front();
  const bool is_one = std::all_of(components_of_links.begin(), components_of_links.end(),
                                  [&](std::uint32_t c) { return c == component; });
  if (!is_one || s.members[component].size() < 2) return false;
  if (own.empty()) return true;
  const auto pose = place_by_links(last, std::move(own), s.adjusted.poses);
  if (pose) join_last(s, component, *pose);
  return pose.has_value();
}

/// The largest distance [m] in plan of stems of a map from the origin of its frame.
inline double range_of(const prepared_stems& map) {
  double range = 0;
  for (const vec3& p : map.stems.at) range = std::max(range, p.xy().norm());
  return range;
}

/// Fits the last map to the trees that others show, and adds its stems to these.
inline void fit_last_to_trees(local_survey& s, std::span<const double> deviations) {
  constexpr int iterations = 2;
  const auto last = std::uint32_t(s.maps.size() - 1);
  const std::vector<double> radius = tree_radii_of(deviations);
  adjusted_survey& adjusted = s.adjusted;
  std::vector<double> ranges;
  for (const prepared_stems& map : s.maps) ranges.push_back(range_of(map));
  const auto is_near = [&](std::uint32_t m) {
    constexpr double margin = 5;  // [m] beyond all radii
    return s.placed.parts.of[m] == s.placed.parts.of[last] &&
           (adjusted.poses[m].shift - adjusted.poses[last].shift).norm() < ranges[m] + ranges[last] + margin;
  };
  const unknown_poses unknowns(s.maps.size(), [&](std::size_t m) { return m != last; });
  std::vector<double> agreement;  // of its stems
  std::vector<std::uint32_t> tree_of;
  for (int iteration = 0; iteration < iterations; ++iteration) {
    tree_of = trees_of_map(s.maps, last, adjusted.poses, radius, adjusted.trees, is_near);
    const tree_observations common = trees_in_common(adjusted.trees, last, tree_of);
    tree_adjustment adjustment(s.maps, common, {}, unknowns, deviations);
    std::vector<plan_pose> poses = adjusted.poses;
    agreement.assign(tree_of.size(), 1);
    if (!adjustment.adjust(poses)) continue;
    adjusted.poses = std::move(poses);
    const std::vector<double> of_common = adjustment.agreement();
    for (std::size_t t = 0; t < common.size(); ++t)
      agreement[common.of(t).back().stem] = of_common[common.first[t + 1] - 1];
  }
  adjusted.trees = with_further_map(adjusted.trees, last, tree_of, agreement, adjusted.agreement);
}

/// Adjusts all poses, from where they are: the last map changes others by little.
inline bool adjust_from_poses(local_survey& s, std::span<const double> deviations, const known_poses& known) {
  constexpr int iterations = 2;
  adjusted_survey& adjusted = s.adjusted;
  const unknown_poses unknowns = unknown_poses_of(s.placed, s.members, known);
  tree_adjustment adjustment(s.maps, adjusted.trees, s.links, unknowns, deviations);
  adjustment.start_from(adjusted.agreement);
  if (!adjustment.adjust(adjusted.poses, iterations)) return false;
  adjusted.weights = adjustment.weights();
  adjusted.agreement = adjustment.agreement();
  adjusted.stem_sigma = adjustment.sigma();
  adjusted.covariance = adjustment.covariances();
  return true;
}

/// The survey with a further map, the last one of `maps`; nothing where its links contradict the survey or
/// each other, or connect what was not connected, so that all links are to be solved. `before`, `now`: links
/// before the adjustment decides which ones are used.
inline std::optional<local_survey> with_last_map(const local_survey& solved,
                                                 std::span<const prepared_stems> maps,
                                                 std::span<const survey_link> before,
                                                 std::span<const survey_link> now, const known_poses& known,
                                                 const execution& exec) {
  local_survey s = solved;
  s.maps = maps;
  const auto since = take_links(s, before, now);
  if (!since || !place_last(s, *since)) return std::nullopt;
  report_progress(exec, "adjustment", 0);
  const link_graph used(maps.size(), s.links, [](const survey_link& l) { return l.used; });
  if (!since->empty()) {
    if (s.adjusted.trees.size() == 0) return std::nullopt;
    const std::vector<double> deviations = deviations_by_links(maps, s.links);
    if (s.members[s.placed.parts.of.back()].size() > 1) fit_last_to_trees(s, deviations);
    if (!adjust_from_poses(s, deviations, known)) return std::nullopt;
    if (!unconfirmed_links(s.links, maps, s.adjusted).empty()) return std::nullopt;
  }
  s.heights = find_heights(maps, s.adjusted.trees, used, s.members, known, {}, &solved.heights);
  return s;
}

}  // namespace globalmatch::detail
