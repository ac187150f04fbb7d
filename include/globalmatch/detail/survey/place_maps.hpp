// Placing the maps of a survey: adjusted to their links, those left out that their links place at several
// places.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/survey/adjust_links.hpp"
#include "globalmatch/detail/survey/link_graph.hpp"
#include "globalmatch/detail/survey/plan_pose.hpp"
#include "globalmatch/detail/survey/survey_link.hpp"

namespace globalmatch::detail {

struct placed_maps {
  std::vector<plan_pose> poses;  ///< in the frame of the reference of its component
  components parts;              ///< ambiguous maps are components of their own
  /// Where links place a map that do not agree with its pose; not empty where that is ambiguous.
  std::vector<std::vector<plan_pose>> elsewhere;
};

/// The largest group of links that were taken, but not used in the end, and that agree where they place a
/// map; its size, and where.
inline std::pair<std::size_t, plan_pose> place_elsewhere(std::uint32_t map, const link_graph& taken,
                                                         std::span<const plan_pose> poses) {
  constexpr double same_place = 1, same_yaw = 0.05;  // [m] [rad] no two places of a map are so near
  std::vector<plan_pose> places;
  std::vector<vec2> centers;
  for (const auto& e : taken.of(map)) {
    const survey_link& l = taken.link(e);
    if (l.used) continue;
    places.push_back(poses[e.neighbor] * taken.neighbor_from(map, e));
    centers.push_back(l.source == map ? l.center_in_source() : l.center);
  }
  std::size_t most = 0, best = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    std::size_t agreeing = 0;
    for (const plan_pose& other : places)
      agreeing += (other * centers[i] - places[i] * centers[i]).norm() < same_place &&
                  std::abs(wrapped(other.yaw - places[i].yaw)) < same_yaw;
    if (agreeing > most) most = agreeing, best = i;
  }
  return {most, most == 0 ? plan_pose{} : places[best]};
}

/// Whether links elsewhere are too many beside those that agree with the pose: half as many, and more than
/// one, or one against one that no cycle supports.
inline bool is_ambiguous(std::size_t agreeing, std::size_t elsewhere, bool is_supported) {
  if (elsewhere == 0) return false;
  return 2 * elsewhere >= agreeing && (elsewhere > 1 || (agreeing <= 1 && !is_supported));
}

/// Places the maps by the links that are used, and takes those of ambiguous maps, and those that do not
/// agree, out of use. `preferred`: a map whose frame is that of its component.
inline placed_maps place_maps(std::vector<survey_link>& links, std::size_t maps, std::size_t preferred) {
  constexpr int max_iterations = 8;
  placed_maps result;
  result.elsewhere.resize(maps);
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    std::vector<std::uint8_t> taken(links.size());
    for (std::size_t l = 0; l < links.size(); ++l) taken[l] = links[l].used;
    const auto is_taken = [&](const survey_link& l) { return taken[std::size_t(&l - links.data())] != 0; };
    const link_graph graph(maps, links, is_taken);
    result.parts = find_components(graph, preferred);
    result.poses = poses_by_spanning_tree(links, maps, result.parts);
    const unknown_poses unknowns(
        maps, [&](std::size_t m) { return result.parts.reference[result.parts.of[m]] == m; });
    adjust_links(result.poses, unknowns, links);
    bool changed = false;
    std::vector<std::uint8_t> ambiguous(maps);
    for (std::uint32_t m = 0; m < maps; ++m) {
      std::size_t agreeing = 0;
      bool is_supported = false;
      for (const auto& e : graph.of(m))
        if (const survey_link& l = graph.link(e); l.used)
          ++agreeing, is_supported = is_supported || l.supporting_cycles > 0;
      const auto [count, place] = place_elsewhere(m, graph, result.poses);
      if (m == preferred || !is_ambiguous(agreeing, count, is_supported)) continue;
      result.elsewhere[m].assign(1, place);
      ambiguous[m] = changed = true;
    }
    for (survey_link& l : links)
      if (ambiguous[l.source] || ambiguous[l.target]) l.used = false;
    const link_graph agreeing(maps, links, [](const survey_link& l) { return l.used; });
    changed = changed || find_components(agreeing, preferred).count() != result.parts.count();
    if (!changed) break;
  }
  return result;
}

}  // namespace globalmatch::detail
