// Internal to the LAS reader: compressed points.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "support/file_bytes.hpp"
#include "support/las_header.hpp"
#include "support/point_source.hpp"
#include "support/record_fields.hpp"

namespace globalmatch::support {

/// The points of a LAZ or COPC file, in the order of the file. They are decoded at once if they fit in
/// `options.memory`, otherwise when they are asked for, and attributes always so. Throws `file_error` when
/// the file is damaged or compressed in a way that is not read. Adds to `notes` what is odd about it.
std::unique_ptr<point_source> open_laz(file_bytes file, const las_header& header, const laszip_record& laszip,
                                       std::vector<record_field> fields, const scan_options& options,
                                       std::vector<std::string>& notes);

}  // namespace globalmatch::support
