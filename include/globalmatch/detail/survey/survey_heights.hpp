// Heights of the maps of a survey, once they are placed in plan: from the heights of the trees and targets
// that they have in common.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "globalmatch/detail/survey/adjust_links.hpp"
#include "globalmatch/detail/survey/height_adjustment.hpp"
#include "globalmatch/detail/survey/known_poses.hpp"
#include "globalmatch/detail/survey/link_graph.hpp"
#include "globalmatch/detail/survey/survey_link.hpp"
#include "globalmatch/detail/survey/survey_targets.hpp"
#include "globalmatch/detail/survey/survey_trees.hpp"

namespace globalmatch::detail {

/// Maps that say something of heights: by their stems above ground, or by targets that others show as well.
inline std::vector<std::uint8_t> maps_with_heights(std::span<const prepared_stems> maps,
                                                   const target_observations& targets) {
  std::vector<std::uint8_t> has_heights;
  for (const prepared_stems& map : maps) has_heights.push_back(map.stems.has_heights);
  for (std::size_t t = 0; t < targets.size(); ++t)
    if (targets.of(t).size() > 1)
      for (const target_of_map& o : targets.of(t)) has_heights[o.map] = true;
  return has_heights;
}

/// The maps of each component that the heights of others refer to: fixed ones that have any, else the first
/// one whose stems have, or that has any, or the first one. `members`: the maps of each, the reference first.
inline std::vector<std::uint32_t> height_datums(std::span<const prepared_stems> maps,
                                                std::span<const std::uint8_t> has_heights,
                                                const std::vector<std::vector<std::uint32_t>>& members,
                                                const known_poses& known) {
  std::vector<std::uint32_t> datums;
  for (const auto& of_component : members) {
    const std::size_t before = datums.size();
    for (const std::uint32_t m : of_component)
      if (known.is_fixed(m) && has_heights[m]) datums.push_back(m);
    if (datums.size() > before) continue;
    auto first = std::find_if(of_component.begin(), of_component.end(),
                              [&](std::uint32_t m) { return maps[m].stems.has_heights; });
    if (first == of_component.end())
      first = std::find_if(of_component.begin(), of_component.end(),
                           [&](std::uint32_t m) { return has_heights[m] != 0; });
    datums.push_back(first == of_component.end() ? of_component.front() : *first);
  }
  return datums;
}

/// Heights along the links that are used, by the median of the paired stems, or by targets: from the maps in
/// `open` on, whose heights are known.
inline void heights_along_links(std::span<const prepared_stems> maps, const link_graph& graph,
                                std::vector<std::uint32_t>& open, survey_heights& heights) {
  while (!open.empty()) {
    std::vector<std::uint32_t> reached;
    for (const std::uint32_t m : open)
      for (const auto& e : graph.of(m)) {
        const survey_link& l = graph.link(e);
        const bool by_stems = maps[m].stems.has_heights && maps[e.neighbor].stems.has_heights;
        if (heights.known[e.neighbor] || !(by_stems || l.is_of_targets())) continue;
        const double raise = raise_of(maps, l);
        heights.of_map[e.neighbor] = heights.of_map[m] + (l.source == m ? -raise : raise);
        heights.known[e.neighbor] = true;
        reached.push_back(e.neighbor);
      }
    open = std::move(reached);
  }
}

/// The height of a map by the median of the targets that it shows beside maps whose heights are known, and
/// the map in `open`; false where there is none.
inline bool next_height_by_targets(const target_observations& targets, std::vector<std::uint32_t>& open,
                                   survey_heights& heights) {
  std::vector<std::pair<std::uint32_t, double>> raises;  // of maps
  for (std::size_t t = 0; t < targets.size(); ++t)
    for (const target_of_map& known : targets.of(t))
      for (const target_of_map& other : targets.of(t))
        if (heights.known[known.map] && !heights.known[other.map])
          raises.emplace_back(other.map, heights.of_map[known.map] + known.at.z - other.at.z);
  if (raises.empty()) return false;
  const std::uint32_t map = std::min_element(raises.begin(), raises.end())->first;
  std::vector<double> of_map;
  for (const auto& [m, raise] : raises)
    if (m == map) of_map.push_back(raise);
  heights.of_map[map] = median(of_map);
  heights.known[map] = true;
  open.assign(1, map);
  return true;
}

/// Raises the last map to the trees that others show, whose heights are held.
inline void fit_last_height(std::span<const prepared_stems> maps, const tree_observations& trees,
                            const survey_heights& heights, double& of_last, int max_iterations) {
  const std::size_t last = maps.size() - 1;
  tree_observations own;
  for (std::size_t t = 0; t < trees.size(); ++t) {
    if (trees.of(t).back().map != last) continue;  // it was added last
    own.stems.insert(own.stems.end(), trees.of(t).begin(), trees.of(t).end());
    own.first.push_back(own.stems.size());
  }
  survey_heights fitted = heights;
  const unknown_poses unknowns(maps.size(), [&](std::size_t m) { return m != last || !heights.known[m]; });
  if (height_adjustment(maps, own, {}, unknowns, fitted).adjust(max_iterations))
    of_last = fitted.of_map[last];
}

/// Takes over heights that were known before, and adds their maps to `open`.
inline void take_heights(const survey_heights& before, survey_heights& heights,
                         std::vector<std::uint32_t>& open) {
  for (std::uint32_t m = 0; m < before.of_map.size(); ++m) {
    if (heights.known[m] || !before.known[m]) continue;
    heights.of_map[m] = before.of_map[m];
    heights.known[m] = true;
    open.push_back(m);
  }
}

/// The heights of maps, and what is known of them. Unknown ones are guesses. `members`: the maps of each
/// component, the reference first; `targets`: each of maps of one component. `before`: heights of all maps
/// but the last one, which are soon adjusted to it.
inline survey_heights find_heights(std::span<const prepared_stems> maps, const tree_observations& trees,
                                   const link_graph& used,
                                   const std::vector<std::vector<std::uint32_t>>& members,
                                   const known_poses& known = {}, const target_observations& targets = {},
                                   const survey_heights* before = nullptr) {
  constexpr int max_iterations = 10, max_further_iterations = 1;
  const std::vector<std::uint8_t> has_heights = maps_with_heights(maps, targets);
  const std::vector<std::uint32_t> datums = height_datums(maps, has_heights, members, known);
  survey_heights heights;
  heights.of_map.assign(maps.size(), 0);
  heights.sigma.assign(maps.size(), 0);
  heights.known.assign(maps.size(), 0);
  for (const auto& of_component : members)
    for (const std::uint32_t m : of_component)
      if (known.is_fixed(m))
        heights.of_map[m] = known.transform_beside(of_component.front(), m).translation.z;
  std::vector<std::uint32_t> open;
  for (const std::uint32_t m : datums)
    if (has_heights[m]) heights.known[m] = true, open.push_back(m);
  if (before) take_heights(*before, heights, open);
  do {
    heights_along_links(maps, used, open, heights);
  } while (next_height_by_targets(targets, open, heights));
  std::vector<std::uint8_t> is_datum(maps.size());
  for (const std::uint32_t m : datums) is_datum[m] = true;
  if (before && !is_datum[maps.size() - 1])
    fit_last_height(maps, trees, heights, heights.of_map.back(), max_iterations);
  while (true) {  // with ever fewer heights that are known
    const unknown_poses unknowns(maps.size(),
                                 [&](std::size_t m) { return is_datum[m] || !heights.known[m]; });
    if (height_adjustment(maps, trees, targets, unknowns, heights)
            .adjust(before ? max_further_iterations : max_iterations))
      return heights;
  }
}

}  // namespace globalmatch::detail
