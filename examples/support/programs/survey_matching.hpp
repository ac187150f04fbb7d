// The matching of a survey in shares of several processes, kept in files `DIR/matches/part_I_of_N.gmatch`.
#pragma once

#include <globalmatch/execution.hpp>
#include <globalmatch/survey_matches.hpp>
#include <globalmatch/survey_options.hpp>

#include <vector>

#include "support/programs/survey_command.hpp"
#include "support/programs/survey_work.hpp"

namespace globalmatch::support {

/// Matches the part that the command names, unless its file is there and is of these maps, options and this
/// build, and says so. Throws `file_error` where the file cannot be written, or is of another build, and
/// `operation_cancelled`.
void match_part(const survey_work& work, const survey_command& command, const survey_options& options,
                const execution& exec);

/// The shares that are there and are of these maps, options and this build; what is damaged or of others is
/// left out, and done again by who solves the survey. Throws `file_error` where one is of another build and
/// the command is for one stage, of which others are done elsewhere.
std::vector<survey_matches> kept_matches(const survey_work& work, const survey_command& command);

}  // namespace globalmatch::support
