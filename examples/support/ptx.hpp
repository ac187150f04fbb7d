// Internal to the readers: PTX, the text format of Leica for scans with their poses.
#pragma once

#include <Eigen/Geometry>

#include <cstddef>
#include <ostream>
#include <span>
#include <string_view>

#include "support/input_file.hpp"
#include "support/numbered_scans.hpp"
#include "support/point_source.hpp"

namespace globalmatch::support {

/// Whether the first lines of a file are those of a PTX file: columns and rows of a scan, the scanner's place
/// and axes.
bool looks_like_ptx(std::string_view start);

/// How many scans the file holds, one after the other. Throws `file_error` when it is damaged.
std::size_t count_ptx_scans(input_file& file);

/// Scan `number`, counted from 1, in the scanner's own frame. Empty returns, which are at the origin, are
/// left out. A matrix that is not rigid is no pose. Throws `file_error`.
opened_scan open_ptx(input_file& file, std::size_t number, const scan_options& options);

/// Writes the file with other poses of some of its scans. Throws `file_error`.
void write_ptx_with_poses(input_file& file, std::span<const scan_pose> poses, std::ostream& out);

}  // namespace globalmatch::support
