// The points of a scan that a report shows, in one pass over it.
#pragma once

#include <globalmatch/stem_map.hpp>

#include <Eigen/Geometry>

#include <cstddef>
#include <optional>
#include <vector>

#include "support/scan_files.hpp"
#include "support/voxel_sample.hpp"

namespace globalmatch::support {

/// A vertical slab, from the origin of its frame along x; y is across, z up.
struct vertical_section {
  Eigen::Isometry3d section_from_scan = Eigen::Isometry3d::Identity();
  double length = 0, half_width = 0;  ///< [m]
};

struct scan_sample {
  std::vector<sampled_point> understory;  ///< frame of the scan
  std::vector<sampled_point> section;     ///< frame of the section
};

/// Evenly picked points of the understory, at most so many, and of a section, up to some metres above the
/// ground. Points beside the terrain of the map are left out. Throws `file_error`.
scan_sample sample_of(const scan_file& scan, const terrain& ground, std::size_t max_understory,
                      const std::optional<vertical_section>& section);

}  // namespace globalmatch::support
