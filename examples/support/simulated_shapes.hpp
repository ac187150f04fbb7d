// What the simulator's trees and shrubs are made of, and where rays hit them.
#pragma once

#include "globalmatch/random.hpp"

#include <Eigen/Core>

#include <limits>

namespace globalmatch::support {

struct ray {
  Eigen::Vector3d origin;
  Eigen::Vector3d direction;  ///< unit vector
};

/// Distance at which a ray that misses hits.
constexpr double no_hit = std::numeric_limits<double>::infinity();

/// The side of a truncated cone: a stem or a branch. Its ends are open.
struct frustum {
  Eigen::Vector3d bottom;
  Eigen::Vector3d top;
  double bottom_radius = 0;  ///< [m]
  double top_radius = 0;     ///< [m]
};

/// Leaves scattered evenly in an ellipsoid: a shrub or a crown.
struct leaf_cloud {
  Eigen::Vector3d centre;
  Eigen::Vector3d semi_axes;  ///< [m] along x, y and z
  double hits_per_metre = 0;  ///< leaves that a ray meets on average in one metre
};

/// Distance [m] along the ray at which it first hits the side of the cone, or `no_hit`.
double first_hit(const frustum& cone, const ray& r);

/// Distance [m] along the ray to the first leaf, at random, or `no_hit`.
double first_hit(const leaf_cloud& leaves, const ray& r, random_source& random);

}  // namespace globalmatch::support
