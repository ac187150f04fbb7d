#include "globalmatch/detail/core/matrices.hpp"

#include <Eigen/Dense>

#include "catch.hpp"
#include "oracles/eigen_bits.hpp"

namespace globalmatch::detail::test_matrices {

using namespace oracles;

TEST_CASE("mat2 has the bits of Matrix2d") {
  always(7, [](numbers& random) {
    const auto a = random.matrix<Eigen::Matrix2d>();
    const auto v = random.matrix<Eigen::Vector2d>(), w = random.matrix<Eigen::Vector2d>();
    const double s = random.next();
    const mat2 m = plain(a);
    mat2 sum = m;
    const vec2 p = plain(v), q = plain(w);
    Eigen::Matrix2d eigen_sum = a;
    eigen_sum += v * w.transpose() / s;
    sum += outer(p, q) / s;
    return same_bits(m * p, a * v) && same_bits(m.determinant(), a.determinant()) &&
           same_bits(m.inverse(), a.inverse()) && same_bits(sum, eigen_sum) &&
           same_bits(m.inverse() * p, a.inverse() * v) && same_bits((m * p - q).norm(), (a * v - w).norm()) &&
           same_bits(rotation_in_2d(s) * p, Eigen::Rotation2Dd(s) * v) && same_bits(m.trace(), a.trace()) &&
           same_bits(p.dot(m * p), v.dot(a * v));
  });
}

TEST_CASE("the products of mat3 have Eigen's bits, of transposes too") {
  always(8, [](numbers& random) {
    const auto a = random.matrix<eigen_mat>(), b = random.matrix<eigen_mat>();
    const eigen_vec v = random.vector(), w = random.vector();
    const mat3 m = plain(a), n = plain(b);
    const vec3 p = vec3::from(v), q = vec3::from(w);
    return same_bits(m * p, a * v) && same_bits(m * n, a * b) &&
           same_bits(m * n.transpose(), a * b.transpose()) &&
           same_bits(transpose_times(m, p), a.transpose() * v) &&
           same_bits(transpose_times(m, n), a.transpose() * b) && same_bits(m * (p - q), a * (v - w)) &&
           same_bits(q - m * p, w - a * v) && same_bits((m * p).dot(q), (a * v).dot(w)) &&
           same_bits(m * n * m.transpose(), a * b * a.transpose()) &&
           same_bits((m * p - q).norm(), (a * v - w).norm()) &&
           same_bits(transpose_times(m, p) + q, a.transpose() * v + w);
  });
}

TEST_CASE("the sums of outer products in mat3 have Eigen's bits") {
  always(9, [](numbers& random) {
    const auto a = random.matrix<eigen_mat>();
    const eigen_vec v = random.vector(), w = random.vector(), o = random.vector();
    const double s = random.next();
    const vec3 p = vec3::from(v), q = vec3::from(w), r = vec3::from(o);
    eigen_mat weighted = a, centered = a, divided = a, less = a / s - v * v.transpose();
    weighted += s * v * w.transpose();
    centered += s * (v - o) * (w - o).transpose();
    divided += v * w.transpose() / s;
    const mat3 m = plain(a);
    const auto plus = [&](const mat3& added) {
      mat3 sum = m;
      return sum += added;
    };
    return same_bits(plus(outer(s * p, q)), weighted) &&
           same_bits(plus(outer(s * (p - r), q - r)), centered) &&
           same_bits(plus(outer(p, q) / s), divided) && same_bits(m / s - outer(p, p), less);
  });
}

TEST_CASE("the determinant, the trace and the inverse of mat3 have Eigen's bits") {
  always(10, [](numbers& random) {
    const auto a = random.matrix<eigen_mat>();
    const mat3 m = plain(a);
    eigen_mat inverse;
    bool invertible = false;
    a.computeInverseWithCheck(inverse, invertible);
    return same_bits(m.determinant(), a.determinant()) && same_bits(m.trace(), a.trace()) &&
           same_bits(m.inverse(), a.inverse()) && m.is_invertible() == invertible &&
           (!invertible || same_bits(m.inverse(), inverse)) && same_bits(m.transpose(), a.transpose()) &&
           same_bits(m.row(1), a.row(1).transpose()) && same_bits(m.diagonal(), a.diagonal());
  });
  CHECK_FALSE(outer({1, 2, 3}, {4, 5, 6}).is_invertible());
  CHECK_FALSE(mat3{}.is_invertible());
  CHECK(mat3::identity().is_invertible());
}

}  // namespace globalmatch::detail::test_matrices
