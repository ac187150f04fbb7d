// Stems that lean and taper, nowhere near the origin, and the ground that they stand on.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "globalmatch/detail/core/local_points.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "globalmatch/detail/mapping/cylinder.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/stem_map.hpp"
#include "indices.hpp"

namespace globalmatch::scenes {

using namespace detail;

/// A cylinder that leans and tapers, nowhere near the origin.
inline cylinder leaning_cylinder() {
  return {{7.3, -4.1, 12.2}, vec3{0.21, -0.13, 1}.normalized(), 0.23, 0.011};
}

/// Points on the surface of a cylinder, `low` to `high` [m] along it from `point`, over some of its turn.
inline std::vector<vec3> points_on(const cylinder& c, std::size_t count, double low, double high, double turn,
                                   random_source& random) {
  const vec3 u = c.axis.unit_orthogonal(), v = c.axis.cross(u);
  std::vector<vec3> points;
  for (std::size_t i = 0; i < count; ++i) {
    const double along = low + (high - low) * random.uniform(), angle = turn * random.uniform();
    const double radius = c.radius - c.taper * along;
    points.push_back(c.point + along * c.axis + (radius * std::cos(angle)) * u +
                     (radius * std::sin(angle)) * v);
  }
  return points;
}

inline local_points as_local_points(const std::vector<vec3>& points) {
  local_points result;
  for (std::size_t i = 0; i < points.size(); ++i)
    result.push_back(vec3f(points[i]), static_cast<point_index>(i));
  return result;
}

/// Ground at z = height(x, y) over 20 m by 20 m, a point in each node but for a hole.
template <class Height>
terrain ground_of(const Height& height, double hole_x, double hole_y, double hole) {
  terrain ground;
  ground.resolution = 0.5;
  ground.columns = ground.rows = 40;
  ground.first_ground.push_back(0);
  random_source random(77);
  for (int r = 0; r < ground.rows; ++r)
    for (int c = 0; c < ground.columns; ++c) {
      ground.heights.push_back(float(height((c + 0.5) * 0.5, (r + 0.5) * 0.5)));
      ground.has_data.push_back(1);
      for (int k = 0; k < 3; ++k) {
        const double x = (c + random.uniform()) * 0.5, y = (r + random.uniform()) * 0.5;
        if (std::hypot(x - hole_x, y - hole_y) >= hole)
          ground.ground.push_back(vec3f(vec3{x, y, height(x, y)}));
      }
      ground.first_ground.push_back(std::uint32_t(ground.ground.size()));
    }
  return ground;
}

}  // namespace globalmatch::scenes
