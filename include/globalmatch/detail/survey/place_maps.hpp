// Placing the maps of a survey: adjusted to their links, those left out that their links place at several
// places.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/survey/adjust_links.hpp"
#include "globalmatch/detail/survey/initial_poses.hpp"
#include "globalmatch/detail/survey/known_poses.hpp"
#include "globalmatch/detail/survey/link_graph.hpp"
#include "globalmatch/detail/survey/plan_pose.hpp"
#include "globalmatch/detail/survey/proposed_places.hpp"
#include "globalmatch/detail/survey/survey_link.hpp"

namespace globalmatch::detail {

struct placed_maps {
  std::vector<plan_pose> poses;         ///< in the frame of the reference of its component
  components parts;                     ///< ambiguous maps are components of their own
  std::vector<std::uint8_t> ambiguous;  ///< maps that their links place at several places
  std::vector<std::uint8_t> tried;      ///< links that were in use at first
};

/// The links of some maps to others: those that are used, and of the rest the most that agree where they
/// place these maps.
struct link_counts {
  std::size_t agreeing = 0, elsewhere = 0;
  bool is_supported = false;  ///< one of those used, by a cycle
};

/// `is_inside(map)` of the `maps`, whose links to each other do not count. `taken`: links that were used
/// before the adjustment.
template <class IsInside>
link_counts count_links_of(std::span<const std::uint32_t> maps, const IsInside& is_inside,
                           const link_graph& taken, std::span<const plan_pose> poses) {
  link_counts counts;
  std::vector<proposed_place> places;
  for (const std::uint32_t m : maps)
    for (const auto& e : taken.of(m)) {
      if (is_inside(e.neighbor)) continue;
      const survey_link& l = taken.link(e);
      if (l.used) {
        ++counts.agreeing;
        counts.is_supported = counts.is_supported || l.supporting_cycles > 0;
        continue;
      }
      const plan_pose placed = poses[e.neighbor] * taken.neighbor_from(m, e);
      places.push_back({placed * poses[m].inverse(),
                        poses[m] * (l.source == m ? l.center_in_source() : l.center), e.link});
    }
  counts.elsewhere = max_agreement(places).count;
  return counts;
}

/// Whether links elsewhere are too many beside those that agree with the pose: half as many, and more than
/// one, or one against one that no cycle supports.
inline bool is_ambiguous(const link_counts& c) {
  if (c.elsewhere == 0) return false;
  return 2 * c.elsewhere >= c.agreeing && (c.elsewhere > 1 || (c.agreeing <= 1 && !c.is_supported));
}

/// Takes all links of maps that are ambiguous out of use, marks these, and says whether there are any.
inline bool leave_out_ambiguous(const link_graph& taken, std::span<const plan_pose> poses,
                                std::vector<survey_link>& links, std::vector<std::uint8_t>& ambiguous) {
  std::vector<std::uint32_t> found;
  for (std::uint32_t m = 0; m < taken.size(); ++m) {
    const auto is_inside = [m](std::uint32_t other) { return other == m; };
    if (is_ambiguous(count_links_of({&m, 1}, is_inside, taken, poses))) found.push_back(m);
  }
  for (const std::uint32_t m : found) ambiguous[m] = true;
  for (survey_link& l : links)
    if (ambiguous[l.source] || ambiguous[l.target]) l.used = false;
  return !found.empty();
}

/// Maps that links with cycles hold together may hang on the others by one that is wrong: where their links
/// to others place them at several places these are taken out of use, and they become a component.
inline void separate_ambiguous_clusters(const link_graph& taken, std::span<const plan_pose> poses,
                                        const components& parts, std::vector<survey_link>& links) {
  map_clusters clusters(taken.size());
  for (const survey_link& l : links)
    if (l.used && l.supporting_cycles > 0) clusters.merge_by(l);
  std::vector<std::uint8_t> separate(taken.size());
  for (std::uint32_t c = 0; c < taken.size(); ++c) {
    const auto& members = clusters.members(c);
    if (members.size() < 2 || clusters.of(parts.reference[parts.of[members[0]]]) == c) continue;
    const auto is_inside = [&](std::uint32_t m) { return clusters.of(m) == c; };
    separate[c] = is_ambiguous(count_links_of(members, is_inside, taken, poses));
  }
  for (survey_link& l : links) {
    const std::uint32_t s = clusters.of(l.source), t = clusters.of(l.target);
    if (s != t && (separate[s] || separate[t])) l.used = false;
  }
}

/// Places the maps by the links that are used, and takes those of ambiguous maps, and those that do not
/// agree, out of use: until no component falls apart. Fixed maps stay where they are known to be; one whose
/// links contradict that is ambiguous, or alone.
inline placed_maps place_maps(std::vector<survey_link>& links, std::size_t maps, const known_poses& known) {
  placed_maps result;
  result.ambiguous.resize(maps);
  for (const survey_link& l : links) result.tried.push_back(l.used);
  while (true) {
    poll_cancelled();
    std::vector<std::uint8_t> is_taken;
    for (const survey_link& l : links) is_taken.push_back(l.used);
    const link_graph taken(
        maps, links, [&](const survey_link& l) { return is_taken[std::size_t(&l - links.data())] != 0; });
    components parts = find_components(taken, known);
    if (parts.count() == result.parts.count()) return result;
    result.parts = std::move(parts);
    result.poses = initial_poses(links, result.parts);
    const auto reference_of = [&](std::size_t m) { return result.parts.reference[result.parts.of[m]]; };
    for (std::size_t m = 0; m < maps; ++m)
      if (known.is_fixed(m)) result.poses[m] = plan_of(known.transform_beside(reference_of(m), m));
    const unknown_poses unknowns(maps,
                                 [&](std::size_t m) { return reference_of(m) == m || known.is_fixed(m); });
    if (adjust_links(result.poses, unknowns, links)) {
      if (!leave_out_ambiguous(taken, result.poses, links, result.ambiguous))
        separate_ambiguous_clusters(taken, result.poses, result.parts, links);
    } else {
      for (survey_link& l : links) l.used = false;
    }
  }
}

}  // namespace globalmatch::detail
