// Internal to `open_scan`: one reader for each format. Each starts at the first byte of the file, and throws
// `file_error`.
#pragma once

#include "support/input_file.hpp"
#include "support/point_source.hpp"

namespace globalmatch::support {

/// PLY: ascii, binary little and big endian.
opened_scan open_ply(input_file& file, const scan_options& options);

/// PCD: ascii, binary, binary_compressed.
opened_scan open_pcd(input_file& file, const scan_options& options);

/// Lines of x, y, z and what else there may be: XYZ, CSV, TXT, PTS.
opened_scan open_text(input_file& file, const scan_options& options);

}  // namespace globalmatch::support
