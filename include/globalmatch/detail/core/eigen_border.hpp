// Between the internals' plain structs and Eigen's types, which the public face speaks.
#pragma once

#include <Eigen/Geometry>

#include <cmath>
#include <stdexcept>
#include <string>

#include "globalmatch/detail/core/rigid.hpp"

namespace globalmatch::detail {

inline Eigen::Vector2d to_eigen(const vec2& v) {
  return Eigen::Vector2d(v.x, v.y);
}
inline Eigen::Vector3d to_eigen(const vec3& v) {
  return Eigen::Vector3d(v.x, v.y, v.z);
}
inline Eigen::Isometry3d to_eigen(const rigid& t) {
  Eigen::Isometry3d result;
  double* const out = result.data();
  for (int c = 0; c < 3; ++c) {
    for (int r = 0; r < 3; ++r) out[4 * c + r] = t.rotation(r, c);
    out[4 * c + 3] = 0;
    out[12 + c] = t.translation[c];
  }
  out[15] = 1;
  return result;
}

inline vec3 from_eigen(const Eigen::Vector3d& v) {
  return {v.data()[0], v.data()[1], v.data()[2]};
}
inline rigid from_eigen(const Eigen::Isometry3d& t) {
  const double* const in = t.data();
  rigid result;
  for (int c = 0; c < 3; ++c) {
    for (int r = 0; r < 3; ++r) result.rotation(r, c) = in[4 * c + r];
    result.translation[c] = in[12 + c];
  }
  return result;
}

/// Throws `std::invalid_argument` naming what is no rotation and shift.
inline void require_rigid(const Eigen::Isometry3d& transform, const char* name) {
  constexpr double tolerance = 1e-6, max_shift = 1e12;  // [m]
  const rigid t = from_eigen(transform);
  const vec3 &x = t.rotation.columns[0], &y = t.rotation.columns[1], &z = t.rotation.columns[2];
  const bool rotates = std::abs(x.norm() - 1) < tolerance && std::abs(y.norm() - 1) < tolerance &&
                       (x.cross(y) - z).norm() < tolerance;
  if (!rotates || !is_finite(t.translation) || t.translation.max_abs() > max_shift)
    throw std::invalid_argument(std::string(name) + " must be a rotation and a shift of less than 1e12 m");
}

}  // namespace globalmatch::detail
