// Where a map may be that was not placed: guesses by its links to maps that were.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "globalmatch/detail/survey/link_graph.hpp"
#include "globalmatch/detail/survey/plan_pose.hpp"
#include "globalmatch/detail/survey/proposed_places.hpp"
#include "globalmatch/detail/survey/survey_link.hpp"

namespace globalmatch::detail {

/// The edges of a map that place it, one a place: those first that most others agree with, of as many the
/// most significant one. `counts(edge)`: whether the link counts, and its other map was placed.
template <class Counts>
std::vector<link_graph::edge> guess_places(std::uint32_t map, const link_graph& graph,
                                           std::span<const plan_pose> poses, const Counts& counts) {
  std::vector<link_graph::edge> edges, chosen;
  for (const auto& e : graph.of(map))
    if (counts(e)) edges.push_back(e);
  std::stable_sort(edges.begin(), edges.end(), [&](const auto& a, const auto& b) {
    return graph.link(a).log10_nfa < graph.link(b).log10_nfa;
  });
  std::vector<proposed_place> places;
  for (std::uint32_t i = 0; i < edges.size(); ++i) {
    const survey_link& l = graph.link(edges[i]);
    places.push_back({poses[edges[i].neighbor] * graph.neighbor_from(map, edges[i]),
                      l.source == map ? l.center_in_source() : l.center, i});
  }
  while (!places.empty()) {
    const proposed_place best = places[max_agreement(places).one];
    chosen.push_back(edges[best.link]);
    std::erase_if(places, [&](const proposed_place& p) { return agree(best, p); });
  }
  return chosen;
}

}  // namespace globalmatch::detail
