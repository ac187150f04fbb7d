// Targets that scans show, as reflectors: a table of what was measured, and what became of it.
#pragma once

#include <globalmatch/survey_options.hpp>

#include <nlohmann/json.hpp>

#include <filesystem>
#include <string>
#include <vector>

#include "support/programs/survey_work.hpp"

namespace globalmatch::support {

/// A target of a scan, by its name; the number in `measured` is not set.
struct named_target {
  std::string scan;
  survey_options::target measured;
};

/// Reads `scan,target,x,y,z,sigma`: position [m] in the frame of the scan, and its standard deviation along
/// each axis, 5 mm where it is missing or empty. Columns may stand in any order. Throws `file_error` naming
/// the line.
std::vector<named_target> read_targets(const std::filesystem::path& file);

/// Those of scans that were mapped; others are left out, and named on standard error.
std::vector<survey_options::target> targets_of(const std::vector<named_target>& targets,
                                               const survey_work& work);

/// Names the observations that do not fit where other scans have their target on standard error.
void report_targets(const survey& result, const std::vector<std::string>& names);

/// Targets with their positions and observations.
nlohmann::ordered_json describe_targets(const survey& result, const std::vector<std::string>& names);

}  // namespace globalmatch::support
