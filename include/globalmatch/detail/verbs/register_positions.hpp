// The survey composed: find overlaps and links, place maps by them, adjust with trees as landmarks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/compiled.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "globalmatch/detail/survey/find_links.hpp"
#include "globalmatch/detail/survey/map_links.hpp"
#include "globalmatch/detail/survey/overlap_index.hpp"
#include "globalmatch/detail/verbs/solve_maps.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/positions.hpp"
#include "globalmatch/survey_matches.hpp"
#include "globalmatch/survey_options.hpp"

namespace globalmatch::detail {

GLOBALMATCH_INLINE survey_matches match_positions_of_part(std::vector<position_set> sets,
                                                          const survey_matches::part& part,
                                                          const survey_options& options,
                                                          const execution& exec, build_mode) {
  const parallel_scope scope(exec, "survey");
  const std::vector<prepared_stems> maps = prepare_maps(std::move(sets), exec);
  const double max_log10_nfa = max_log10_nfa_of_survey(options, maps.size());
  std::vector<std::uint32_t> asking;
  for (std::size_t m = part.number; m < maps.size(); m += part.count)
    if (maps[m].stems.size() >= min_linked_stems) asking.push_back(std::uint32_t(m));
  survey_matches matches;
  matches.fingerprint = fingerprint_of(maps, max_log10_nfa);
  const overlap_index index(maps, overlap_cell, exec);
  for (const map_links& found : ask_maps(maps, index, asking, first_question(max_log10_nfa), exec)) {
    matches.maps.push_back(found.map);
    matches.links.push_back(bytes_of(found));
  }
  return matches;
}

GLOBALMATCH_INLINE survey register_positions(std::vector<position_set> sets,
                                             std::span<const survey_matches> matches,
                                             const survey_options& options, const execution& exec,
                                             build_mode) {
  const parallel_scope scope(exec, "survey");
  std::vector<prepared_stems> maps = prepare_maps(std::move(sets), exec);
  std::optional<overlap_index> index;
  return described(solve_maps(maps, matches, options, index, false, exec), options);
}

}  // namespace globalmatch::detail
