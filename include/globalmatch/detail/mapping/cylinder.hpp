// A cylinder, slightly tapered as stems are, in a levelled local frame.
#pragma once

#include <cmath>
#include <numbers>
#include <optional>

#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/mapping_options.hpp"

namespace globalmatch::detail {

/// Tolerance where neither the options nor the scan give one.
constexpr double default_distance_tolerance = 0.02;  // [m]

/// An endless cylinder.
struct cylinder {
  vec3 point;          ///< [m] a point on the axis
  vec3 axis{0, 0, 1};  ///< unit, pointing up
  double radius = 0;   ///< [m] at `point`
  double taper = 0;    ///< [m/m] by which it grows thinner upwards

  /// Distance [m] of p from the axis.
  double axis_distance(const vec3& p) const { return axis.cross(p - point).norm(); }
  /// Signed distance [m] of p from the surface, negative inside.
  double surface_distance(const vec3& p) const {
    return axis_distance(p) - radius + taper * axis.dot(p - point);
  }
  /// Radius [m] where the axis passes height z; requires an axis that is not horizontal.
  double radius_at_height(double z) const { return radius - taper * (z - point.z) / axis.z; }
  /// Where the axis passes height z; requires an axis that is not horizontal.
  vec3 at_height(double z) const { return point + axis * ((z - point.z) / axis.z); }
};

inline bool within_limits(const cylinder& c, const cylinder_options& options) {
  return c.radius >= options.min_radius && c.radius <= options.max_radius &&
         c.axis.z >= std::cos(options.max_tilt_deg * std::numbers::pi / 180);
}

/// A circle in a plane.
struct circle {
  vec2 center;
  double radius = 0;
};

/// Circle through three points; nothing when they are collinear.
inline std::optional<circle> circle_through(const vec2& a, const vec2& b, const vec2& c) {
  const vec2 u = b - a, v = c - a;
  const double cross = u.x * v.y - u.y * v.x;
  if (std::abs(cross) < 1e-9) return std::nullopt;
  const vec2 center =
      vec2{v.y * u.squared_norm() - u.y * v.squared_norm(), u.x * v.squared_norm() - v.x * u.squared_norm()} /
      (2 * cross);
  return circle{{a.x + center.x, a.y + center.y}, center.norm()};
}

}  // namespace globalmatch::detail
