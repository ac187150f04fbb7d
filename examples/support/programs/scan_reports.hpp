// What `scan_info` says of a scan.
#pragma once

#include <nlohmann/json.hpp>

#include <string>

#include "support/point_source.hpp"
#include "support/scan_summary.hpp"

namespace globalmatch::support {

/// Format, number of points, extent, density, attributes, returns and classes in one line.
std::string one_line(const scan_header& header, const scan_summary& summary);

/// The same in full; what is not known is null. Counts of returns and classes are keyed by number, and those
/// that are 0 are left out.
nlohmann::ordered_json describe(const scan_header& header, const scan_summary& summary);

}  // namespace globalmatch::support
