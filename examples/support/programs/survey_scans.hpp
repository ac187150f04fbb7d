// The points of the scans of a survey in its frame.
#pragma once

#include <globalmatch/survey_options.hpp>

#include "support/programs/survey_command.hpp"
#include "support/programs/survey_work.hpp"

namespace globalmatch::support {

/// What the command asks for of the scans that have a place in the largest component, in their order and with
/// the attributes of their points: each in a file of its own, `NAME.EXTENSION`, and all in one file of one
/// point a voxel. Points pass in blocks, and one scan at a time is open. Throws `file_error`.
void write_placed_scans(const survey_work& work, const survey_command& command, const survey& result);

}  // namespace globalmatch::support
