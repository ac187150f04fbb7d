// Points on cylinders with their normals, and how far a found cylinder is off.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "forest_scenes.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "globalmatch/detail/mapping/cylinder.hpp"

namespace globalmatch::scenes {

struct oriented_points {
  std::vector<vec3> points, normals;
};

inline vec3 unit_direction(random_source& random) {
  return from_eigen(random_direction(random));
}

/// Points on a cylinder with the normals of its surface, of either sign and a few degrees off.
inline oriented_points on_surface(random_source& random, const cylinder& c, std::size_t count,
                                  const seen_surface& seen) {
  oriented_points result;
  for (std::size_t i = 0; i < count; ++i) {
    const auto [outwards, p] = random_surface_point(random, c, seen);
    const vec3 normal = (outwards + 0.1 * unit_direction(random)).normalized();
    result.points.push_back(p);
    result.normals.push_back(i % 2 == 0 ? normal : -normal);
  }
  return result;
}

/// Largest distance [m] of two axes over 3 m from the point of the first.
inline double axis_error(const cylinder& truth, const cylinder& found) {
  double largest = 0;
  for (const double height : {0.0, 1.5, 3.0}) {
    const double z = truth.point.z + height;
    largest = std::max(largest, (truth.at_height(z) - found.at_height(z)).norm());
  }
  return largest;
}

}  // namespace globalmatch::scenes
