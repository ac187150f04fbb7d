// Internal to the readers: E57 (ASTM E2807), the exchange format of laser scanners.
#pragma once

#include <cstddef>
#include <ostream>
#include <span>
#include <string_view>

#include "support/input_file.hpp"
#include "support/numbered_scans.hpp"
#include "support/point_source.hpp"

namespace globalmatch::support {

/// Whether the first bytes of a file are those of an E57 file.
bool looks_like_e57(std::string_view start);

/// How many scans the file holds; pictures are none, and a scan may have no points. Throws `file_error`.
std::size_t count_e57_scans(input_file& file);

/// Scan `number`, counted from 1, in the frame of its stored coordinates, which is the scanner's own where
/// the file has a pose. Points without valid coordinates are not-a-number. Throws `file_error`.
opened_scan open_e57(input_file& file, std::size_t number, const scan_options& options);

/// Writes the file with other poses of some of its scans. Throws `file_error`.
void write_e57_with_poses(input_file& file, std::span<const scan_pose> poses, std::ostream& out);

}  // namespace globalmatch::support
