// Cylinder by RANSAC (Fischler and Bolles 1981) over a few oriented points, then least squares ([GM] 3.1,
// which gives no values: the options are ours). In: points with normals in a levelled local frame. Out: the
// cylinder most of them lie on. Cost: iterations times points.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <stdexcept>

#include "globalmatch/detail/core/decompositions.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "globalmatch/detail/mapping/cylinder.hpp"
#include "globalmatch/detail/mapping/cylinder_fit.hpp"
#include "globalmatch/mapping_options.hpp"

namespace globalmatch::detail {

/// The direction that most normals are perpendicular to: that of the axis, if the points are of one stem.
inline vec3 common_direction(std::span<const vec3> normals) {
  mat3 moments;
  for (const vec3& n : normals) moments += outer(n, n);
  return symmetric_eigen(moments).vectors.col(0);
}

/// Sum of squared surface distances, cut off at the tolerance (MSAC); points inside count double, since a
/// laser does not see into a stem. Stops once it exceeds `enough`.
inline double surface_cost(const cylinder& c, std::span<const vec3> points, double tolerance, double enough) {
  const double cut = tolerance * tolerance;
  double cost = 0;
  for (const vec3& p : points) {
    const double d = c.surface_distance(p);
    cost += d < -tolerance ? 2 * cut : std::min(d * d, cut);
    if (cost >= enough) break;
  }
  return cost;
}

/// The cylinder that most of the points lie on, by RANSAC and then least squares. `normals` are unit, of any
/// sign. Nothing when no iteration gives a cylinder within the limits.
inline std::optional<cylinder> fit_cylinder(std::span<const vec3> points, std::span<const vec3> normals,
                                            const cylinder_options& options, random_source& random) {
  require_valid(options);
  if (points.size() != normals.size())
    throw std::invalid_argument("normals must hold one vector for each point");
  if (points.size() < 6) return std::nullopt;
  const double tolerance = options.distance_tolerance.value_or(default_distance_tolerance);
  const auto count = static_cast<std::uint32_t>(points.size());
  const vec3 common = common_direction(normals);

  std::optional<cylinder> best;
  double best_cost = std::numeric_limits<double>::infinity();
  for (int iteration = 0; iteration < options.max_iterations; ++iteration) {
    const std::uint32_t i = random.below(count), j = random.below(count), k = random.below(count);
    if (i == j || j == k || i == k) continue;
    // Normals of sparse points are noisy: their common direction, or up, then serves better than those of two
    // points.
    cylinder c;
    c.axis = iteration % 3 == 0 ? normals[i].cross(normals[j]) : iteration % 3 == 1 ? common : vec3{0, 0, 1};
    if (c.axis.norm() < 0.3) continue;
    c.axis = c.axis.normalized();
    if (c.axis.z < 0) c.axis = -c.axis;
    const vec3 u = c.axis.unit_orthogonal(), v = c.axis.cross(u);
    const auto in_plane = [&](const vec3& p) { return vec2{u.dot(p), v.dot(p)}; };
    const auto across = circle_through(in_plane(points[i]), in_plane(points[j]), in_plane(points[k]));
    if (!across) continue;
    c.point = u * across->center.x + v * across->center.y + c.axis * c.axis.dot(points[i]);
    c.radius = across->radius;
    if (!within_limits(c, options)) continue;
    const double cost = surface_cost(c, points, tolerance, best_cost);
    if (cost < best_cost) {
      best_cost = cost;
      best = c;
    }
  }
  if (!best) return std::nullopt;
  return refine_cylinder(*best, points, tolerance, options);
}

}  // namespace globalmatch::detail
