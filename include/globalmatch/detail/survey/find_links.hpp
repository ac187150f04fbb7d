// The links of all maps of a survey. In: maps. Out: pairs of them whose stems agree, those that are
// significant or that cycles support in use.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/keyed_sort.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "globalmatch/detail/survey/link_graph.hpp"
#include "globalmatch/detail/survey/link_maps.hpp"
#include "globalmatch/detail/survey/map_links.hpp"
#include "globalmatch/detail/survey/overlap_index.hpp"
#include "globalmatch/detail/survey/survey_link.hpp"
#include "globalmatch/execution.hpp"

namespace globalmatch::detail {

/// How maps ask for links.
struct link_question {
  double tolerance;      ///< [m] edges of congruent triangles differ by less
  bool all_others;       ///< not only of later maps, which ask themselves
  double max_log10_nfa;  ///< of a link that needs no other
};

/// The links of a map by candidates that are tried on all stems, those of most votes first, until many in a
/// row have failed.
inline std::vector<survey_link> links_of(std::span<const prepared_stems> maps, const overlap_index& index,
                                         std::size_t map, const link_question& asked, std::size_t& tried) {
  constexpr std::size_t max_candidates = 64, max_failures = 16, max_plantation_tries = 6;
  plantation_tries tries{max_plantation_tries};
  std::vector<survey_link> links;
  std::size_t failures = 0;
  for (const overlap_candidate& c :
       index.candidates_of(map, asked.tolerance, max_candidates, asked.all_others)) {
    if (failures == max_failures) break;
    ++tried;
    ++failures;
    if (auto link = link_maps(maps, c, asked.max_log10_nfa, tries))
      links.push_back(std::move(*link)), failures = 0;
  }
  return links;
}

/// Orders links by their maps and leaves the most significant one of each pair of maps.
inline void keep_best_of_pairs(std::vector<survey_link>& links) {
  const auto pair_of = [](const survey_link& l) {
    return key_of(std::min(l.source, l.target), std::max(l.source, l.target));
  };
  std::stable_sort(links.begin(), links.end(), [&](const survey_link& a, const survey_link& b) {
    return pair_of(a) != pair_of(b) ? pair_of(a) < pair_of(b) : a.log10_nfa < b.log10_nfa;
  });
  links.erase(std::unique(links.begin(), links.end(),
                          [&](const auto& a, const auto& b) { return pair_of(a) == pair_of(b); }),
              links.end());
}

/// The links of the maps `asking`, in their order.
inline std::vector<map_links> ask_maps(std::span<const prepared_stems> maps, const overlap_index& index,
                                       std::span<const std::uint32_t> asking, const link_question& asked,
                                       const execution& exec) {
  std::vector<map_links> found(asking.size());
  parallel_for(
      exec, "overlaps", asking.size(),
      [&](std::size_t i) {
        found[i].map = asking[i];
        found[i].links = links_of(maps, index, asking[i], asked, found[i].tried);
      },
      1);
  return found;
}

/// Adds the links that maps found.
inline void add_links(std::vector<map_links>&& found, std::vector<survey_link>& links, std::size_t& tried) {
  for (map_links& of_map : found) {
    tried += of_map.tried;
    for (survey_link& l : of_map.links) links.push_back(std::move(l));
  }
  keep_best_of_pairs(links);
}

/// Number of links that each map has and uses.
inline std::vector<std::size_t> count_links(std::span<const survey_link> links, std::size_t maps) {
  std::vector<std::size_t> count(maps);
  for (const survey_link& l : links)
    if (l.used) ++count[l.source], ++count[l.target];
  return count;
}

/// [m] at which maps ask for links, one after the other.
inline constexpr double link_tolerances[] = {0.03, 0.06, 0.12};
inline constexpr double overlap_cell = 2 * link_tolerances[0];  // [m]
inline constexpr std::size_t min_linked_stems = 4;

/// How every map asks at first, whatever others find.
inline link_question first_question(double max_log10_nfa) {
  return {link_tolerances[0], false, max_log10_nfa};
}

inline constexpr std::size_t sufficient_links = 3;  // of which two may be wrong

/// Adds the links of the last map, which asks again as all others do.
inline void find_links_of_last(std::span<const prepared_stems> maps, const overlap_index& index,
                               double max_log10_nfa, std::vector<survey_link>& links, std::size_t& tried) {
  const auto last = std::uint32_t(maps.size() - 1);
  if (maps[last].stems.size() < min_linked_stems) return;
  const std::size_t before = links.size();
  for (const double tolerance : link_tolerances) {
    poll_cancelled();
    std::vector<survey_link> own(links.begin() + std::ptrdiff_t(before), links.end());
    for (survey_link& l : links_of(maps, index, last, {tolerance, true, max_log10_nfa}, tried))
      own.push_back(std::move(l));
    keep_best_of_pairs(own);
    links.resize(before);
    links.insert(links.end(), own.begin(), own.end());
    use_supported_links(links, maps.size(), max_log10_nfa);
    if (count_links(links, maps.size())[last] >= sufficient_links) break;
  }
}

/// Links of all maps: at first by triangles that hardly differ, of which few are alike at random; maps that
/// found few links ask again with ever coarser ones. `known`: the answers that some maps have to the first
/// question, ordered by map.
inline std::vector<survey_link> find_links(std::span<const prepared_stems> maps, const overlap_index& index,
                                           double max_log10_nfa, std::vector<map_links>&& known,
                                           std::size_t& tried, const execution& exec) {
  std::vector<survey_link> links;
  std::vector<std::size_t> count(maps.size());
  const auto by_map = [](const map_links& a, const map_links& b) { return a.map < b.map; };
  for (const double tolerance : link_tolerances) {
    const bool is_first = tolerance == link_tolerances[0];
    std::vector<std::uint32_t> asking;
    for (std::uint32_t m = 0; m < maps.size(); ++m)
      if (count[m] < sufficient_links && maps[m].stems.size() >= min_linked_stems &&
          !std::binary_search(known.begin(), known.end(), map_links{m}, by_map))
        asking.push_back(m);
    auto found = ask_maps(
        maps, index, asking,
        is_first ? first_question(max_log10_nfa) : link_question{tolerance, true, max_log10_nfa}, exec);
    std::move(known.begin(), known.end(), std::back_inserter(found));
    known.clear();
    std::sort(found.begin(), found.end(), by_map);
    add_links(std::move(found), links, tried);
    use_supported_links(links, maps.size(), max_log10_nfa);
    count = count_links(links, maps.size());
  }
  return links;
}

}  // namespace globalmatch::detail
