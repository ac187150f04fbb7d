// The refinement of a survey of scans: pair by pair by the samples of their maps, kept in files.
#pragma once

#include <globalmatch/execution.hpp>
#include <globalmatch/refinement_options.hpp>
#include <globalmatch/survey_options.hpp>

#include <nlohmann/json.hpp>

#include <cstddef>
#include <filesystem>
#include <vector>

#include "support/programs/command_line.hpp"
#include "support/programs/survey_work.hpp"

namespace globalmatch::support {

/// Refines every `step`-th of the pairs that are worth it, from number `first` on, by the maps
/// `DIR/maps/NAME.gmap` of the scans. Each is kept as `DIR/refined/SOURCE_on_TARGET.pair`, written whole or
/// not at all; one that is there is used where both maps, the start, options and version are those that it
/// was made with. Ground control has no samples, and is in no pair. Some maps at a time are in memory. Throws
/// `file_error` for a map that is gone or damaged and a file that cannot be written, and
/// `operation_cancelled`.
std::vector<refined_pair> refine_pairs(const survey& s, const survey_work& work,
                                       const std::filesystem::path& out_dir, const shared_options& options,
                                       const execution& exec, std::size_t first = 0, std::size_t step = 1);

/// Refines all pairs, adjusts the survey to them and to the heights of ground control, and returns what is
/// reported: counts of pairs, of those refined by ICP, and of those whose height is that of the ground.
nlohmann::ordered_json refine(survey& s, const survey_work& work, const std::filesystem::path& out_dir,
                              const shared_options& options, const execution& exec);

}  // namespace globalmatch::support
