// Where the simulator's scanners stand, and the ways that mobile ones go.
#pragma once

#include "support/simulator/plot.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace globalmatch::support {

struct station_options {
  std::size_t count = 2;
  double distance = 12;         ///< [m] of all others from the first
  double scanner_height = 1.7;  ///< [m] above the ground
  double clearance = 0.7;       ///< [m] horizontal, between the scanner and the nearest stem
  double tilt = 0;              ///< [deg] of each scanner from the vertical, in a random direction
  std::uint64_t seed = 1;
};

/// Where a scanner stands, or where a mobile one starts.
struct station {
  Eigen::Isometry3d plot_from_scan = Eigen::Isometry3d::Identity();
  std::uint32_t number = 1;  ///< counts from 1; each station has random numbers of its own
};

/// The first station near the middle of the plot, the others spread evenly around it; each gives way to stems
/// and has a random yaw. Throws `std::invalid_argument` naming the field when an option makes no sense or no
/// free place is left.
std::vector<station> place_stations(const plot& scene, const station_options& options = {});

/// The way of a mobile scanner: a closed loop through the plot, another one for each station, in places
/// `step` [m] apart. What is nearer to a stem than the clearance is left out.
std::vector<Eigen::Vector3d> walk_path(const plot& scene, const station_options& options,
                                       std::uint32_t number, double step);

}  // namespace globalmatch::support
