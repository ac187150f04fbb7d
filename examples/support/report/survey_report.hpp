// The report on a survey.
#pragma once

#include <globalmatch/survey_options.hpp>

#include <nlohmann/json.hpp>

#include "support/programs/survey_command.hpp"
#include "support/programs/survey_work.hpp"

namespace globalmatch::support {

/// Writes a drawing or a page, as the name of the command's report says; nothing where it has none. `report`
/// is what the program writes as JSON. For a page some points of each placed scan are read again, one scan
/// open at a time. Throws `file_error`.
void write_survey_report(const survey_command& command, const survey_work& work, const survey& result,
                         const nlohmann::ordered_json& report);

}  // namespace globalmatch::support
