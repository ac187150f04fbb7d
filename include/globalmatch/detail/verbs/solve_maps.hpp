// Maps of a survey and their links solved, step by step: placed, adjusted, levelled, described.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <optional>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "globalmatch/detail/survey/adjust_to_priors.hpp"
#include "globalmatch/detail/survey/adjust_to_trees.hpp"
#include "globalmatch/detail/survey/agreeing_poses.hpp"
#include "globalmatch/detail/survey/confirm_links.hpp"
#include "globalmatch/detail/survey/decide_places.hpp"
#include "globalmatch/detail/survey/find_links.hpp"
#include "globalmatch/detail/survey/find_tilts.hpp"
#include "globalmatch/detail/survey/known_poses.hpp"
#include "globalmatch/detail/survey/link_graph.hpp"
#include "globalmatch/detail/survey/map_links.hpp"
#include "globalmatch/detail/survey/overlap_index.hpp"
#include "globalmatch/detail/survey/place_maps.hpp"
#include "globalmatch/detail/survey/survey_frames.hpp"
#include "globalmatch/detail/survey/survey_heights.hpp"
#include "globalmatch/detail/survey/survey_link.hpp"
#include "globalmatch/detail/survey/survey_targets.hpp"
#include "globalmatch/detail/survey/target_links.hpp"
#include "globalmatch/detail/verbs/describe_survey.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/positions.hpp"
#include "globalmatch/survey_matches.hpp"
#include "globalmatch/survey_options.hpp"

