// Surveys: any number of stem maps -> one frame, the scans that cannot be trusted, and the merged trees.
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <ranges>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/compiled.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/positions.hpp"
#include "globalmatch/stem_map.hpp"
#include "globalmatch/survey_matches.hpp"
#include "globalmatch/survey_options.hpp"

namespace globalmatch {

namespace detail {
/// `solve_survey` for positions in the internal representation.
GLOBALMATCH_INLINE survey register_positions(std::vector<position_set> maps,
                                             std::span<const survey_matches> matches,
                                             const survey_options& options, const execution& exec,
                                             build_mode = {});

/// `match_survey` for positions in the internal representation.
GLOBALMATCH_INLINE survey_matches match_positions_of_part(std::vector<position_set> maps,
                                                          const survey_matches::part& part,
                                                          const survey_options& options,
                                                          const execution& exec, build_mode = {});

/// The stems of a map, whose heights are not known where it shows no ground.
inline position_set positions_of(const stem_map& map, const std::string& name, const execution& exec) {
  position_set set = import_positions(map.stems, map.up, name, exec);
  set.has_heights = set.has_heights && map.terrain.status == ground_status::seen;
  return set;
}

template <position_range R>
position_set positions_of(const R& stems, const std::string& name, const execution& exec) {
  return import_positions(stems, Eigen::Vector3d::UnitZ(), name, exec);
}

/// Throws `std::invalid_argument` where the options name a scan that there is not, or fix or level one twice.
inline void require_scans(const survey_options& options, std::size_t maps) {
  if (options.reference && *options.reference >= maps)
    throw std::invalid_argument("reference: there is no map of that number");
  std::vector<bool> is_fixed(maps, false);
  for (const survey_options::fixed_scan& f : options.fixed) {
    if (f.scan >= maps) throw std::invalid_argument("fixed: there is no map of that number");
    if (is_fixed[f.scan]) throw std::invalid_argument("fixed: a scan is fixed twice");
    is_fixed[f.scan] = true;
  }
  std::vector<bool> is_levelled(maps, false);
  for (const survey_options::level& l : options.levels) {
    if (l.scan >= maps) throw std::invalid_argument("levels: there is no map of that number");
    if (is_levelled[l.scan]) throw std::invalid_argument("levels: a scan is levelled twice");
    is_levelled[l.scan] = true;
  }
  for (const survey_options::prior& p : options.priors)
    if (p.scan >= maps) throw std::invalid_argument("priors: there is no map of that number");
  for (const survey_options::target& t : options.targets)
    if (t.scan >= maps) throw std::invalid_argument("targets: there is no map of that number");
}

/// All maps in the internal representation.
template <class Maps>
std::vector<position_set> positions_of_maps(const Maps& maps, const execution& exec) {
  std::vector<position_set> sets;
  for (const auto& map : maps) sets.push_back(positions_of(map, "map " + std::to_string(sets.size()), exec));
  return sets;
}
}  // namespace detail

/// A share of the matching of a survey, which most of its time goes into: what the maps of one part have in
/// common with others. `maps` are all maps of the survey, in the order in which `solve_survey` gets them.
/// Throws `std::invalid_argument` as `register_survey` does, and for a part that is none. Cost: that of an
/// index over all maps, and the part's share of the rest.
template <std::ranges::forward_range Maps>
survey_matches match_survey(const Maps& maps, const survey_matches::part& part,
                            const survey_options& options = {}, const execution& exec = {}) {
  require_valid(options);
  if (part.number >= part.count) throw std::invalid_argument("part: its number must be below their count");
  try {
    const detail::parallel_scope scope(exec, "survey");
    return detail::match_positions_of_part(detail::positions_of_maps(maps, exec), part, options, exec);
  } catch (const operation_cancelled&) {
    survey_matches result;
    result.cancelled = true;
    return result;
  }
}

/// `register_survey`, to the bit, of which some shares of the matching are done: in any order, of any number
/// of parts; what is missing is done here. Throws `std::invalid_argument` for matches of other maps or
/// options. Matches of another build or instruction set may differ in their last bits, which nothing here
/// knows.
template <std::ranges::forward_range Maps>
survey solve_survey(const Maps& maps, std::span<const survey_matches> matches,
                    const survey_options& options = {}, const execution& exec = {}) {
  require_valid(options);
  try {
    const detail::parallel_scope scope(exec, "survey");
    std::vector<position_set> sets = detail::positions_of_maps(maps, exec);
    detail::require_scans(options, sets.size());
    return detail::register_positions(std::move(sets), matches, options, exec);
  } catch (const operation_cancelled&) {
    survey result;
    result.cancelled = true;
    return result;
  }
}

/// Registers any number of maps: `stem_map`s, or ranges of positions as in `match_stems`, whose up is +z.
/// Scans are levelled: each turns about its own vertical alone (4-DoF). No scan is placed without evidence
/// that counts all pairs of maps; what was not placed has its reason. Throws `std::invalid_argument` naming a
/// bad option, or a map with a position that is not finite. Cost: some milliseconds a map, and some more the
/// more maps there are.
template <std::ranges::forward_range Maps>
survey register_survey(const Maps& maps, const survey_options& options = {}, const execution& exec = {}) {
  return solve_survey(maps, {}, options, exec);
}

}  // namespace globalmatch

#if !defined(GLOBALMATCH_COMPILED)
#include "globalmatch/detail/verbs/register_positions.hpp"
#endif
