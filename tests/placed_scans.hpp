// Scans of a survey as it describes them once they are placed.
#pragma once

#include <Eigen/Geometry>

#include "globalmatch/survey_options.hpp"

namespace globalmatch::scenes {

/// A scan of the first component at a place of the survey's frame, its height known, with as large a variance
/// in all that is uncertain.
inline survey::scan placed_scan(const Eigen::Vector3d& place, double variance) {
  survey::scan scan;
  scan.status = survey::status::placed;
  scan.component = 0;
  scan.is_height_known = true;
  scan.survey_from_scan.translation() = place;
  scan.uncertainty =
      transform_uncertainty{place, Eigen::Vector3d::UnitZ(), Eigen::Matrix4d::Identity() * variance};
  return scan;
}

}  // namespace globalmatch::scenes
