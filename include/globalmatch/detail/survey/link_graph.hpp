// The graph of a survey: which links support each other, and what they connect.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/keyed_sort.hpp"
#include "globalmatch/detail/survey/known_poses.hpp"
#include "globalmatch/detail/survey/plan_pose.hpp"
#include "globalmatch/detail/survey/survey_link.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/points.hpp"

namespace globalmatch::detail {

/// The links of each map, those with lower neighbors first. Two maps may have one by stems and one by
/// targets. Refers to the links.
class link_graph {
 public:
  struct edge {
    std::uint32_t neighbor, link;
  };

  /// Only links that `takes(link)`.
  template <class Takes>
  link_graph(std::size_t maps, std::span<const survey_link> links, const Takes& takes)
      : links_(links), edges_(maps) {
    for (std::uint32_t l = 0; l < links.size(); ++l) {
      if (!takes(links[l])) continue;
      edges_[links[l].source].push_back({links[l].target, l});
      edges_[links[l].target].push_back({links[l].source, l});
    }
    for (auto& of_map : edges_)
      std::sort(of_map.begin(), of_map.end(), [](const edge& a, const edge& b) {
        return key_of(a.neighbor, a.link) < key_of(b.neighbor, b.link);
      });
  }

  std::size_t size() const { return edges_.size(); }
  std::span<const edge> of(std::size_t map) const { return edges_[map]; }
  const survey_link& link(const edge& e) const { return links_[e.link]; }

  /// Where a map is in the frame of its neighbor.
  plan_pose neighbor_from(std::uint32_t map, const edge& e) const {
    const survey_link& l = links_[e.link];
    return l.source == map ? l.target_from_source : l.target_from_source.inverse();
  }

  /// Calls `visit(first, second)` for the edges from `a` and from `b` that lead to one map.
  template <class Visit>
  void for_each_common_neighbor(std::uint32_t a, std::uint32_t b, const Visit& visit) const {
    const auto &of_a = edges_[a], &of_b = edges_[b];
    for (std::size_t i = 0, j = 0; i < of_a.size() && j < of_b.size();) {
      if (of_a[i].neighbor < of_b[j].neighbor)
        ++i;
      else if (of_b[j].neighbor < of_a[i].neighbor)
        ++j;
      else {
        const std::uint32_t common = of_a[i].neighbor;
        const std::size_t first = j;
        for (; i < of_a.size() && of_a[i].neighbor == common; ++i)
          for (j = first; j < of_b.size() && of_b[j].neighbor == common; ++j) visit(of_a[i], of_b[j]);
      }
    }
  }

 private:
  std::span<const survey_link> links_;
  std::vector<std::vector<edge>> edges_;
};

/// Variance [m^2] of where a link places what is `arm` [m] from its center, along both axes together.
inline double variance_at(const survey_link& link, double arm) {
  return link.covariance(0, 0) + link.covariance(1, 1) + link.covariance(2, 2) * arm * arm;
}

/// How far link `l` and the two others of a cycle of three place the center of `l` apart.
struct cycle_closure {
  vec2 by_link, by_others;  ///< [m] in the third map
  double turn = 0;          ///< [rad]

