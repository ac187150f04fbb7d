// Rigid transforms as text: four lines of four numbers, the last 0 0 0 1.
#pragma once

#include <Eigen/Geometry>

#include <filesystem>
#include <functional>
#include <span>
#include <string>

namespace globalmatch::support {

/// Writes the matrix row by row; reading yields the same values again. Throws `file_error` when the file
/// cannot be written.
void write_transform(const std::filesystem::path& path, const Eigen::Isometry3d& target_from_source);

/// Reads a matrix row by row, as it stands in the file; numbers are separated by blanks, commas or
/// semicolons, brackets and lines that begin with # are passed over. Throws `file_error` unless there are 16
/// finite numbers, the last four 0 0 0 1, and the rotation is one to within 1e-5.
Eigen::Isometry3d read_transform(const std::filesystem::path& path);

/// Makes a transform of a matrix row by row. Calls `fail` with problem and remedy, which must throw, where it
/// is none as of `read_transform`.
Eigen::Isometry3d to_transform(
    std::span<const double> numbers,
    const std::function<void(const std::string& problem, const std::string& remedy)>& fail);

}  // namespace globalmatch::support
