// A drawing of a survey, seen from above (SVG): where the scans stand, which of them are linked, the trees.
#pragma once

#include <globalmatch/survey_options.hpp>

#include <filesystem>
#include <string>
#include <vector>

#include "support/programs/survey_files.hpp"

namespace globalmatch::support {

/// Draws the component of most scans: scans with their names, links in use by how far they are from the
/// adjusted poses, trees by how often they were seen; below, the scans that are not in it, with their
/// reasons. Throws `file_error` when the file cannot be written.
void write_survey_picture(const std::filesystem::path& path, const std::vector<survey_row>& rows,
                          const survey& result);

}  // namespace globalmatch::support
