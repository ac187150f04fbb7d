// Small vectors as plain structs: the internals compute with them, because they compile in a fraction of the
// time of Eigen's. Each operation has the bits of Eigen 3.4 (SSE2, no FMA): the order of every sum is
// Eigen's, and `tests/test_vectors.cpp` compares it.
#pragma once

#include <cmath>
#include <concepts>

namespace globalmatch::detail {

struct vec2 {
  double x = 0, y = 0;

  constexpr double operator[](std::integral auto i) const { return i == 0 ? x : y; }
  friend constexpr bool operator==(const vec2& a, const vec2& b) { return a.x == b.x && a.y == b.y; }
  constexpr vec2& operator+=(const vec2& b) { return x += b.x, y += b.y, *this; }
  constexpr vec2& operator*=(double s) { return x *= s, y *= s, *this; }
  constexpr vec2& operator/=(double s) { return x /= s, y /= s, *this; }
  constexpr double dot(const vec2& b) const { return x * b.x + y * b.y; }
  constexpr double squared_norm() const { return x * x + y * y; }
  double norm() const { return std::sqrt(squared_norm()); }
  /// Itself when it is zero.
  vec2 normalized() const {
    const double squared = squared_norm();
    return squared > 0 ? vec2{x / std::sqrt(squared), y / std::sqrt(squared)} : *this;
  }
};
constexpr vec2 operator-(const vec2& a) {
  return {-a.x, -a.y};
}
constexpr vec2 operator+(const vec2& a, const vec2& b) {
  return {a.x + b.x, a.y + b.y};
}
constexpr vec2 operator-(const vec2& a, const vec2& b) {
  return {a.x - b.x, a.y - b.y};
}
constexpr vec2 operator*(const vec2& a, double s) {
  return {a.x * s, a.y * s};
}
constexpr vec2 operator*(double s, const vec2& a) {
  return {s * a.x, s * a.y};
}
constexpr vec2 operator/(const vec2& a, double s) {
  return {a.x / s, a.y / s};
}

struct vec3 {
  double x = 0, y = 0, z = 0;

  constexpr double operator[](std::integral auto i) const { return i == 0 ? x : i == 1 ? y : z; }
  constexpr double& operator[](std::integral auto i) { return i == 0 ? x : i == 1 ? y : z; }
  friend constexpr bool operator==(const vec3& a, const vec3& b) {
    return a.x == b.x && a.y == b.y && a.z == b.z;
  }
  constexpr vec3& operator+=(const vec3& b) { return x += b.x, y += b.y, z += b.z, *this; }
  constexpr vec3& operator-=(const vec3& b) { return x -= b.x, y -= b.y, z -= b.z, *this; }
  constexpr vec3& operator/=(double s) { return x /= s, y /= s, z /= s, *this; }
  constexpr vec2 xy() const { return {x, y}; }
  constexpr double dot(const vec3& b) const { return (x * b.x + y * b.y) + z * b.z; }
  constexpr vec3 cross(const vec3& b) const {
    return {y * b.z - z * b.y, z * b.x - x * b.z, x * b.y - y * b.x};
  }
  constexpr double squared_norm() const { return dot(*this); }
  double norm() const { return std::sqrt(squared_norm()); }
  /// Itself when it is zero.
  vec3 normalized() const {
    const double squared = squared_norm(), length = std::sqrt(squared);
    return squared > 0 ? vec3{x / length, y / length, z / length} : *this;
  }
  /// Largest magnitude of a coordinate.
  double max_abs() const {
    const double a = std::abs(x), b = std::abs(y), c = std::abs(z), ab = a < b ? b : a;
    return ab < c ? c : ab;
  }
  /// Length, without overflow or underflow in the squares.
  double stable_norm() const {
    const double scale = max_abs(), inverse = 1 / scale;
    if (!(scale > 0) || !std::isfinite(scale)) return scale;
    if (!std::isfinite(inverse)) return norm_over(scale) * scale;
    return scale * vec3{x * inverse, y * inverse, z * inverse}.norm();
  }
  /// Unit vector, also where squares of the coordinates overflow or underflow; itself when it is zero.
  vec3 stable_normalized() const {
    const double scale = max_abs(), length = norm_over(scale) * scale;
    return scale > 0 ? vec3{x / length, y / length, z / length} : *this;
  }
  /// Some unit vector across this one, which must not be zero.
  vec3 unit_orthogonal() const {
    constexpr double negligible = 1e-12;
    if (std::abs(x) > std::abs(z) * negligible || std::abs(y) > std::abs(z) * negligible) {
      const double inverse = 1 / vec2{x, y}.norm();
      return {-y * inverse, x * inverse, 0};
    }
    const double inverse = 1 / vec2{y, z}.norm();
    return {0, -z * inverse, y * inverse};
  }
  /// Reads the first three of anything with an operator[].
  template <class V>
  static constexpr vec3 from(const V& v) {
    return {v[0], v[1], v[2]};
  }
  template <class V>
  V as() const {
    return V(x, y, z);
  }

 private:
  double norm_over(double scale) const { return vec3{x / scale, y / scale, z / scale}.norm(); }
};
constexpr vec3 operator-(const vec3& a) {
  return {-a.x, -a.y, -a.z};
}
constexpr vec3 operator+(const vec3& a, const vec3& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
constexpr vec3 operator-(const vec3& a, const vec3& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
constexpr vec3 operator*(const vec3& a, double s) {
  return {a.x * s, a.y * s, a.z * s};
}
constexpr vec3 operator*(double s, const vec3& a) {
  return {s * a.x, s * a.y, s * a.z};
}
constexpr vec3 operator/(const vec3& a, double s) {
  return {a.x / s, a.y / s, a.z / s};
}
inline bool is_finite(const vec3& a) {
  return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z);
}

/// Three floats. Eigen sums them from the back, because they fill no SSE register.
struct vec3f {
  float x = 0, y = 0, z = 0;

  constexpr vec3f() = default;
  constexpr vec3f(float x_, float y_, float z_) : x(x_), y(y_), z(z_) {}
  constexpr explicit vec3f(const vec3& a) : x(float(a.x)), y(float(a.y)), z(float(a.z)) {}
  constexpr explicit operator vec3() const { return {double(x), double(y), double(z)}; }
  constexpr float operator[](std::integral auto i) const { return i == 0 ? x : i == 1 ? y : z; }
  friend constexpr bool operator==(const vec3f& a, const vec3f& b) {
    return a.x == b.x && a.y == b.y && a.z == b.z;
  }
  constexpr float dot(const vec3f& b) const { return x * b.x + (y * b.y + z * b.z); }
  constexpr float squared_norm() const { return dot(*this); }
};
constexpr vec3f operator-(const vec3f& a, const vec3f& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}

}  // namespace globalmatch::detail
