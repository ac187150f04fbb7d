// A simple simulator of terrestrial laser scans: what a scanner in a plot would measure.
#pragma once

#include "support/simulated_plot.hpp"

#include "globalmatch/execution.hpp"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace globalmatch::support {

struct scanner_options {
  double angular_step = 0.1;   ///< [deg] between rays, in azimuth and in elevation
  double min_elevation = -60;  ///< [deg]
  double max_elevation = 90;   ///< [deg]
  double min_range = 0.5;      ///< [m] what is nearer hides the rest but returns nothing
  double max_range = 60;       ///< [m]
  double range_noise = 0.003;  ///< [m] standard deviation
  std::uint64_t seed = 1;
};

struct simulated_scan {
  std::vector<Eigen::Vector3d> points;          ///< [m] in the scanner's frame
  std::vector<std::uint32_t> returns_per_stem;  ///< those that hit it 0.2 m to 3 m above the ground
  std::size_t rays = 0;                         ///< that were cast
};

/// Casts rays on a regular grid of azimuth and elevation; each returns the nearest surface it hits. The same
/// bits for any number of threads. Throws `std::invalid_argument` naming the field when an option makes no
/// sense, or the station is not level or stands below the ground.
simulated_scan scan_plot(const plot& scene, const station& from, const scanner_options& options = {},
                         const execution& how = {});

}  // namespace globalmatch::support
