// The report on the registration of two scans.
#pragma once

#include <globalmatch/registration_options.hpp>

#include <nlohmann/json.hpp>

#include <filesystem>
#include <string>
#include <utility>

#include "support/scan_files.hpp"

namespace globalmatch::support {

/// What it is about; refers to the caller's data.
struct reported_scan {
  std::string name;  ///< one of `names_apart`
  const scan_file& scan;
  const stem_map& map;
};

/// The names of two files without their folders, or with the last of these where the names agree.
std::pair<std::string, std::string> names_apart(const std::filesystem::path& a,
                                                const std::filesystem::path& b);

/// Writes a drawing or a page, as the name says. `report` is what the program writes as JSON. The points of
/// the scans are read again for a page that shows some. `needs_height` as in `trust_in`. Throws `file_error`.
void write_registration_report(const std::filesystem::path& path, const reported_scan& source,
                               const reported_scan& target, const registration& result, bool needs_height,
                               const nlohmann::ordered_json& report);

}  // namespace globalmatch::support
