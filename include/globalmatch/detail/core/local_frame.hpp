// A levelled frame near the points of a scan.
#pragma once

#include <cmath>
#include <stdexcept>

#include "globalmatch/detail/core/rigid.hpp"

namespace globalmatch::detail {

/// A levelled frame near the points: its z axis is `up`. For `up` = +z it only shifts, so that coordinates
/// stay exact.
struct local_frame {
  vec3 origin;                       ///< [m] in the frame of the scan
  mat3 rotation = mat3::identity();  ///< local from scan

  vec3 to_local(const vec3& p) const { return is_level() ? p - origin : rotation * (p - origin); }
  bool is_level() const { return rotation(2, 2) == 1; }  ///< it only shifts
  vec3 to_scan(const vec3& p) const { return transpose_times(rotation, p) + origin; }
  rigid local_from_scan() const { return {rotation, -(rotation * origin)}; }
};

/// Angle [rad] between two unit vectors, of any type with [0] [1] [2].
template <class A, class B>
double angle_between(const A& a, const B& b) {
  const vec3 u = vec3::from(a), v = vec3::from(b);
  return std::atan2(u.cross(v).norm(), u.dot(v));
}

/// Rotation that turns `up` into +z, by the shortest way. Throws `std::invalid_argument` when `up` is zero or
/// not finite.
inline mat3 levelling_rotation(const vec3& up) {
  if (!is_finite(up) || !(up.stable_norm() > 0))
    throw std::invalid_argument("up must be a finite vector other than zero");
  const vec3 u = up.stable_normalized();
  if (u.x == 0 && u.y == 0)  // straight up, or upside down: a half turn about x
    return mat3::diagonal_of({1, u.z, u.z});
  // Rodrigues' formula about u x z; its limit for u = -z is any half turn
  const double f = u.z > 0 ? 1 / (1 + u.z) : (1 - u.z) / (u.x * u.x + u.y * u.y);
  return mat3::rows_of({1 - f * u.x * u.x, -f * u.x * u.y, -u.x},  //
                       {-f * u.x * u.y, 1 - f * u.y * u.y, -u.y},  //
                       u);
}

}  // namespace globalmatch::detail
