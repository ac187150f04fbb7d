// The simulator's ground: a grid of heights, between which it is made of triangles.
#pragma once

#include "support/simulator/surfaces.hpp"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace globalmatch::support {

struct ground_options {
  double slope = 0;          ///< [deg] of the plane under all else, in a random direction
  double relief = 0.5;       ///< [m] sum of the amplitudes of long waves ...
  double wavelength = 20;    ///< [m] ... from half of this length to half as much again
  double hump_height = 0.2;  ///< [m] sum of the amplitudes of short waves, 1.5 m to 4 m
  double roughness = 0.015;  ///< [m] standard deviation from node to node of the grid
};

/// Ground over a rectangle around the origin.
class terrain {
 public:
  static constexpr double cell = 0.25;  ///< [m]

  /// Samples `height_at` over a rectangle of that half size [m].
  terrain(const Eigen::Vector2d& half_size, const std::function<double(const Eigen::Vector2d&)>& height_at);

  /// Height [m] of the triangle at a place [m]; beyond the rectangle that of its edge.
  double height(double x, double y) const;
  Eigen::Vector3d at(const Eigen::Vector2d& place) const {
    return {place.x(), place.y(), height(place.x(), place.y())};
  }

  quad_mesh mesh() const;

 private:
  double node(std::size_t column, std::size_t row) const { return heights_[row * columns_ + column]; }

  Eigen::Vector2d corner_;
  std::size_t columns_, rows_;
  std::vector<double> heights_;  ///< row by row
};

/// Random ground. Throws `std::invalid_argument` naming the field when an option makes no sense.
terrain make_terrain(const ground_options& options, const Eigen::Vector2d& half_size, std::uint64_t seed);

}  // namespace globalmatch::support
