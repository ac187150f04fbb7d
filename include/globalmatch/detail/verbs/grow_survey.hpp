// A survey that grows: a further map finds its links and its place, and all are adjusted from where they are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/compiled.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "globalmatch/detail/survey/find_links.hpp"
#include "globalmatch/detail/survey/find_tilts.hpp"
#include "globalmatch/detail/survey/known_poses.hpp"
#include "globalmatch/detail/survey/overlap_index.hpp"
#include "globalmatch/detail/survey/survey_link.hpp"
#include "globalmatch/detail/verbs/describe_survey.hpp"
#include "globalmatch/detail/verbs/place_further_map.hpp"
#include "globalmatch/detail/verbs/solve_maps.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/positions.hpp"
#include "globalmatch/survey_options.hpp"

namespace globalmatch::detail {

/// A survey that further maps are added to.
struct kept_survey {
  survey_options options;
  std::vector<prepared_stems> maps;
  std::optional<overlap_index> index;
  survey_solution solution;
  std::vector<std::optional<relative_tilt>> tilts;  ///< of the links
};

/// The scan whose frame the survey keeps while it grows: that which was asked for, else that of the largest
/// component, once there is one.
inline std::optional<std::size_t> kept_reference(const survey_options& options, const local_survey& s) {
  if (options.reference) return options.reference;
  const auto largest = main_component(s);
  if (!largest) return std::nullopt;
  return s.placed.parts.reference[*largest];
}

GLOBALMATCH_INLINE std::shared_ptr<kept_survey> make_kept_survey(std::vector<position_set> sets,
                                                                 const survey_options& options,
                                                                 survey& result, const execution& exec,
                                                                 build_mode) {
  const parallel_scope scope(exec, "survey");
  auto kept = std::make_shared<kept_survey>();
  kept->options = options;
  kept->maps = prepare_maps(std::move(sets), exec);
  kept->solution = solve_maps(kept->maps, {}, options, kept->index, true, exec);
  const local_survey& solved = kept->solution.solved;
  kept->tilts = tilts_of_links(kept->maps, solved.links, solved.adjusted.poses, exec);
  kept->options.reference = kept_reference(options, solved);
  result = described(kept->solution, options);
  return kept;
}

/// Turns the last map upright if it leans against most, and forgets its heights if these slope; false where
/// neither is so. `tilts`: of the first links of the survey; those of the others are added.
inline bool level_last(prepared_stems& map, const local_survey& s,
                       std::span<const survey_options::level> levels,
                       std::vector<std::optional<relative_tilt>>& tilts) {
  for (std::size_t l = tilts.size(); l < s.links.size(); ++l) {
    tilts.emplace_back();
    if (s.links[l].used && !s.links[l].is_of_targets())
      tilts[l] = tilt_of_link(s.maps, s.links[l], s.adjusted.poses[s.links[l].target]);
  }
  const std::vector<vec2> leans = find_tilts(s.links, tilts, s.placed.parts.of, levels);
  const std::vector<std::uint8_t> sloping = find_sloping(s.links, tilts, s.maps.size());
  return level_map(map, leans.back(), sloping.back() != 0, s.adjusted.poses.back());
}

/// The solution with the last map: by its links alone where these contradict nothing, else with all links
/// solved again; so are few maps, which takes no longer, and such with targets.
inline survey_solution solve_last(const kept_survey& kept, bool& is_solved_again, const execution& exec) {
  constexpr std::size_t few = 50;  // maps
  survey_solution s;
  s.links = kept.solution.links;
  s.candidates = kept.solution.candidates;
  find_links_of_last(kept.maps, *kept.index, max_log10_nfa_of_survey(kept.options, kept.maps.size()), s.links,
                     s.candidates);
  std::optional<local_survey> solved;
  if (kept.maps.size() > few && kept.options.targets.empty())
    solved = with_last_map(kept.solution.solved, kept.maps, kept.solution.links, s.links, kept.solution.known,
                           exec);
  if (solved) {
    s.solved = std::move(*solved);
    s.known = kept.solution.known;
    s.distances = kept.solution.distances;
    s.distances.push_back(std::numeric_limits<double>::quiet_NaN());
  } else {
    is_solved_again = true;
    solve_all(kept.maps, kept.options, s);
    hold_known(kept.options, s);
  }
  return s;
}

/// Finds links and place of the last map, levelled, and keeps them.
inline void solve_with_last(kept_survey& kept, survey& result, const execution& exec) {
  constexpr int max_levellings = 2;
  survey_solution next;
  std::vector<std::optional<relative_tilt>> tilts;
  for (int levelling = 0;; ++levelling) {
    kept.index->set_further(kept.maps);
    bool is_solved_again = false;
    next = solve_last(kept, is_solved_again, exec);
    const local_survey& solved = next.solved;
    tilts =
        is_solved_again ? tilts_of_links(kept.maps, solved.links, solved.adjusted.poses, exec) : kept.tilts;
    if (levelling == max_levellings || !level_last(kept.maps.back(), next.solved, kept.options.levels, tilts))
      break;
  }
  survey described_next = described(next, kept.options);
  poll_cancelled();
  kept.index->keep_further();
  kept.solution = std::move(next);
  kept.tilts = std::move(tilts);
  kept.options.reference = kept_reference(kept.options, kept.solution.solved);
  result = std::move(described_next);
}

GLOBALMATCH_INLINE void add_positions(kept_survey& kept, survey& result, position_set set,
                                      const execution& exec, build_mode) {
  const parallel_scope scope(exec, "survey");
  kept.maps.push_back(without_triangles(std::move(set), true, exec));
  try {
    solve_with_last(kept, result, exec);
  } catch (...) {
    kept.maps.pop_back();
    kept.solution.solved.maps = kept.maps;
    throw;
  }
}

}  // namespace globalmatch::detail
