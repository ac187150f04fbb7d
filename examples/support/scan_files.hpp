// Files of points: scans in the formats that forest scanners and their programs write.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace globalmatch::support {

/// Points that a file marks as no good: LAS classes 7 and 18 (noise), and the withheld flag.
struct marked_points {
  bool keep = false;         ///< read them too
  std::size_t noise = 0;     ///< how many were of the noise classes; counted by the reader
  std::size_t withheld = 0;  ///< how many others were withheld
};

/// All points of a scan, in the order and the frame of the file; NaN points of organised clouds are kept. The
/// format is recognised by content, whatever the name: PLY, PCD, uncompressed LAS, PTX of one scan, or text
/// with x, y and z in the columns that a header names so, or in the first three where there is none. A header
/// that names no coordinates is refused. A scan may have no points. Throws `file_error` when the file cannot
/// be read or is damaged, and for LAZ and E57 with the command that converts them.
std::vector<Eigen::Vector3d> read_scan(const std::filesystem::path& path);

/// The same. Points that the file marks are left out unless they are to be kept, and counted.
std::vector<Eigen::Vector3d> read_marked_scan(const std::filesystem::path& path, marked_points& marked);

using rgb = std::array<std::uint8_t, 3>;

/// Writes a binary little endian PLY; coordinates are float where that keeps 0.1 mm, else double. Throws
/// `file_error` when the file cannot be written, and `std::invalid_argument` when there are colours but not
/// one for each point.
void write_ply(const std::filesystem::path& path, std::span<const Eigen::Vector3d> points,
               std::span<const rgb> colours = {});

}  // namespace globalmatch::support
