// Where the maps of a survey are at first. In: links, of which some are wrong. Out: poses that most links
// agree with, from which an adjustment converges.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/keyed_sort.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/survey/link_graph.hpp"
#include "globalmatch/detail/survey/plan_pose.hpp"
#include "globalmatch/detail/survey/proposed_places.hpp"
#include "globalmatch/detail/survey/survey_link.hpp"

namespace globalmatch::detail {

/// Maps that are placed beside each other, each cluster in a frame of its own.
class map_clusters {
 public:
  explicit map_clusters(std::size_t maps) : of_(maps), members_(maps), poses_(maps) {
    for (std::uint32_t m = 0; m < maps; ++m) of_[m] = m, members_[m] = {m};
  }

  std::uint32_t of(std::size_t map) const { return of_[map]; }
  const plan_pose& pose(std::size_t map) const { return poses_[map]; }
  const std::vector<std::uint32_t>& members(std::size_t cluster) const { return members_[cluster]; }

  /// Where the link places the cluster of its source in that of its target.
  plan_pose target_from_source(const survey_link& l) const {
    return poses_[l.target] * l.target_from_source * poses_[l.source].inverse();
  }

  /// Joins two clusters as the link says; does nothing where they are one.
  void merge_by(const survey_link& l) {
    std::uint32_t into = of_[l.target], from = of_[l.source];
    if (into == from) return;
    plan_pose into_from = target_from_source(l);
    if (members_[into].size() < members_[from].size()) std::swap(into, from), into_from = into_from.inverse();
    for (const std::uint32_t m : members_[from]) {
      of_[m] = into;
      poses_[m] = into_from * poses_[m];
      members_[into].push_back(m);
    }
    members_[from].clear();
  }

 private:
  std::vector<std::uint32_t> of_;
  std::vector<std::vector<std::uint32_t>> members_;
  std::vector<plan_pose> poses_;
};

/// The links that are used between different clusters: those of two clusters behind each other, of these the
/// ones of most cycles and the most significant ones first.
inline std::vector<std::uint32_t> links_between(std::span<const survey_link> links,
                                                const map_clusters& clusters) {
  const auto pair_of = [&](const survey_link& l) {
    const std::uint32_t s = clusters.of(l.source), t = clusters.of(l.target);
    return key_of(std::min(s, t), std::max(s, t));
  };
  std::vector<std::uint32_t> between;
  for (std::uint32_t l = 0; l < links.size(); ++l)
    if (links[l].used && clusters.of(links[l].source) != clusters.of(links[l].target)) between.push_back(l);
  std::sort(between.begin(), between.end(), [&](std::uint32_t i, std::uint32_t k) {
    const survey_link &a = links[i], &b = links[k];
    if (pair_of(a) != pair_of(b)) return pair_of(a) < pair_of(b);
    if (a.supporting_cycles != b.supporting_cycles) return a.supporting_cycles > b.supporting_cycles;
    return a.log10_nfa != b.log10_nfa ? a.log10_nfa < b.log10_nfa : i < k;
  });
  return between;
}

/// A link between two clusters on which `agreeing` of their links agree.
struct joining_link {
  std::size_t agreeing = 0;
  std::uint32_t link = 0;
  std::uint32_t smaller = 0, larger = 0;  ///< the clusters
};

/// Counts links that have no map in common: all those of one map are as wrong as it is placed.
class disjoint_links {
 public:
  disjoint_links(std::span<const survey_link> links, std::size_t maps) : links_(links), taken_by_(maps) {}

  /// Whether no link that was counted for this `number` shares a map with it.
  bool add(std::size_t number, std::uint32_t link) {
    const survey_link& l = links_[link];
    const auto is_taken = [&](std::uint32_t m) { return taken_by_[m] == offset_ + number + 1; };
    if (is_taken(l.source) || is_taken(l.target)) return false;
    taken_by_[l.source] = taken_by_[l.target] = offset_ + number + 1;
    return true;
  }
  /// Numbers up to `count` stand for something else from now on.
  void forget(std::size_t count) { offset_ += count + 1; }

