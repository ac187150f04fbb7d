// A survey that grows map by map.
#pragma once

#include <cstddef>
#include <memory>
#include <ranges>
#include <string>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/compiled.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/positions.hpp"
#include "globalmatch/survey.hpp"
#include "globalmatch/survey_options.hpp"

namespace globalmatch {

namespace detail {
struct kept_survey;

/// Registers positions in the internal representation, and keeps what further maps need.
GLOBALMATCH_INLINE std::shared_ptr<kept_survey> make_kept_survey(std::vector<position_set> maps,
                                                                 const survey_options& options,
                                                                 survey& result, const execution& exec,
                                                                 build_mode = {});

/// Adds a map; leaves all as it was if it throws.
GLOBALMATCH_INLINE void add_positions(kept_survey& kept, survey& result, position_set map,
                                      const execution& exec, build_mode = {});
}  // namespace detail

/// The survey of some maps, to which further ones are added. Owns what it needs of the maps. Keeps an index
/// over their triangles: about the memory that `register_survey` takes. One thread at a time.
class growing_survey {
 public:
  /// `register_survey` of the maps, of which there may be none. Throws what that throws, and
  /// `operation_cancelled` when the progress callback says so.
  template <std::ranges::forward_range Maps>
  explicit growing_survey(const Maps& maps, const survey_options& options = {}, const execution& exec = {}) {
    require_valid(options);
    const detail::parallel_scope scope(exec, "survey");
    std::vector<position_set> sets = detail::positions_of_maps(maps, exec);
    detail::require_scans(options, sets.size());
    kept_ = detail::make_kept_survey(std::move(sets), options, result_, exec);
  }
  growing_survey(growing_survey&&) = default;
  growing_survey& operator=(growing_survey&&) = default;

  /// As `register_survey` returns it. The reference of the largest component stays what it was; where the
  /// options name none it is settled by the first maps that are linked.
  const survey& result() const { return result_; }

  /// Adds a map, a `stem_map` or a range of positions, and adjusts all scans. Returns the last scan of
  /// `result()`, all of which it replaces. Maps that were linked before ask for no further links themselves.
  /// Throws `std::invalid_argument` for a position that is not finite, and `operation_cancelled`; the survey
  /// is then what it was. Cost: grows with the maps; of a thousand a fiftieth of that of a new survey,
  /// but where links of the map contradict others, or connect components, that of its adjustment.
  template <class Map>
  const survey::scan& add(const Map& map, const execution& exec = {}) {
    const detail::parallel_scope scope(exec, "survey");
    const std::string name = "map " + std::to_string(result_.scans.size());
    detail::add_positions(*kept_, result_, detail::positions_of(map, name, exec), exec);
    return result_.scans.back();
  }

 private:
  std::shared_ptr<detail::kept_survey> kept_;  // by its deleter complete where it is not
  survey result_;
};

}  // namespace globalmatch

#if !defined(GLOBALMATCH_COMPILED)
#include "globalmatch/detail/verbs/grow_survey.hpp"
#endif
