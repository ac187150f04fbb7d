// The scans of a file, which may hold several.
#pragma once

#include <Eigen/Geometry>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <vector>

#include "support/point_source.hpp"

namespace globalmatch::support {

/// What `name#K` names, unless there is a file of that very name.
struct numbered_scan {
  std::filesystem::path path;
  std::optional<std::size_t> number;
};
numbered_scan parse_scan_name(const std::filesystem::path& name);

/// The pose of scan `number` of a file, counted from 1.
struct scan_pose {
  std::size_t number = 1;
  Eigen::Isometry3d survey_from_file = Eigen::Isometry3d::Identity();
};

/// The scans that a file holds: itself, or where it holds several `name#1`, `name#2` and so on. Throws
/// `file_error` when it cannot be read.
std::vector<std::filesystem::path> scans_in(const std::filesystem::path& path);

/// Opens the scan of a file, or one of its scans: `open_scan` without folders.
opened_scan open_numbered_scan(const std::filesystem::path& name, const scan_options& options = {});

}  // namespace globalmatch::support
