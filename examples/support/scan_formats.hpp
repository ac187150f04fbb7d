// Internal to `read_scan`: one reader for each format. Each starts at the first byte of the file, returns all
// its points, and throws `file_error`.
#pragma once

#include <Eigen/Core>

#include <string_view>
#include <vector>

#include "support/input_file.hpp"
#include "support/scan_files.hpp"

namespace globalmatch::support {

/// PLY: ascii, binary little and big endian.
std::vector<Eigen::Vector3d> read_ply(input_file& file);

/// PCD: ascii, binary, binary_compressed.
std::vector<Eigen::Vector3d> read_pcd(input_file& file);

/// LAS 1.0 to 1.4. Points marked as noise or withheld are left out unless they are to be kept, and counted.
/// Compressed files (LAZ) are refused with the command that converts them.
std::vector<Eigen::Vector3d> read_las(input_file& file, marked_points& marked);

/// Whether the first lines of a file are those of a PTX file: columns and rows of a scan, and its pose.
bool looks_like_ptx(std::string_view start);

/// PTX of one scan, in the scanner's own frame. Empty returns, which are at the origin, are left out. Files
/// of several scans are refused.
std::vector<Eigen::Vector3d> read_ptx(input_file& file);

/// Lines of x, y, z and what else there may be: XYZ, CSV, TXT, PTS.
std::vector<Eigen::Vector3d> read_text(input_file& file);

}  // namespace globalmatch::support
