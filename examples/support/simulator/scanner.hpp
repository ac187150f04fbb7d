// The simulator's laser scanners: what one would measure that stands in a plot, or is carried through it.
#pragma once

#include "support/simulator/plot.hpp"
#include "support/simulator/ray_caster.hpp"
#include "support/simulator/stations.hpp"

#include "globalmatch/execution.hpp"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace globalmatch::support {

struct scanner_options {
  double angular_step = 0.1;      ///< [deg] between rays, in azimuth and in elevation
  double min_elevation = -60;     ///< [deg] in the scanner's own frame
  double max_elevation = 85;      ///< [deg]
  double min_range = 0.5;         ///< [m] what is nearer hides the rest but returns nothing
  double max_range = 60;          ///< [m]
  double range_noise = 0.003;     ///< [m] standard deviation ...
  double noise_per_metre = 0;     ///< ... and what each metre of range adds to it
  double beam_radius = 0.002;     ///< [m] of the beam where it leaves the scanner
  double beam_divergence = 0.15;  ///< [mrad] half the angle by which it widens
  double mixed_pixels = 0.5;      ///< share of the beams split by an edge that return a range in between
  double multipath = 2e-5;        ///< share of the returns from the ground that come too late: low points
  std::uint64_t seed = 1;
};

struct mobile_options {
  double step = 0.1;                  ///< [m] along the way, from one place of the scanner to the next
  std::size_t rays_per_place = 5000;  ///< cast in random directions
  double drift = 0.02;                ///< [m] by which the trajectory is wrong half way round
};

struct simulated_scan {
  std::vector<Eigen::Vector3d> points = {};          ///< [m] in the scanner's frame
  std::vector<std::uint32_t> returns_per_stem = {};  ///< those that hit it 0.2 m to 3 m above the ground
  std::size_t rays = 0;                              ///< that were cast
};

/// Casts rays on a regular grid of azimuth and elevation; each returns the nearest surface it hits. The same
/// bits for any number of threads. Throws `std::invalid_argument` naming the field when an option makes no
/// sense, or the station stands below the ground.
simulated_scan scan_from(const station& from, const plot& scene, const ray_caster& caster,
                         const scanner_options& options = {}, const execution& exec = {});

/// The same for a scanner that is carried along `path` and turns so unevenly that the directions of its rays
/// are as good as random. `angular_step` is of no account. All points are in the frame of the station, save
/// for the drift.
simulated_scan scan_along(const std::vector<Eigen::Vector3d>& path, const station& from, const plot& scene,
                          const ray_caster& caster, const scanner_options& options,
                          const mobile_options& mobile = {}, const execution& exec = {});

}  // namespace globalmatch::support
