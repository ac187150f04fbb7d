// Copies of scan files in which a scan has another pose. Programs that apply the poses of E57 and PTX files,
// as CloudCompare does, then show it where it belongs.
#pragma once

#include <Eigen/Geometry>

#include <filesystem>
#include <span>

#include "support/numbered_scans.hpp"

namespace globalmatch::support {

/// Whether a file of this name is such a copy, by its ending: .e57 or .ptx.
bool is_posed_copy(const std::filesystem::path& copy);

/// Whether a file is E57 or PTX, by its content. Throws `file_error` when it cannot be read.
bool is_posed_file(const std::filesystem::path& file);

/// Throws `file_error` where `file`, E57 or PTX, cannot be copied so, as it is text in UTF-16.
void require_rewritable(const std::filesystem::path& copy, const std::filesystem::path& file);

/// Throws `file_error` unless `source`, a file or one of its scans, can be copied so. To be asked before long
/// work.
void require_posed_copy(const std::filesystem::path& copy, const std::filesystem::path& source);

/// Copies a file with other poses of some of its scans, and the points to the bit. Throws `file_error`.
void write_posed_copy(const std::filesystem::path& copy, const std::filesystem::path& file,
                      std::span<const scan_pose> poses);

/// The same for one scan, `file#K` or the only one of its file.
void write_posed_copy(const std::filesystem::path& copy, const std::filesystem::path& source,
                      const Eigen::Isometry3d& survey_from_file);

}  // namespace globalmatch::support
