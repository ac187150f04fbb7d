// Rotations and rigid transforms as plain structs, with the bits of Eigen 3.4 (SSE2, no FMA).
#pragma once

#include "globalmatch/detail/core/matrices.hpp"

namespace globalmatch::detail {

/// Counter-clockwise about a unit axis, by Rodrigues' formula.
inline mat3 rotation_about(const vec3& axis, double angle) {
  const double cosine = std::cos(angle);
  const vec3 s = std::sin(angle) * axis, c = (1 - cosine) * axis;
  const double xy = c.x * axis.y, xz = c.x * axis.z, yz = c.y * axis.z;
  return mat3::rows_of({c.x * axis.x + cosine, xy - s.z, xz + s.y},  //
                       {xy + s.z, c.y * axis.y + cosine, yz - s.x},  //
                       {xz - s.y, yz + s.x, c.z * axis.z + cosine});
}

/// Counter-clockwise about z. Its last number is 1 but for rounding, as Eigen's is.
inline mat3 rotation_about_z(double angle) {
  return rotation_about({0, 0, 1}, angle);
}

/// Angle [rad] of a rotation, 0 to pi, by way of its quaternion (Shoemake 1987): exact for small ones too.
inline double rotation_angle(const mat3& r) {
  double w = 0;
  vec3 v;
  if (const double trace = r.trace(); trace > 0) {
    const double root = std::sqrt(trace + 1.0), scale = 0.5 / root;
    w = 0.5 * root;
    v = {(r(2, 1) - r(1, 2)) * scale, (r(0, 2) - r(2, 0)) * scale, (r(1, 0) - r(0, 1)) * scale};
  } else {
    int i = r(1, 1) > r(0, 0) ? 1 : 0;
    if (r(2, 2) > r(i, i)) i = 2;
    const int j = (i + 1) % 3, k = (j + 1) % 3;
    const double root = std::sqrt(r(i, i) - r(j, j) - r(k, k) + 1.0), scale = 0.5 / root;
    w = (r(k, j) - r(j, k)) * scale;
    v[i] = 0.5 * root;
    v[j] = (r(j, i) + r(i, j)) * scale;
    v[k] = (r(k, i) + r(i, k)) * scale;
  }
  double n = v.norm();
  if (n < 0x1p-52) n = v.stable_norm();
  return n != 0 ? 2 * std::atan2(n, std::abs(w)) : 0;
}

/// Rotation, then translation [m]. The identity at first.
struct rigid {
  mat3 rotation = mat3::identity();
  vec3 translation;

  static constexpr rigid identity() { return {}; }
  /// Turn [rad] about the vertical through a place.
  static rigid turn_about(const vec3& center, double angle) {
    const mat3 turn = rotation_about_z(angle);
    return {turn, turn * -center + (vec3{} + center)};  // Eigen's sum, whose zeros are not negative
  }
  /// The rotation's transpose stands for its inverse.
  constexpr rigid inverse() const {
    const mat3 back = rotation.transpose();
    return {back, -(back * translation)};
  }
};

/// Sums all rows from the front, unlike the product of matrix and vector.
constexpr vec3 operator*(const rigid& a, const vec3& b) {
  const vec3 &u = a.rotation.columns[0], &v = a.rotation.columns[1], &w = a.rotation.columns[2];
  const vec3& t = a.translation;
  return {((u.x * b.x + v.x * b.y) + w.x * b.z) + t.x, ((u.y * b.x + v.y * b.y) + w.y * b.z) + t.y,
          ((u.z * b.x + v.z * b.y) + w.z * b.z) + t.z};
}
constexpr rigid operator*(const rigid& a, const rigid& b) {
  return {a.rotation * b.rotation, a.rotation * b.translation + a.translation};
}
/// `a`, then a shift [m]: Translation3d(shift) * a.
constexpr rigid shifted_after(const rigid& a, const vec3& shift) {
  return {a.rotation, shift + a.translation};
}
/// A shift [m], then `a`: a * Translation3d(shift).
constexpr rigid shifted_before(const rigid& a, const vec3& shift) {
  return {a.rotation, a.rotation * shift + a.translation};
}
inline bool is_finite(const rigid& a) {
  return is_finite(a.rotation) && is_finite(a.translation);
}

}  // namespace globalmatch::detail
