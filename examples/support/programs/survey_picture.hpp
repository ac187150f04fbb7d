// A drawing of a survey, seen from above (SVG): where the scans stand, which of them are linked, the trees.
#pragma once

#include <globalmatch/survey_options.hpp>

#include <filesystem>
#include <ostream>
#include <string>
#include <vector>

#include "support/programs/survey_files.hpp"

namespace globalmatch::support {

/// Draws the component of most scans: scans with their names, links in use by how far they are from the
/// adjusted poses, trees by how often they were seen; below, the scans that are not in it, with their
/// reasons.
void draw_survey_picture(std::ostream& out, const std::vector<survey_row>& rows, const survey& result);

/// The same as a file. Throws `file_error` when it cannot be written.
void write_survey_picture(const std::filesystem::path& path, const std::vector<survey_row>& rows,
                          const survey& result);

}  // namespace globalmatch::support