namespace globalmatch::detail {

inline std::vector<prepared_stems> prepare_maps(std::vector<position_set>&& sets, const execution& exec) {
  std::vector<prepared_stems> maps(sets.size());
  parallel_for(
      exec, "maps", sets.size(),
      [&](std::size_t m) { maps[m] = without_triangles(std::move(sets[m]), true, {}); }, 1);
  return maps;
}

/// The largest NFA of a link, which is one of as many as there are pairs of maps.
inline double max_log10_nfa_of_survey(const survey_options& options, std::size_t maps) {
  const double pairs = double(maps) * (double(maps) - 1) / 2;
  return std::log10(options.max_nfa) - std::log10(std::max(1.0, pairs));
}

/// What the options say of the poses of the maps.
inline known_poses known_poses_of(const survey_options& options, std::span<const prepared_stems> maps) {
  std::vector<std::optional<rigid>> fixed(maps.size());
  for (const survey_options::fixed_scan& f : options.fixed)
    fixed[f.scan] = from_eigen(f.survey_from_scan) * maps[f.scan].stems.frame.local_from_scan().inverse();
  known_poses known(options.reference.value_or(known_poses::none), std::move(fixed));
  for (const survey_options::level& l : options.levels) known.note_level(l.scan);
  return known;
}

/// Places the maps by the links that are used, and adjusts them with trees and targets as landmarks; again
/// without the links that these do not confirm.
inline local_survey solve_used_links(std::span<const prepared_stems> maps, std::vector<survey_link>&& links,
                                     const known_poses& known, const target_observations& targets) {
  constexpr int restoring = 12, max_repetitions = 24;
  local_survey s;
  s.maps = maps;
  s.links = std::move(links);
  std::vector<std::uint8_t> ambiguous(maps.size()), tried, usable;
  for (const survey_link& l : s.links) usable.push_back(l.used);
  const auto is_used = [](const survey_link& l) { return l.used; };
  for (int repetition = 0;; ++repetition) {
    s.placed = place_maps(s.links, maps.size(), known);
    s.members = members_of(s.placed, link_graph(maps.size(), s.links, is_used));
    s.adjusted = adjust_to_trees(maps, s.placed, s.links, s.members, known, targets);
    if (repetition == 0) tried = s.placed.tried;
    for (std::size_t m = 0; m < maps.size(); ++m) ambiguous[m] |= s.placed.ambiguous[m];
    const std::vector<std::size_t> unconfirmed = unconfirmed_links(s.links, maps, s.adjusted);
    if (repetition == max_repetitions || unconfirmed.empty()) break;
    for (const std::size_t l : unconfirmed) usable[l] = false;
    // Others take their place, at first; then fewer and fewer are left, until all are confirmed.
    for (std::size_t l = 0; l < s.links.size(); ++l)
      s.links[l].used = usable[l] != 0 && (s.links[l].used || repetition < restoring);
  }
  s.placed.ambiguous = std::move(ambiguous);
  s.placed.tried = std::move(tried);
  const link_graph used(maps.size(), s.links, is_used);
  s.heights = find_heights(maps, s.adjusted.trees, used, s.members, known, s.adjusted.targets);
  return s;
}

inline std::size_t maps_alone(const local_survey& s) {
  return std::size_t(
      std::count_if(s.members.begin(), s.members.end(), [](const auto& of) { return of.size() == 1; }));
}
/// Whether maps lost their places: more stand alone, or there are more components.
inline bool loses_places(const local_survey& s, const local_survey& before) {
  return maps_alone(s) > maps_alone(before) || s.members.size() > before.members.size();
}

/// The same, and again with links of maps outside the main component that its trees decide, as long as that
/// joins components and no map loses its place.
inline local_survey solve_links(std::span<const prepared_stems> maps, std::vector<survey_link>&& links,
                                const known_poses& known, const target_observations& targets,
                                double max_log10_nfa) {
  constexpr int max_repetitions = 3;
  local_survey s = solve_used_links(maps, std::move(links), known, targets);
  for (int repetition = 0; repetition < max_repetitions; ++repetition) {
    const auto main = main_component(s);
    if (!main) return s;
    const std::vector<std::size_t> decided =
        decide_places(maps, s.links, s.placed, s.adjusted, *main, max_log10_nfa);
    if (decided.empty()) return s;
    std::vector<survey_link> with_decided = s.links;
    for (const std::size_t l : decided) with_decided[l].used = true;
    local_survey joined = solve_used_links(maps, std::move(with_decided), known, targets);
    if (joined.members.size() == s.members.size() || loses_places(joined, s)) return s;
    for (std::size_t m = 0; m < maps.size(); ++m) joined.placed.ambiguous[m] |= s.placed.ambiguous[m];
    for (std::size_t l = 0; l < joined.links.size(); ++l) joined.placed.tried[l] |= s.placed.tried[l];
    s = std::move(joined);
  }
  return s;
}

/// Adds links by targets, beside those by stems, which may have more support then.
inline void add_target_links(const target_observations& targets, std::vector<survey_link>& links,
                             std::size_t maps, double max_log10_nfa) {
  std::vector<survey_link> by_targets = links_by_targets(targets);
  if (by_targets.empty()) return;
  std::move(by_targets.begin(), by_targets.end(), std::back_inserter(links));
  use_supported_links(links, maps, max_log10_nfa);
}

/// Turns a map upright whose vertical leans by `tilt` [rad], and forgets heights that slope; false where
/// there is nothing to do.
inline bool level_map(prepared_stems& map, const vec2& tilt, bool sloping, const plan_pose& pose) {
  const bool forgets = sloping && map.stems.has_heights;
  if (forgets) map.stems.has_heights = false;
  if (!(tilt.norm() > 0)) return forgets;
  map = turned_upright(map, tilt, pose.yaw);
  return true;
}

/// Turns maps upright whose verticals lean against the known ones or else against those of most, and forgets
/// heights that slope; false where there are none.
inline bool level_maps(std::vector<prepared_stems>& maps, const local_survey& s,
                       std::span<const survey_options::level> levels, const execution& exec) {
  const auto of_link = tilts_of_links(maps, s.links, s.adjusted.poses, exec);
  const std::vector<vec2> tilts = find_tilts(s.links, of_link, s.placed.parts.of, levels);
  const std::vector<std::uint8_t> sloping = find_sloping(s.links, of_link, maps.size());
  bool any = false;
  for (std::size_t m = 0; m < maps.size(); ++m)
    any |= level_map(maps[m], tilts[m], sloping[m] != 0, s.adjusted.poses[m]);
  return any;
}

/// The survey solved again with the known poses held that agree with it, if no map loses its place by that.
/// `distances` [m] of those that do not agree from where the survey has them.
inline local_survey hold_known_poses(local_survey&& solved, const std::vector<survey_link>& links,
                                     known_poses& known, const target_observations& targets,
                                     double max_log10_nfa, std::vector<double>& distances) {
  const known_pose_comparison compare(solved.maps, solved.adjusted, solved.heights, known);
  if (!hold_agreeing(compare, solved.members, known, distances)) return std::move(solved);
  local_survey held =
      solve_links(solved.maps, std::vector<survey_link>(links), known, targets, max_log10_nfa);
  if (!loses_places(held, solved)) return held;
  known.release_all();
  return solve_links(solved.maps, std::vector<survey_link>(links), known, targets, max_log10_nfa);
}

inline void describe(survey& result, const local_survey& s) {
  describe_scans(result, s);
  describe_links(result, s);
  describe_trees(result, s);
}

/// What matches hold for these maps, ordered by map, each once.
inline std::vector<map_links> known_links(std::span<const survey_matches> matches,
                                          std::span<const prepared_stems> maps, double max_log10_nfa) {
  std::vector<map_links> known;
  if (matches.empty()) return known;
  const std::uint64_t fingerprint = fingerprint_of(maps, max_log10_nfa);
  std::vector<bool> is_known(maps.size(), false);
  for (const survey_matches& m : matches) {
    if (m.fingerprint != fingerprint || m.maps.size() != m.links.size())
      throw std::invalid_argument("matches: they are of other maps, or of other options");
    for (std::size_t i = 0; i < m.maps.size(); ++i) {
      if (m.maps[i] >= maps.size()) throw std::invalid_argument("matches: there is no map of that number");
      if (is_known[m.maps[i]]) continue;
      is_known[m.maps[i]] = true;
      known.push_back(map_links_of(m.maps[i], m.links[i], maps));
    }
  }
  std::sort(known.begin(), known.end(), [](const auto& a, const auto& b) { return a.map < b.map; });
  return known;
}

/// What links make of the maps of a survey.
struct survey_solution {
  std::vector<survey_link> links;  ///< of stems, before the adjustment decides which ones are used
  std::size_t candidates = 0;      ///< that were tried
  target_observations targets;
  known_poses known;
  std::vector<double>
      distances;  ///< [m] by which known poses are off that are not held; not a number of others
  local_survey solved;
};

/// The links of stems and of targets.
inline std::vector<survey_link> all_links(const survey_solution& s, std::size_t maps, double max_log10_nfa) {
  std::vector<survey_link> links = s.links;
  add_target_links(s.targets, links, maps, max_log10_nfa);
  return links;
}

/// Solves all links, with no known pose held.
inline void solve_all(std::span<const prepared_stems> maps, const survey_options& options,
                      survey_solution& s) {
  const double max_log10_nfa = max_log10_nfa_of_survey(options, maps.size());
  s.targets = find_targets(options.targets, maps);
  s.known = known_poses_of(options, maps);
  s.distances.assign(maps.size(), std::numeric_limits<double>::quiet_NaN());
  s.solved = solve_links(maps, all_links(s, maps.size(), max_log10_nfa), s.known, s.targets, max_log10_nfa);
}

/// Solves all links again with the known poses held that agree.
inline void hold_known(const survey_options& options, survey_solution& s) {
  const std::size_t maps = s.solved.maps.size();
  const double max_log10_nfa = max_log10_nfa_of_survey(options, maps);
  s.solved = hold_known_poses(std::move(s.solved), all_links(s, maps, max_log10_nfa), s.known, s.targets,
                              max_log10_nfa, s.distances);
}

/// Solves the survey of the maps, which are turned upright where they lean. `index`: what is left of it after
/// the links are found; a survey that does not grow needs it no more.
inline survey_solution solve_maps(std::vector<prepared_stems>& maps, std::span<const survey_matches> matches,
                                  const survey_options& options, std::optional<overlap_index>& index,
                                  bool grows, const execution& exec) {
  constexpr int max_levellings = 2;
  const double max_log10_nfa = max_log10_nfa_of_survey(options, maps.size());
  std::vector<map_links> asked = known_links(matches, maps, max_log10_nfa);
  survey_solution s;
  for (int levelling = 0;; ++levelling) {
    index.emplace(maps, overlap_cell, exec);
    s.links = find_links(maps, *index, max_log10_nfa, std::move(asked), s.candidates, exec);
    if (!grows) index.reset();
    report_progress(exec, "adjustment", 0);
    solve_all(maps, options, s);
    if (levelling == max_levellings || !level_maps(maps, s.solved, options.levels, exec)) break;
    asked.clear();
  }
  hold_known(options, s);
  return s;
}

/// What is reported of a survey.
inline survey described(const survey_solution& s, const survey_options& options) {
  survey result;
  result.candidates = s.candidates;
  describe(result, s.solved);
  describe_targets(result, s.solved, options.targets);
  for (std::size_t m = 0; m < result.scans.size(); ++m) result.scans[m].fixed_distance = s.distances[m];
  use_known_frames(result, options, [&](int component) -> std::optional<std::size_t> {
    const components& parts = s.solved.placed.parts;
    for (const survey_options::fixed_scan& f : options.fixed)
      if (result.scans[f.scan].component == component) return parts.reference[parts.of[f.scan]];
    return std::nullopt;
  });
  if (!result.priors.empty()) adjust_to_priors(result, s.solved.heights.stem_sigma);
  return result;
}

}  // namespace globalmatch::detail
