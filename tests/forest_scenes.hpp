// Made-up scans: ground, stems and shrubs as points, all with coordinates that float holds exactly.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/local_points.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "globalmatch/detail/mapping/cylinder.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch::scenes {

using namespace detail;

using cloud = std::vector<Eigen::Vector3f>;

constexpr float nan = std::numeric_limits<float>::quiet_NaN(),
                infinity = std::numeric_limits<float>::infinity();

/// Coordinates in whole 1/1024 m.
inline Eigen::Vector3f exact(const Eigen::Vector3d& p) {
  return (p * 1024).array().round().matrix().cast<float>() / 1024;
}

inline double in_range(random_source& random, double from, double to) {
  return from + (to - from) * random.uniform();
}

inline Eigen::Vector3d random_direction(random_source& random) {
  return Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
}

/// The internals' types of points.
inline std::vector<vec3> as_vec3(const std::vector<Eigen::Vector3d>& points) {
  std::vector<vec3> result;
  for (const Eigen::Vector3d& p : points) result.push_back(from_eigen(p));
  return result;
}
inline Eigen::Vector3d in_double(const vec3f& p) {
  return to_eigen(vec3(p));
}

/// A plane through the origin of the given slope [degrees] towards the azimuth [degrees].
struct slope {
  double degrees = 0, azimuth = 0;
  double operator()(double x, double y) const {
    const double angle = azimuth * std::numbers::pi / 180;
    return std::tan(degrees * std::numbers::pi / 180) * (std::cos(angle) * x + std::sin(angle) * y);
  }
};

/// A plane over 20 m x 20 m.
inline terrain sloped_terrain(const scenes::slope& plane) {
  terrain ground;
  ground.resolution = 0.5;
  ground.columns = ground.rows = 40;
  for (int r = 0; r < 40; ++r)
    for (int c = 0; c < 40; ++c)
      ground.heights.push_back(static_cast<float>(plane((c + 0.5) * 0.5, (r + 0.5) * 0.5)));
  ground.has_data.assign(ground.heights.size(), 1);
  return ground;
}

/// Ground points over [0, size] x [0, size], `spacing` apart, each a little off its place.
template <class Height>
cloud ground_points(random_source& random, double size, double spacing, double noise, const Height& height) {
  cloud points;
  for (double x = 0; x < size; x += spacing)
    for (double y = 0; y < size; y += spacing) {
      const double px = x + in_range(random, 0, spacing), py = y + in_range(random, 0, spacing);
      points.push_back(exact({px, py, height(px, py) + noise * random.normal()}));
    }
  return points;
}

/// The stretch of a cylinder that a scan may see.
struct seen_surface {
  double from = 0, to = 3;            ///< [m] along the axis, from the cylinder's point
  double arc = 2 * std::numbers::pi;  ///< [rad] share of the round that is seen
  double noise = 0;                   ///< [m] standard deviation across the surface
};

/// Unit vectors from the axis to random points of the surface of a cylinder, and these points.
inline std::pair<vec3, vec3> random_surface_point(random_source& random, const cylinder& c,
                                                  const seen_surface& seen) {
  const vec3 u = c.axis.unit_orthogonal(), v = c.axis.cross(u);
  const double angle = in_range(random, 0, seen.arc);
  const vec3 outwards = std::cos(angle) * u + std::sin(angle) * v;
  const double distance = c.radius + seen.noise * random.normal();
  return {outwards, c.point + distance * outwards + in_range(random, seen.from, seen.to) * c.axis};
}

inline cloud stem_points(random_source& random, const cylinder& c, std::size_t count,
                         const seen_surface& seen = {}) {
  cloud points;
  for (std::size_t i = 0; i < count; ++i)
    points.push_back(exact(to_eigen(random_surface_point(random, c, seen).second)));
  return points;
}

/// A ball of leaves.
inline cloud shrub_points(random_source& random, const Eigen::Vector3d& center, double radius,
                          std::size_t count) {
  cloud points;
  for (std::size_t i = 0; i < count; ++i)
    points.push_back(exact(center + radius * std::cbrt(random.uniform()) * random_direction(random)));
  return points;
}

inline cylinder upright(double x, double y, double z, double radius) {
  return {{x, y, z}, {0, 0, 1}, radius, 0};
}

inline cylinder leaning(double x, double y, double z, double radius, double lean, double azimuth) {
  const Eigen::AngleAxisd tilt(lean * std::numbers::pi / 180, Eigen::Vector3d::UnitY());
  const Eigen::AngleAxisd turn(azimuth * std::numbers::pi / 180, Eigen::Vector3d::UnitZ());
  return {{x, y, z}, from_eigen(turn * tilt * Eigen::Vector3d::UnitZ()), radius, 0};
}

inline void append(cloud& points, const cloud& more) {
  points.insert(points.end(), more.begin(), more.end());
}

/// The same points as the mapping steps share them, in the frame they are in.
inline local_points as_local(const cloud& points) {
  local_points result;
  for (const Eigen::Vector3f& p : points)
    result.push_back(vec3f(vec3::from(p)), static_cast<point_index>(result.size()));
  return result;
}

/// A plot of 16 m by 16 m with fifteen stems.
struct small_plot {
  cloud ground, stems;

  explicit small_plot(std::uint64_t seed = 1) {
    random_source random(seed);
    ground = ground_points(random, 16, 0.1, 0.005, slope{5, 30});
    for (int i = 0; i < 15; ++i) {
      const double x = in_range(random, 1, 15), y = in_range(random, 1, 15);
      const double z = slope{5, 30}(x, y);
      append(stems, stem_points(random, upright(x, y, z, 0.12), 1500, {.from = 0, .to = 4, .noise = 0.003}));
    }
  }

  cloud scan() const {
    cloud both = ground;
    append(both, stems);
    return both;
  }
};

inline cloud random_cloud(random_source& random, std::size_t count, double size) {
  cloud points;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = in_range(random, 0, size), y = in_range(random, 0, size), z = in_range(random, 0, size);
    points.push_back(exact({x, y, z}));
  }
  return points;
}

/// Points on the lattice of whole metres: full of equal distances.
inline cloud lattice_cloud(int side) {
  cloud points;
  for (int x = 0; x < side; ++x)
    for (int y = 0; y < side; ++y)
      for (int z = 0; z < side; ++z) points.push_back(Eigen::Vector3i(x, y, z).cast<float>());
  return points;
}

}  // namespace globalmatch::scenes
