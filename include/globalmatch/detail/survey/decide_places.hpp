// Maps that links do not join to the main component, or place at several places in it: decided by the trees
// of all its maps, where these distinguish the places. In: a solved survey. Out: links that are used, of
// those maps.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/position_index.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/detail/matching/matching_context.hpp"
#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "globalmatch/detail/survey/adjust_to_trees.hpp"
#include "globalmatch/detail/survey/guess_places.hpp"
#include "globalmatch/detail/survey/link_graph.hpp"
#include "globalmatch/detail/survey/link_maps.hpp"
#include "globalmatch/detail/survey/place_maps.hpp"
#include "globalmatch/detail/survey/plan_pose.hpp"
#include "globalmatch/detail/survey/proposed_places.hpp"
#include "globalmatch/detail/survey/survey_link.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::detail {

/// The trees of a component in its frame, in plan, to which maps are matched as to another map.
class tree_map {
 public:
  tree_map(const adjusted_survey& adjusted, std::span<const prepared_stems> maps, const components& parts,
           std::uint32_t part) {
    const tree_observations& trees = adjusted.trees;
    for (std::size_t t = 0; t < trees.size(); ++t) {
      if (parts.of[trees.stems[trees.first[t]].map] != part) continue;
      vec2 sum{0, 0};
      double total = 0;
      for (std::size_t i = trees.first[t]; i < trees.first[t + 1]; ++i) {
        const stem_of_map& o = trees.stems[i];
        sum += adjusted.weights[i] * (adjusted.poses[o.map] * maps[o.map].stems.at[o.stem].xy());
        total += adjusted.weights[i];
      }
      if (total > 0) at_.push_back(sum / total);
    }
  }

  /// Those within `radius` of a place.
  prepared_stems around(const vec2& center, double radius) const {
    position_set near;
    near.has_heights = false;
    for (const vec2& p : at_)
      if ((p - center).squared_norm() <= radius * radius) {
        near.original.push_back(stem_index(near.at.size()));
        near.at.push_back({p.x, p.y, 0});
      }
    return without_triangles(std::move(near), true, {});
  }

 private:
  std::vector<vec2> at_;  // [m]
};

/// log10 of the number of transforms that are expected to pair the stems of a map with trees as well as one
/// near this pose does, of unrelated ones; 0 where chance does as well, or where it ends elsewhere.
inline double score_place(const prepared_stems& map, const plan_pose& pose, const tree_map& trees) {
  constexpr double pairing_radius = 0.5;  // [m] of a pose that a link proposes
  constexpr double margin = 5;            // [m] of trees around the map
  constexpr std::size_t min_pairs = 4;
  vec2 center{0, 0};
  for (const vec3& p : map.stems.at) center += p.xy() / double(map.stems.size());
  double radius = 0;
  for (const vec3& p : map.stems.at) radius = std::max(radius, (p.xy() - center).norm());
  const prepared_stems target = trees.around(pose * center, radius + margin);
  overlap_candidate candidate;
  for (stem_index i = 0; i < map.stems.size(); ++i) {
    const vec2 at = pose * map.stems.at[i].xy();
    double nearest = std::numeric_limits<double>::infinity();
    correspondence pair{i, 0};
    target.index->for_each_within(at.x, at.y, pairing_radius, [&](stem_index tree, double squared) {
      if (squared < nearest) nearest = squared, pair.target = tree;
    });
    if (std::isfinite(nearest)) candidate.pairs.push_back(pair);
  }
  if (candidate.pairs.size() < min_pairs) return 0;
  const matching_context context(map.stems, target.stems, map.index, target.index, true,
                                 degrees_of_freedom::four);
  plantation_tries tries{1};
  const auto h =
      score_candidate(candidate, context, map, target, -std::numeric_limits<double>::infinity(), tries);
  const bool is_there = h && agree({pose, center, 0}, {plan_of(h->target_from_source), center, 0});
  return is_there ? h->log10_nfa : 0;
}

/// A map whose place the trees decide, and the links that lead there.
struct decided_map {
  std::uint32_t map;
  proposed_place moved;  ///< from where the map is in its own component
  std::vector<std::size_t> links;
};

/// Where the stems of a map fit the trees of the component `part`, significantly, and at no other place that
/// links propose half as well; nothing where there is no such place. Cost: that of a link for each of its
/// links.
inline std::optional<decided_map> decide_place(std::span<const prepared_stems> maps, const link_graph& graph,
                                               const placed_maps& placed, const adjusted_survey& adjusted,
                                               const tree_map& trees, std::uint32_t part, std::uint32_t map,
                                               double max_log10_nfa) {
  const auto leads_there = [&](const link_graph::edge& e) { return placed.parts.of[e.neighbor] == part; };
  const auto place_by = [&](const link_graph::edge& e) {
    const survey_link& l = graph.link(e);
    return proposed_place{adjusted.poses[e.neighbor] * graph.neighbor_from(map, e),
                          l.source == map ? l.center_in_source() : l.center, e.link};
  };
  double best = 0, second = 0;
  std::optional<proposed_place> chosen;
  for (const auto& e : guess_places(map, graph, adjusted.poses, leads_there)) {
    const proposed_place place = place_by(e);
    const double log10_nfa = score_place(maps[map], place.pose, trees);
    if (log10_nfa < best)
      second = best, best = log10_nfa, chosen = place;
    else
      second = std::min(second, log10_nfa);
  }
  if (!chosen || best > max_log10_nfa || 2 * second < best) return std::nullopt;
  const plan_pose& own = adjusted.poses[map];
  decided_map decided{map, {chosen->pose * own.inverse(), own * chosen->center, 0}, {}};
  for (const auto& e : graph.of(map))
    if (leads_there(e) && agree(*chosen, place_by(e))) decided.links.push_back(e.link);
  return decided;
}

/// Leaves of the maps of each component those that agree where it is; none where most do not.
inline void keep_agreeing(std::vector<decided_map>& decided, const components& parts) {
  std::vector<std::vector<proposed_place>> of_part(parts.count());
  for (const decided_map& d : decided) of_part[parts.of[d.map]].push_back(d.moved);
  std::erase_if(decided, [&](const decided_map& d) {
    const auto& places = of_part[parts.of[d.map]];
    const auto count = std::count_if(places.begin(), places.end(),
                                     [&](const proposed_place& other) { return agree(d.moved, other); });
    return 2 * std::size_t(count) <= places.size();
  });
}

/// Links of maps outside the component `part` by which their stems fit its trees, and that agree where it has
/// the components of these maps. `max_log10_nfa`: that of a link.
inline std::vector<std::size_t> decide_places(std::span<const prepared_stems> maps,
                                              std::span<const survey_link> links, const placed_maps& placed,
                                              const adjusted_survey& adjusted, std::uint32_t part,
                                              double max_log10_nfa) {
  const link_graph graph(maps.size(), links, [](const survey_link&) { return true; });
  const tree_map trees(adjusted, maps, placed.parts, part);
  std::vector<decided_map> decided;
  for (std::uint32_t m = 0; m < maps.size(); ++m) {
    if (placed.parts.of[m] == part || graph.of(m).empty()) continue;
    poll_cancelled();
    if (auto found = decide_place(maps, graph, placed, adjusted, trees, part, m, max_log10_nfa))
      decided.push_back(std::move(*found));
  }
  keep_agreeing(decided, placed.parts);
  std::vector<std::size_t> all;
  for (const decided_map& d : decided) all.insert(all.end(), d.links.begin(), d.links.end());
  return all;
}

}  // namespace globalmatch::detail
