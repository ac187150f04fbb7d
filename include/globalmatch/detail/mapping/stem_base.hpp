// The foot of a stem ([GM] 3.1): where its axis meets the terrain, and the ground there, which the stem
// hides. In: a cylinder or a place, and the terrain, local frame. Out: a position or a height with its
// uncertainty.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "globalmatch/detail/core/matrices.hpp"
#include "globalmatch/detail/mapping/cylinder.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

/// Where the axis meets the terrain, local frame; nothing when that lies beyond the raster.
inline std::optional<vec3> intersect_terrain(const cylinder& c, const terrain& ground) {
  constexpr int max_iterations = 20;
  constexpr double close_enough = 1e-9;  // [m]
  vec3 p = c.point;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    if (!ground.covers(p.x, p.y)) return std::nullopt;
    const double z = ground.interpolated_height(p.x, p.y);
    const double step = std::abs(z - p.z);
    p = c.at_height(z);
    if (step < close_enough) break;
  }
  if (!ground.covers(p.x, p.y)) return std::nullopt;
  return p;
}

/// Number of ground points within 1 m of (x, y), of the 50 cells there. Of a scan that was cut off only those
/// count that lie in a surface.
inline std::uint32_t count_ground_near(const terrain& ground, double x, double y) {
  constexpr double radius = 1;  // [m]
  std::uint32_t count = 0;
  ground.for_each_ground_near(x, y, radius, [&](const vec3f& p) {
    const bool counts = !ground.cut_off || ground.in_surface.empty() || ground.is_in_surface(p.x, p.y);
    count += counts && vec2{p.x - x, p.y - y}.squared_norm() < radius * radius;
  });
  return count;
}

/// [m] Standard deviation of a height where nothing is known of the ground: it is that of some branch.
constexpr double unknown_height_sigma = 5;
/// [m] The same of heights above the ground that the caller made.
constexpr double normalised_height_sigma = 0.1;

/// [m] Standard deviation of the height of the ground where `points` ground points lie within 1 m, of which
/// one by least squares alone is `fitted`. What is taken for ground where little of it is seen lies too high:
/// points that agree with each other do not show it (ours, from seeds 1 and 2; docs/constants.md).
inline double height_uncertainty(double fitted, std::uint32_t points) {
  constexpr double scale = 2.4, offset = 1.6, power = 1.25;  // [m], points: 1.3 m at none, 2 cm at 45
  return std::hypot(fitted, scale * std::pow(double(points) + offset, -power));
}

/// Height of the ground at a stem, and how sure it is.
struct ground_height {
  double height = 0;  ///< [m] local frame
  double sigma = 0;   ///< [m]
};

/// The ground at (x, y) where a stem of `radius` [m] stands: a plane through the ground points around it,
/// without those that the foot of the stem lifts, and without what stands out upwards. A point tells the less
/// of the foot the further away it lies: its variance grows with the fourth power of that. Where too few are
/// seen near by they are sought further away; nothing when there are none within `max_radius` metres.
inline std::optional<ground_height> ground_at(const terrain& ground, double x, double y, double radius) {
  constexpr double nearest = 1, max_radius = 8;  // [m]
  constexpr double root_flare = 0.07;            // [m] around the stem
  constexpr double kernel = 0.2;                 // [m] at this distance points count a quarter
  constexpr double roughness = 0.02;             // [m] of a forest floor, from one step to the next
  constexpr double ridge = 3e-3;                 // [m^2] holds the slope down where points do not spread
  constexpr double calibration = 0.6;            // of the standard deviation that these variances make
  constexpr int max_iterations = 4;
  constexpr std::size_t min_points = 8;
  std::vector<vec3> around;  // from the foot
  for (double search_radius = nearest; search_radius <= max_radius && around.size() < min_points;
       search_radius *= 2) {
    around.clear();
    ground.for_each_ground_near(x, y, search_radius, [&](const vec3f& p) {
      const vec3 d{p.x - x, p.y - y, p.z};
      const double distance = d.xy().norm();
      if (distance > radius + root_flare && distance < search_radius) around.push_back(d);
    });
  }
  if (around.size() < 3) return std::nullopt;
  std::optional<ground_height> found;
  for (int iteration = 0; iteration < max_iterations && around.size() >= 3; ++iteration) {
    mat3 normal;
    vec3 right;
    double weights = 0;
    const double reference = around.front().z;
    const auto weight = [&](const vec3& d) {
      const double growth = 1 + d.xy().squared_norm() / (kernel * kernel);
      return 1 / (growth * growth);
    };
    for (const vec3& d : around) {
      const vec3 row{1, d.x, d.y};
      normal += outer(weight(d) * row, row);
      right += weight(d) * row * (d.z - reference);
      weights += weight(d);
    }
    normal(1, 1) += ridge * weights;
    normal(2, 2) += ridge * weights;
    const mat3 inverse = normal.inverse();
    const vec3 plane = inverse * right;
    const auto residual = [&](const vec3& d) { return d.z - reference - plane.dot({1, d.x, d.y}); };
    double squares = 0;
    for (const vec3& d : around) squares += weight(d) * residual(d) * residual(d);
    const double noise = std::sqrt(squares / weights);
    found = {reference + plane.x,
             calibration * std::max(noise, roughness) * std::sqrt(std::max(inverse(0, 0), 0.0))};
    const double limit = 1.2 * std::max(roughness, noise);
    if (std::erase_if(around, [&](const vec3& d) { return residual(d) > limit; }) == 0) break;
  }
  return found;
}

}  // namespace globalmatch::detail
