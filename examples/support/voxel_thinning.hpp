// Several scans in one frame, of which one point a voxel is kept.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "support/scan_writer.hpp"

namespace globalmatch::support {

/// Voxels that are held in memory at once: 16 bytes each.
inline constexpr std::size_t max_voxels_in_memory = std::size_t(1) << 24;

/// Which points of each scan are the first one in their voxel of `voxel` [m], in the order of the scans and
/// of their points; the same for any number of threads. Memory is a bit a point, and that of `max_voxels`
/// voxels: where the scans fill more, they are passed again for one part of the ground plan after the other,
/// each scan for the parts in which it has points. Throws `file_error` where a scan cannot be read, and
/// `std::invalid_argument` for voxels so small that the scans are more than two million of them wide.
std::vector<std::vector<bool>> first_in_voxels(std::span<const placed_scan> scans, double voxel, int threads,
                                               std::size_t max_voxels = max_voxels_in_memory);

/// The scan with these of its points alone; the others are left out. Refers to both.
scan_file with_points(const scan_file& scan, const std::vector<bool>& kept);

}  // namespace globalmatch::support
