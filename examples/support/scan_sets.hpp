// Folders of scans, and scans in several files.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "support/point_source.hpp"

namespace globalmatch::support {

/// The scans that names stand for, in their order: of a pattern with `*` or `?`, unless there is a file of
/// that name, the files and folders that it matches, by name; of a folder the files in it whose extension is
/// that of a scan (.ply .pcd .las .laz .e57 .ptx .pts .xyz), by name; of a file of several scans each of
/// them. Text with other extensions is often no scan, and must be named itself. Folders are kept as they are
/// where each is one scan in tiles. Throws `file_error`, also for a folder without scans and a pattern
/// without matches.
std::vector<std::filesystem::path> find_scans(const std::vector<std::filesystem::path>& names,
                                              bool keep_folders = false);

/// Whether a folder holds files whose extension is that of a scan.
bool holds_scans(const std::filesystem::path& folder);

/// What results for a scan are named by: the name of its file without extension, and `_K` for scan K of
/// several.
std::string name_of(const std::filesystem::path& scan);

/// One scan whose points are those of all scans of a folder, in one frame, one file after the other. Throws
/// `file_error`.
opened_scan open_tiles(const std::filesystem::path& folder, const scan_options& options = {});

}  // namespace globalmatch::support
