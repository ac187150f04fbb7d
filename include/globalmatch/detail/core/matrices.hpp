// Matrices of two and three rows as plain structs, with the bits of Eigen 3.4 (SSE2, no FMA).
#pragma once

#include "globalmatch/detail/core/vectors.hpp"

namespace globalmatch::detail {

/// Two by two, zero at first.
struct mat2 {
  vec2 columns[2];

  static constexpr mat2 identity() { return {{{1, 0}, {0, 1}}}; }
  constexpr double operator()(int r, int c) const { return columns[c][r]; }
  constexpr vec2 row(int r) const { return {columns[0][r], columns[1][r]}; }
  constexpr mat2& operator+=(const mat2& b) {
    return columns[0] += b.columns[0], columns[1] += b.columns[1], *this;
  }
  constexpr mat2& operator/=(double s) { return columns[0] /= s, columns[1] /= s, *this; }
  constexpr double trace() const { return columns[0].x + columns[1].y; }
  constexpr double determinant() const { return columns[0].x * columns[1].y - columns[0].y * columns[1].x; }
  /// Not finite when it is singular.
  constexpr mat2 inverse() const {
    const double s = 1 / determinant();
    return {{{columns[1].y * s, -columns[0].y * s}, {-columns[1].x * s, columns[0].x * s}}};
  }
};
constexpr mat2 operator/(mat2 a, double s) {
  return a /= s;
}
constexpr vec2 operator*(const mat2& a, const vec2& b) {
  return {a.row(0).dot(b), a.row(1).dot(b)};
}
/// a times b transposed.
constexpr mat2 outer(const vec2& a, const vec2& b) {
  return {{{a.x * b.x, a.y * b.x}, {a.x * b.y, a.y * b.y}}};
}
/// Counter-clockwise.
inline mat2 rotation_in_2d(double angle) {
  const double sine = std::sin(angle), cosine = std::cos(angle);
  return {{{cosine, sine}, {-sine, cosine}}};
}

/// Three by three, zero at first.
struct mat3 {
  vec3 columns[3];

  static constexpr mat3 identity() { return diagonal_of({1, 1, 1}); }
  static constexpr mat3 diagonal_of(const vec3& d) { return {{{d.x, 0, 0}, {0, d.y, 0}, {0, 0, d.z}}}; }
  /// From its rows.
  static constexpr mat3 rows_of(const vec3& a, const vec3& b, const vec3& c) {
    return mat3{{a, b, c}}.transpose();
  }
  constexpr double operator()(int r, int c) const { return columns[c][r]; }
  constexpr double& operator()(int r, int c) { return columns[c][r]; }
  constexpr vec3 col(int c) const { return columns[c]; }
  constexpr vec3 row(int r) const { return {columns[0][r], columns[1][r], columns[2][r]}; }
  constexpr vec3 diagonal() const { return {columns[0].x, columns[1].y, columns[2].z}; }
  friend constexpr bool operator==(const mat3& a, const mat3& b) {
    return a.columns[0] == b.columns[0] && a.columns[1] == b.columns[1] && a.columns[2] == b.columns[2];
  }
  constexpr mat3& operator+=(const mat3& b) {
    for (int c = 0; c < 3; ++c) columns[c] += b.columns[c];
    return *this;
  }
  constexpr mat3& operator-=(const mat3& b) {
    for (int c = 0; c < 3; ++c) columns[c] -= b.columns[c];
    return *this;
  }
  constexpr mat3& operator/=(double s) {
    for (vec3& column : columns) column /= s;
    return *this;
  }
  constexpr mat3 transpose() const { return {{row(0), row(1), row(2)}}; }
  constexpr double trace() const { return columns[0].x + (columns[1].y + columns[2].z); }
  constexpr double determinant() const {
    const vec3 &a = columns[0], &b = columns[1], &c = columns[2];
    return (a.x * (b.y * c.z - c.y * b.z) - b.x * (a.y * c.z - c.y * a.z)) + c.x * (a.y * b.z - b.y * a.z);
  }
  /// Determinant as the inverse takes it: expanded along the first column, with other bits.
  constexpr double determinant_of_inverse() const { return cofactors(0).dot(columns[0]); }
  /// Not finite when it is singular.
  constexpr mat3 inverse() const {
    const double s = 1 / determinant_of_inverse();
    return rows_of(cofactors(0) * s, cofactors(1) * s, cofactors(2) * s);
  }
  /// Whether there is an inverse: a determinant larger than the threshold.
  bool is_invertible(double threshold = 1e-12) const {
    return std::abs(determinant_of_inverse()) > threshold;
  }

 private:
  /// Of column c.
  constexpr vec3 cofactors(int c) const {
    const vec3 &a = columns[(c + 1) % 3], &b = columns[(c + 2) % 3];
    return {a.y * b.z - b.y * a.z, a.z * b.x - b.z * a.x, a.x * b.y - b.x * a.y};
  }
};
constexpr mat3 operator-(mat3 a, const mat3& b) {
  return a -= b;
}
constexpr mat3 operator/(mat3 a, double s) {
  return a /= s;
}
/// Eigen takes the first two rows as a register of two, and sums the third from the back.
constexpr vec3 operator*(const mat3& a, const vec3& b) {
  const vec3 &u = a.columns[0], &v = a.columns[1], &w = a.columns[2];
  return {(u.x * b.x + v.x * b.y) + w.x * b.z, (u.y * b.x + v.y * b.y) + w.y * b.z,
          u.z * b.x + (v.z * b.y + w.z * b.z)};
}
constexpr mat3 operator*(const mat3& a, const mat3& b) {
  return {{a * b.columns[0], a * b.columns[1], a * b.columns[2]}};
}
/// a.transpose() * b with the bits of that expression of Eigen, which sums all rows from the front.
constexpr vec3 transpose_times(const mat3& a, const vec3& b) {
  return {a.columns[0].dot(b), a.columns[1].dot(b), a.columns[2].dot(b)};
}
constexpr mat3 transpose_times(const mat3& a, const mat3& b) {
  return {
      {transpose_times(a, b.columns[0]), transpose_times(a, b.columns[1]), transpose_times(a, b.columns[2])}};
}
/// a times b transposed.
constexpr mat3 outer(const vec3& a, const vec3& b) {
  return {{a * b.x, a * b.y, a * b.z}};
}
inline bool is_finite(const mat3& a) {
  return is_finite(a.columns[0]) && is_finite(a.columns[1]) && is_finite(a.columns[2]);
}

}  // namespace globalmatch::detail
