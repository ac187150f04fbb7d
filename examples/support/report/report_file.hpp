// The file of a report, whose format its name tells.
#pragma once

#include <filesystem>

namespace globalmatch::support {

enum class report_format { svg, html };

/// Throws `std::invalid_argument` for a name that ends neither in .svg nor in .html.
report_format report_format_of(const std::filesystem::path& path);

/// The same, to be asked before long work; no name is no report.
void require_report_format(const std::filesystem::path& path);

}  // namespace globalmatch::support
