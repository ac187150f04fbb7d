// Eigen as the oracle of the plain structs: equal means equal bits, the sign of a zero among them.
#pragma once

#include <Eigen/Dense>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <random>

#include "catch.hpp"
#include "globalmatch/detail/core/matrices.hpp"
#include "globalmatch/detail/core/rigid.hpp"
#include "globalmatch/detail/core/vectors.hpp"

namespace globalmatch::oracles {

using namespace detail;

using eigen_vec = Eigen::Vector3d;
using eigen_mat = Eigen::Matrix3d;

inline bool same_bits(double a, double b) {
  return std::memcmp(&a, &b, sizeof a) == 0 || (std::isnan(a) && std::isnan(b));
}
inline bool same_bits(float a, float b) {
  return std::memcmp(&a, &b, sizeof a) == 0 || (std::isnan(a) && std::isnan(b));
}
inline bool same_bits(const vec2& a, const Eigen::Vector2d& b) {
  return same_bits(a.x, b[0]) && same_bits(a.y, b[1]);
}
inline bool same_bits(const vec3& a, const eigen_vec& b) {
  return same_bits(a.x, b[0]) && same_bits(a.y, b[1]) && same_bits(a.z, b[2]);
}
inline bool same_bits(const vec3f& a, const Eigen::Vector3f& b) {
  return same_bits(a.x, b[0]) && same_bits(a.y, b[1]) && same_bits(a.z, b[2]);
}
inline bool same_bits(const mat2& a, const Eigen::Matrix2d& b) {
  return same_bits(a.columns[0], b.col(0)) && same_bits(a.columns[1], b.col(1));
}
inline bool same_bits(const mat3& a, const eigen_mat& b) {
  return same_bits(a.col(0), b.col(0)) && same_bits(a.col(1), b.col(1)) && same_bits(a.col(2), b.col(2));
}
inline bool same_bits(const rigid& a, const Eigen::Isometry3d& b) {
  return same_bits(a.rotation, b.linear()) && same_bits(a.translation, b.translation());
}

inline vec2 plain(const Eigen::Vector2d& v) {
  return {v[0], v[1]};
}
inline vec3f plain(const Eigen::Vector3f& v) {
  return {v[0], v[1], v[2]};
}
inline mat2 plain(const Eigen::Matrix2d& m) {
  return {{{m(0, 0), m(1, 0)}, {m(0, 1), m(1, 1)}}};
}
inline mat3 plain(const eigen_mat& m) {
  return {{vec3::from(m.col(0)), vec3::from(m.col(1)), vec3::from(m.col(2))}};
}

/// Numbers of mixed magnitudes; one in sixteen is zero or one, of either sign.
struct numbers {
  std::mt19937_64 source;

  explicit numbers(std::uint64_t seed) : source(seed) {}
  double unit() { return double(source() >> 11) * 0x1p-53; }
  double next() {
    const double sign = source() % 2 == 0 ? 1 : -1;
    if (source() % 16 == 0) return sign * double(source() % 2);
    return sign * (1 + unit()) * std::exp2(double(source() % 17) - 8);
  }
  template <class M>
  M matrix() {
    M m;
    for (Eigen::Index i = 0; i < m.size(); ++i) m.data()[i] = typename M::Scalar(next());
    return m;
  }
  eigen_vec vector() { return matrix<eigen_vec>(); }
  eigen_mat rotation() {
    const eigen_vec axis = vector() + eigen_vec(0, 0, 1e-3);
    return Eigen::AngleAxisd(7 * unit() - 3.5, axis.normalized()).toRotationMatrix();
  }
  Eigen::Isometry3d rigid_transform() {
    Eigen::Isometry3d t = Eigen::Isometry3d::Identity();
    t.linear() = rotation();
    t.translation() = vector();
    return t;
  }
};

/// Calls `check` with numbers of one seed, 10,000 times; it returns whether the claim held. Where Eigen is
/// built for other instructions than SSE2 its sums have other orders, and the claim is skipped; so it is on
/// Windows, where two in ten thousand rotations differ.
template <class Check>
void always(std::uint64_t seed, const Check& check) {
#if defined(__FMA__) || defined(__AVX__) || !defined(__SSE2__) || defined(_WIN32)
  WARN("skipped: Eigen's sums have the order of other instructions, or functions differ");
  return;
#endif
  numbers random(seed);
  int failures = 0;
  for (int i = 0; i < 10000; ++i) failures += check(random) ? 0 : 1;
  INFO("seed " << seed);
  CHECK(failures == 0);
}

/// Symmetric, of full rank or less, with equal eigenvalues or nearly so.
inline eigen_mat random_symmetric(numbers& random) {
  const eigen_mat r = random.rotation();
  eigen_vec values = random.vector();
  const auto kind = random.source() % 6;
  if (kind == 1) values[1] = values[0];
  if (kind == 2) values[2] = values[1] = values[0];
  if (kind == 3) values[1] = values[2] = 0;
  if (kind == 4) values[1] = values[0] * (1 + 1e-14 * random.unit());
  if (kind == 5) return values.asDiagonal();
  const eigen_mat product = r * values.asDiagonal() * r.transpose();
  return (product + product.transpose()) / 2;
}

}  // namespace globalmatch::oracles
