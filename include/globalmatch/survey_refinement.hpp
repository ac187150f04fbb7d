// Refinement of a survey by the samples of its scans, on the ground and on the stems: pair by pair, then all
// poses at once.
#pragma once

#include <cstddef>
#include <istream>
#include <ostream>
#include <span>
#include <string>
#include <vector>

#include "globalmatch/detail/core/compiled.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/survey/pairs_in_common.hpp"
#include "globalmatch/detail/survey/recent_maps.hpp"
#include "globalmatch/detail/survey/refined_pair_fields.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/refinement_options.hpp"
#include "globalmatch/stem_map.hpp"
#include "globalmatch/survey_options.hpp"

namespace globalmatch {

namespace detail {
/// For `refine_pair`.
GLOBALMATCH_INLINE refined_pair refine_stem_maps(const stem_map& source, const stem_map& target,
                                                 const pair_to_refine& pair,
                                                 const refinement_options& options, const execution& exec,
                                                 build_mode = {});
/// For `apply_refinements`.
GLOBALMATCH_INLINE void adjust_to_refinements(survey& result, std::span<const refined_pair> pairs,
                                              build_mode = {});
}  // namespace detail

/// The pairs of placed scans that are worth a refinement, ordered by source, then by target: each scan with
/// those that have most trees in common with it, and what connects all scans of a component. At most
/// `pairs_per_scan` + 1 a scan, on the average. Throws `std::invalid_argument` naming a bad option. Cost:
/// linear in the trees.
inline std::vector<pair_to_refine> pairs_to_refine(const survey& s, const refinement_options& options = {}) {
  require_valid(options);
  return detail::pairs_in_common(s, options.pairs_per_scan, options.without_samples);
}

/// Refines one pair, which depends on no other one: the ground that both see gives the height, and ICP over
/// the samples shift and turn where it moves them no further than both uncertainties allow. `source` and
/// `target` are the maps of the pair's scans, with their samples; what they lack leaves the start, with the
/// reason. The uncertainty is that of residuals which stems and places have in common. Throws
/// `std::invalid_argument` naming a bad option or an uncertainty that is not 4 x 4, and
/// `operation_cancelled`. Cost: some 50 ms of CPU.
inline refined_pair refine_pair(const stem_map& source, const stem_map& target, const pair_to_refine& pair,
                                const refinement_options& options = {}, const execution& exec = {}) {
  require_valid(options);
  return detail::refine_stem_maps(source, target, pair, options, exec);
}

/// Adjusts all poses of the survey to its refined pairs and, in plan, to its trees as well; updates heights,
/// uncertainties, trees, and the residuals of links. Where ICP turned freely scans are turned about all axes:
/// verticals that are those of stems are good to some tenths of a degree. References keep their poses. Pairs
/// that disagree with others lose their weight. A scan that no pair connects with a reference stays as it is.
/// Throws `std::invalid_argument` for pairs of other scans than those that were placed. Cost: that of the
/// adjustment to trees.
inline void apply_refinements(survey& s, const std::vector<refined_pair>& pairs) {
  detail::adjust_to_refinements(s, pairs);
}

/// All of it, and returns what was found of each pair. `load(scan)` returns the `stem_map` of a scan with its
/// samples; some maps at a time are in memory, and maps are loaded again where they are needed again. Where
/// `exec` cancels, `cancelled` says so, and the survey stays as it was.
template <class Load>
std::vector<refined_pair> refine_survey(survey& s, const Load& load, const refinement_options& options = {},
                                        const execution& exec = {}) {
  std::vector<refined_pair> refined;
  try {
    const detail::parallel_scope scope(exec, "refinement");
    const std::vector<pair_to_refine> pairs = pairs_to_refine(s, options);
    detail::recent_maps maps(load);
    for (const pair_to_refine& pair : pairs) {
      detail::report_progress(exec, "refinement", double(refined.size()) / double(pairs.size()));
      const auto source = maps(pair.source), target = maps(pair.target);
      refined.push_back(refine_pair(*source, *target, pair, options, exec));
    }
    apply_refinements(s, refined);
  } catch (const operation_cancelled&) {
    s.cancelled = true;
    refined.clear();
  }
  return refined;
}

/// Writes a pair in a form that does not depend on the platform, bit for bit, with checksums. The stream must
/// be binary. Throws `std::runtime_error` when it fails.
inline void write_refined_pair(std::ostream& out, const refined_pair& pair) {
  detail::output_archive archive;
  serialize(archive, pair);
  const std::string content = std::move(archive).bytes();
  detail::write_sections(out, detail::refined_pair_format, std::span(&content, 1));
}

/// Reads such a pair. Throws `std::runtime_error` for what is none, is of a newer version, cut off or
/// damaged.
inline refined_pair read_refined_pair(std::istream& in) {
  detail::section_reader sections(in, detail::refined_pair_format);
  const std::string content = sections.read();
  detail::input_archive archive(content, "the refined pair file");
  refined_pair pair;
  serialize(archive, pair);
  archive.finish();
  return pair;
}

}  // namespace globalmatch

#if !defined(GLOBALMATCH_COMPILED)
#include "globalmatch/detail/verbs/adjust_to_refinements.hpp"
#include "globalmatch/detail/verbs/refine_stem_maps.hpp"
#endif
