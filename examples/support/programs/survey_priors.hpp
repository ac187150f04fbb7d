// What was measured of the poses of scans before a survey: a table.
#pragma once

#include <globalmatch/survey_options.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace globalmatch::support {

/// What was measured of a scan, by its name; the number in `measured` is not set.
struct named_prior {
  std::string scan;
  survey_options::prior measured;
};

/// Reads `scan,x,y,z,yaw_deg,sigma_xy,sigma_z,sigma_yaw_deg`: position of the scan's origin [m], yaw
/// counter-clockwise from x, standard deviations along each axis. Columns may stand in any order, and all but
/// `scan` may be missing; empty is unknown. What has a value needs its standard deviation. Throws
/// `file_error` naming line and column.
std::vector<named_prior> read_priors(const std::filesystem::path& file);

}  // namespace globalmatch::support
