// The simulator's forest: a random plot, and places for scanners in it.
#pragma once

#include "support/height_field.hpp"
#include "support/simulated_shapes.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace globalmatch::support {

/// What a plot is like. The origin of the plot's frame is its middle, z is up.
struct plot_options {
  double width = 50;                  ///< [m] along x
  double depth = 50;                  ///< [m] along y
  double stems_per_hectare = 600;     ///< [1/ha]
  double min_spacing = 0.8;           ///< [m] between the positions of two stems
  double min_radius = 0.06;           ///< [m] of a stem at breast height, 1.3 m
  double max_radius = 0.22;           ///< [m]
  double min_height = 10;             ///< [m] of a stem
  double max_height = 20;             ///< [m]
  double max_lean = 3;                ///< [deg] of a stem from the vertical
  std::size_t branches_per_stem = 6;  ///< dead ones, within reach of a person
  double crown_density = 0.15;        ///< [1/m] hits on leaves along a ray; 0: no crowns
  double shrubs_per_hectare = 200;    ///< [1/ha]
  double relief = 0.5;                ///< [m] sum of the amplitudes of the waves in the ground
  double slope = 0;                   ///< [deg] of the plane under the waves
  std::uint64_t seed = 1;
};

struct simulated_stem {
  Eigen::Vector3d position;  ///< [m] where the axis meets the ground
  double radius = 0;         ///< [m] at breast height
  frustum trunk;
};

/// A forest plot. It may as well be put together by hand.
struct plot {
  double width = 0;  ///< [m] along x, half of it on either side of the origin
  double depth = 0;  ///< [m] along y
  height_field ground = {};
  std::vector<simulated_stem> stems = {};
  std::vector<frustum> branches = {};
  std::vector<leaf_cloud> leaves = {};  ///< shrubs and crowns
};

/// A random plot. Throws `std::invalid_argument` naming the field when an option makes no sense, or when the
/// stems cannot stand that densely.
plot grow_plot(const plot_options& options = {});

struct station_options {
  std::size_t count = 2;
  double distance = 10;         ///< [m] of all others from the first
  double scanner_height = 1.6;  ///< [m] above the ground
  double clearance = 0.7;       ///< [m] in plan between the scanner and the nearest stem or shrub
  std::uint64_t seed = 1;
};

/// Where a scanner stands: level, turned by some yaw.
struct station {
  Eigen::Isometry3d plot_from_scan;
  std::uint32_t number = 1;  ///< counts from 1; each station has random numbers of its own
};

/// The first station near the middle of the plot, the others spread evenly around it; each gives way to stems
/// and shrubs and has a random yaw. Throws `std::invalid_argument` naming the field when an option makes no
/// sense or no free place is left.
std::vector<station> place_stations(const plot& scene, const station_options& options = {});

}  // namespace globalmatch::support
