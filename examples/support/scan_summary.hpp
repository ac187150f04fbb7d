// What a look at all points of a scan shows: how many there are, where, and how dense.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <array>
#include <cstddef>
#include <optional>

#include "globalmatch/execution.hpp"
#include "support/class_counts.hpp"
#include "support/scan_files.hpp"

namespace globalmatch::support {

struct scan_summary {
  /// [m] from the scanner in plan, where density is measured.
  static constexpr std::array<double, 3> distances = {5, 10, 20};

  std::size_t points = 0;      ///< with coordinates, and not left out
  Eigen::AlignedBox3d extent;  ///< [m]; empty when there are no points
  /// [1/m^2] in plan, within half a metre of each distance; nothing where it is not known where the scanner
  /// was.
  std::optional<std::array<double, 3>> density;
  std::optional<class_counts> classes;  ///< nothing where the file has neither returns nor classes
};

/// One forward pass in parallel, and one more where there are classes. `scanner` is its place in the frame of
/// the scan; if not given the origin, unless that is outside of the scan. Throws `file_error` when the file
/// is damaged.
scan_summary summarise(const scan_file& scan, const std::optional<Eigen::Vector3d>& scanner,
                       const execution& exec = {});

}  // namespace globalmatch::support
