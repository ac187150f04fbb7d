// Several scans in one file and one frame.
#pragma once

#include <Eigen/Geometry>

#include <filesystem>
#include <span>

#include "support/scan_files.hpp"

namespace globalmatch::support {

/// A scan, and where it goes. Text was opened with `scan_options::attributes`, if those are to be written.
struct placed_scan {
  const scan_file* scan;
  Eigen::Isometry3d target_from_scan;
  rgb colour;  ///< where the format has no place for the number of a scan
};

/// Throws `file_error` for an extension that is not .ply, .las or .laz.
void require_scan_format(const std::filesystem::path& path);

/// Writes the points of all scans that are not left out, one scan behind the other, with all of their
/// attributes. Points are read, transformed and written in blocks: what is in memory does not grow with them.
/// By the extension of the file:
/// - .ply: binary little endian; coordinates are double; red, green and blue are the colour of the scan, and
///   colours of its points are `point_red` and so on.
/// - .las, .laz: version 1.2, and 1.4 where an attribute needs it. Steps and offsets of the coordinates are
///   those of the first scan, or finer if another has finer ones, and 0.1 mm where none has any; steps are
///   coarser, up to 1 cm, where 32 bits do not hold the extent. Attributes without a place of their own in
///   LAS are extra bytes; so is `scan`, the number of the scan from 1 on.
/// Throws `file_error` when a file cannot be read or written; then nothing is left behind.
void write_scans(const std::filesystem::path& path, std::span<const placed_scan> scans, int threads = 0);

}  // namespace globalmatch::support