 private:
  std::span<const survey_link> links_;
  std::vector<std::size_t> taken_by_;  // each map
  std::size_t offset_ = 0;
};

/// Of each two clusters the link on which most agree, of several maps those that have no map in common.
inline std::vector<joining_link> joining_links(std::span<const survey_link> links,
                                               const map_clusters& clusters, std::size_t maps) {
  const std::vector<std::uint32_t> between = links_between(links, clusters);
  const auto low = [&](const survey_link& l) {
    return std::min(clusters.of(l.source), clusters.of(l.target));
  };
  const auto high = [&](const survey_link& l) {
    return std::max(clusters.of(l.source), clusters.of(l.target));
  };
  std::vector<proposed_place> places;
  std::vector<joining_link> best;
  disjoint_links disjoint(links, maps);
  for (std::size_t begin = 0, end = 0; begin < between.size(); begin = end) {
    const survey_link& first = links[between[begin]];
    places.clear();
    for (; end < between.size(); ++end) {
      const survey_link& l = links[between[end]];
      if (low(l) != low(first) || high(l) != high(first)) break;
      const bool is_low = clusters.of(l.source) == low(l);
      const plan_pose pose = clusters.target_from_source(l);
      places.push_back(
          {is_low ? pose : pose.inverse(),
           is_low ? clusters.pose(l.source) * l.center_in_source() : clusters.pose(l.target) * l.center,
           between[end]});
    }
    std::uint32_t smaller = low(first), larger = high(first);
    if (clusters.members(larger).size() < clusters.members(smaller).size()) std::swap(smaller, larger);
    const bool is_one = clusters.members(smaller).size() == 1;
    const agreeing_places found =
        is_one ? max_agreement(places)
               : max_agreement(places, [&](std::size_t i, const proposed_place& other) {
                   return disjoint.add(i, other.link);
                 });
    disjoint.forget(places.size());
    best.push_back({found.count, places[found.one].link, smaller, larger});
  }
  return best;
}

/// Leaves those on which nearly as many agree as on any, where these are single links those with cycles; the
/// best ones first.
inline void keep_most_agreeing(std::vector<joining_link>& joining, std::span<const survey_link> links) {
  std::sort(joining.begin(), joining.end(), [&](const joining_link& a, const joining_link& b) {
    const survey_link &of_a = links[a.link], &of_b = links[b.link];
    if (a.agreeing != b.agreeing) return a.agreeing > b.agreeing;
    if (of_a.supporting_cycles != of_b.supporting_cycles)
      return of_a.supporting_cycles > of_b.supporting_cycles;
    return of_a.log10_nfa != of_b.log10_nfa ? of_a.log10_nfa < of_b.log10_nfa : a.link < b.link;
  });
  if (joining.empty()) return;
  const joining_link best = joining[0];
  const bool with_cycles = best.agreeing == 1 && links[best.link].supporting_cycles > 0;
  std::erase_if(joining, [&](const joining_link& j) {
    return 2 * j.agreeing <= best.agreeing || (with_cycles && links[j.link].supporting_cycles == 0);
  });
}

/// Poses of the maps of each component, in the frame of its reference: clusters grow by the links on which
/// most others between them agree, so that what one wrong link places has no say.
inline std::vector<plan_pose> initial_poses(std::span<const survey_link> links, const components& parts) {
  const std::size_t maps = parts.of.size();
  map_clusters clusters(maps);
  while (true) {
    poll_cancelled();
    std::vector<joining_link> joining = joining_links(links, clusters, maps);
    if (joining.empty()) break;
    keep_most_agreeing(joining, links);
    std::vector<std::uint8_t> merged(maps);  // clusters whose links are to be counted again first
    for (const joining_link& j : joining) {
      if (merged[j.smaller] || (j.agreeing == 1 && merged[j.larger])) continue;
      clusters.merge_by(links[j.link]);
      merged[j.smaller] = merged[j.larger] = true;
    }
  }
  std::vector<plan_pose> poses(maps);
  for (std::size_t m = 0; m < maps; ++m)
    poses[m] = clusters.pose(parts.reference[parts.of[m]]).inverse() * clusters.pose(m);
  for (const std::uint32_t m : parts.reference) poses[m] = {};
  return poses;
}

}  // namespace globalmatch::detail