  cycle_closure(const link_graph& graph, const survey_link& l, const link_graph::edge& of_source,
                const link_graph::edge& of_target) {
    const plan_pose third_from_source = graph.neighbor_from(l.source, of_source),
                    third_from_target = graph.neighbor_from(l.target, of_target);
    by_link = third_from_target * l.center;
    by_others = third_from_source * l.center_in_source();
    turn = wrapped(third_from_target.yaw + l.target_from_source.yaw - third_from_source.yaw);
  }
  double distance() const { return (by_link - by_others).norm(); }
};

/// Whether link `l` and the two others of a cycle of three agree where they place the center of `l`: within
/// four standard deviations, and what these leave out of account.
inline bool is_closed(const link_graph& graph, const survey_link& l, const link_graph::edge& of_source,
                      const link_graph::edge& of_target) {
  constexpr double deviations = 4, shift_floor = 0.05, yaw_floor = 0.005;  // [m] [rad]
  const cycle_closure closure(graph, l, of_source, of_target);
  double variance = shift_floor * shift_floor + variance_at(l, 0), yaw_variance = yaw_floor * yaw_floor;
  const auto center_in_third = [&](const link_graph::edge& e) {
    const survey_link& other = graph.link(e);
    return other.target == e.neighbor ? other.center : other.center_in_source();
  };
  variance += variance_at(graph.link(of_source), (center_in_third(of_source) - closure.by_others).norm());
  variance += variance_at(graph.link(of_target), (center_in_third(of_target) - closure.by_link).norm());
  for (const survey_link* of : {&l, &graph.link(of_source), &graph.link(of_target)})
    yaw_variance += of->covariance(2, 2);
  return closure.distance() < deviations * std::sqrt(variance) &&
         closure.turn * closure.turn < deviations * deviations * yaw_variance;
}

/// Share of the pairs of a link whose stems, in the map that both have in common, the other does not pair.
inline double share_without(const survey_link& l, const survey_link& other) {
  if (l.correspondences.empty()) return 1;
  const bool by_source = l.source == other.source || l.source == other.target;
  const std::uint32_t common = by_source ? l.source : l.target;
  std::size_t own = 0;
  for (const correspondence& c : l.correspondences) {
    const stem_index stem = by_source ? c.source : c.target;
    own += std::none_of(
        other.correspondences.begin(), other.correspondences.end(),
        [&](const correspondence& o) { return (other.source == common ? o.source : o.target) == stem; });
  }
  return double(own) / double(l.correspondences.size());
}

/// The log10 NFA of links of one cycle together. Stems that two of them pair count once: scans of the same
/// trees resemble an unrelated one alike.
inline double log10_nfa_together(std::span<const survey_link*> links) {
  std::sort(links.begin(), links.end(), [](const survey_link* a, const survey_link* b) {
    return a->log10_nfa != b->log10_nfa ? a->log10_nfa < b->log10_nfa : a < b;
  });
  double sum = 0;
  for (std::size_t i = 0; i < links.size(); ++i) {
    double share = 1;
    for (std::size_t k = 0; k < i; ++k) share *= share_without(*links[i], *links[k]);
    sum += share * links[i]->log10_nfa;
  }
  return sum;
}

/// Counts the cycles of three links that close, for each link. `max_log10_nfa`: a link that is less
/// significant needs a cycle whose links that are not significant are so together. Links without are not used
/// any more.
inline void use_supported_links(std::vector<survey_link>& links, std::size_t maps, double max_log10_nfa) {
  const link_graph graph(maps, links, [](const survey_link&) { return true; });
  std::vector<std::uint8_t> used(links.size());
  std::vector<std::size_t> cycles(links.size());
  for (std::size_t i = 0; i < links.size(); ++i) {
    const survey_link& own = links[i];
    used[i] = own.log10_nfa <= max_log10_nfa;
    graph.for_each_common_neighbor(own.source, own.target, [&](const auto& s, const auto& t) {
      if (!is_closed(graph, own, s, t)) return;
      std::array<const survey_link*, 3> weak;
      std::size_t count = 0;
      for (const survey_link* l : {&own, &graph.link(s), &graph.link(t)})
        if (l->log10_nfa > max_log10_nfa) weak[count++] = l;
      if (count > 1 && log10_nfa_together(std::span(weak).first(count)) > max_log10_nfa) return;
      ++cycles[i];
      used[i] = true;
    });
  }
  for (std::size_t i = 0; i < links.size(); ++i) {
    links[i].used = used[i] != 0;
    links[i].supporting_cycles = cycles[i];
  }
}

/// Components of maps by links that are used.
struct components {
  std::vector<std::uint32_t> of;         ///< each map
  std::vector<std::uint32_t> reference;  ///< the map of most links of each component
  std::size_t count() const { return reference.size(); }
};

/// Numbered by the lowest of their maps. The reference of each is a fixed map, or the preferred one, or else
/// one of most links.
inline components find_components(const link_graph& graph, const known_poses& known) {
  constexpr std::uint32_t none = ~std::uint32_t(0);
  components found;
  found.of.assign(graph.size(), none);
  std::vector<std::uint32_t> open;
  for (std::uint32_t first = 0; first < graph.size(); ++first) {
    if (found.of[first] != none) continue;
    const auto number = std::uint32_t(found.count());
    found.reference.push_back(first);
    found.of[first] = number;
    open.assign(1, first);
    while (!open.empty()) {
      const std::uint32_t m = open.back();
      open.pop_back();
      std::uint32_t& reference = found.reference.back();
      const auto rank = [&](std::uint32_t map) { return std::pair(known.rank(map), graph.of(map).size()); };
      if (rank(m) > rank(reference) || (rank(m) == rank(reference) && m < reference)) reference = m;
      for (const auto& e : graph.of(m))
        if (found.of[e.neighbor] == none) found.of[e.neighbor] = number, open.push_back(e.neighbor);
    }
  }
  return found;
}

}  // namespace globalmatch::detail
