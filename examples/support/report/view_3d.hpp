// What the 3-D view of a report shows: points of scans in few bytes, and where they are placed.
#pragma once

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include <span>
#include <string>
#include <vector>

#include "support/scan_files.hpp"
#include "support/voxel_sample.hpp"

namespace globalmatch::support {

struct view_scan {
  std::string name;
  rgb colour = {};
  std::vector<sampled_point> points;  ///< frame of the scan
};

/// All scans in one frame, whose z is up.
struct view_placement {
  std::string label;
  std::vector<Eigen::Isometry3d> view_from_scan;
};

/// `scans[{name,colour,count,low,step,points}]`: `points` are four integers of 16 bit each, little endian, in
/// base64: x, y and z in steps of `step` from `low`, and the height above the ground [cm].
/// `placements[{label,matrices}]`: of each scan 16 numbers, row by row, about the middle of the first one.
nlohmann::ordered_json describe_view(std::span<const view_scan> scans,
                                     std::span<const view_placement> placements);

/// Bytes as text (RFC 4648).
std::string base64(std::span<const unsigned char> bytes);

}  // namespace globalmatch::support
