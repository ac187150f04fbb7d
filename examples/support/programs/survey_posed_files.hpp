// The poses of a survey in the files of its scans, where their format has poses.
#pragma once

#include <globalmatch/survey_options.hpp>

#include <vector>

#include "support/programs/survey_command.hpp"
#include "support/programs/survey_work.hpp"

namespace globalmatch::support {

/// Makes the folder of copies. Throws `file_error` where no input is an E57 or PTX file, two of them have one
/// name, or a copy cannot be made or would replace an input. To be asked before long work.
void require_posed_files(const std::vector<survey_input>& inputs, const survey_command& command);

/// Copies the E57 and PTX files of the survey into the folder that the command names, each placed scan of the
/// largest component with its pose. Says which scans keep the pose that they had. Throws `file_error`.
void write_posed_files(const survey_work& work, const survey_command& command, const survey& result);

}  // namespace globalmatch::support
