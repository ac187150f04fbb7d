// Surveys: any number of stem maps -> one frame, the scans that cannot be trusted, and the merged trees.
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <ranges>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/compiled.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/positions.hpp"
#include "globalmatch/stem_map.hpp"
#include "globalmatch/survey_options.hpp"

namespace globalmatch {

namespace detail {
/// `register_survey` for positions in the internal representation.
GLOBALMATCH_INLINE survey register_positions(std::vector<position_set> maps, const survey_options& options,
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
}  // namespace detail

/// Registers any number of maps: `stem_map`s, or ranges of positions as in `match_stems`, whose up is +z.
/// Scans are levelled: each turns about its own vertical alone (4-DoF). No scan is placed without evidence
/// that counts all pairs of maps; what was not placed has its reason. Throws `std::invalid_argument` naming a
/// bad option, or a map with a position that is not finite. Cost: some milliseconds a map, and some more the
/// more maps there are.
template <std::ranges::forward_range Maps>
survey register_survey(const Maps& maps, const survey_options& options = {}, const execution& exec = {}) {
  require_valid(options);
  try {
    const detail::parallel_scope scope(exec, "survey");
    std::vector<position_set> sets;
    for (const auto& map : maps)
      sets.push_back(detail::positions_of(map, "map " + std::to_string(sets.size()), exec));
    if (options.reference && *options.reference >= sets.size())
      throw std::invalid_argument("reference: there is no map of that number");
    return detail::register_positions(std::move(sets), options, exec);
  } catch (const operation_cancelled&) {
    survey result;
    result.cancelled = true;
    return result;
  }
}

}  // namespace globalmatch

#if !defined(GLOBALMATCH_COMPILED)
#include "globalmatch/detail/verbs/register_positions.hpp"
#endif
