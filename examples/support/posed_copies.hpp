// Copies of scan files in which a scan has another pose. Programs that apply the poses of E57 and PTX files,
// as CloudCompare does, then show it where it belongs.
#pragma once

#include <Eigen/Geometry>

#include <filesystem>

namespace globalmatch::support {

/// Whether a file of this name is such a copy, by its ending: .e57 or .ptx.
bool is_posed_copy(const std::filesystem::path& copy);

/// Throws `file_error` unless `source`, a file or one of its scans, can be copied so. To be asked before long
/// work.
void require_posed_copy(const std::filesystem::path& copy, const std::filesystem::path& source);

/// Copies the file of a scan with another pose of that scan, and the points to the bit. Throws `file_error`.
void write_posed_copy(const std::filesystem::path& copy, const std::filesystem::path& source,
                      const Eigen::Isometry3d& survey_from_file);

}  // namespace globalmatch::support
