#include "globalmatch/detail/core/linear.hpp"

#include <Eigen/Dense>
#include <array>
#include <cstdint>
#include <cstring>
#include <limits>
#include <random>
#include <type_traits>

#include "catch.hpp"
#include "globalmatch/detail/core/decompositions.hpp"
#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/small_solver.hpp"

// The oracle is Eigen, and equal means equal bits, the sign of a zero among them. Where Eigen is built for
// other instructions than SSE2 its sums have other orders, and these tests are skipped.
namespace globalmatch::detail {

namespace {

using eigen_vec = Eigen::Vector3d;
using eigen_mat = Eigen::Matrix3d;
using vector6 = Eigen::Matrix<double, 6, 1>;
using matrix6 = Eigen::Matrix<double, 6, 6>;

bool same_bits(double a, double b) {
  return std::memcmp(&a, &b, sizeof a) == 0 || (std::isnan(a) && std::isnan(b));
}
bool same_bits(float a, float b) {
  return std::memcmp(&a, &b, sizeof a) == 0 || (std::isnan(a) && std::isnan(b));
}
bool same_bits(const vec2& a, const Eigen::Vector2d& b) {
  return same_bits(a.x, b[0]) && same_bits(a.y, b[1]);
}
bool same_bits(const vec3& a, const eigen_vec& b) {
  return same_bits(a.x, b[0]) && same_bits(a.y, b[1]) && same_bits(a.z, b[2]);
}
bool same_bits(const vec3f& a, const Eigen::Vector3f& b) {
  return same_bits(a.x, b[0]) && same_bits(a.y, b[1]) && same_bits(a.z, b[2]);
}
bool same_bits(const mat2& a, const Eigen::Matrix2d& b) {
  return same_bits(a.col(0), b.col(0)) && same_bits(a.col(1), b.col(1));
}
bool same_bits(const mat3& a, const eigen_mat& b) {
  return same_bits(a.col(0), b.col(0)) && same_bits(a.col(1), b.col(1)) && same_bits(a.col(2), b.col(2));
}
bool same_bits(const rigid& a, const Eigen::Isometry3d& b) {
  return same_bits(a.rotation, b.linear()) && same_bits(a.translation, b.translation());
}

mat2 plain(const Eigen::Matrix2d& m) {
  return {{vec2::from(m.col(0)), vec2::from(m.col(1))}};
}
mat3 plain(const eigen_mat& m) {
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

/// Calls `check` with numbers of one seed, 10,000 times; it returns whether the claim held.
template <class Check>
void always(std::uint64_t seed, const Check& check) {
#if defined(__FMA__) || defined(__AVX__) || !defined(__SSE2__)
  WARN("skipped: Eigen's sums have the order of other instructions");
  return;
#endif
  numbers random(seed);
  int failures = 0;
  for (int i = 0; i < 10000; ++i) failures += check(random) ? 0 : 1;
  INFO("seed " << seed);
  CHECK(failures == 0);
}

}  // namespace

TEST_CASE("the sums, products and quotients of vec3 have Eigen's bits") {
  always(1, [](numbers& random) {
    const eigen_vec a = random.vector(), b = random.vector();
    const double s = random.next();
    const vec3 p = vec3::from(a), q = vec3::from(b);
    vec3 changed = p;
    changed += q, changed *= s, changed -= p, changed /= s;
    eigen_vec eigen = a;
    eigen += b, eigen *= s, eigen -= a, eigen /= s;
    return same_bits(p + q, a + b) && same_bits(p - q, a - b) && same_bits(-p, -a) &&
           same_bits(s * p, s * a) && same_bits(p * s, a * s) && same_bits(p / s, a / s) &&
           same_bits(changed, eigen) && same_bits(p.cross(q), a.cross(b)) && p.as<eigen_vec>() == a;
  });
}

TEST_CASE("the dot product and the norms of vec3 have Eigen's bits, of expressions too") {
  always(2, [](numbers& random) {
    const eigen_vec a = random.vector(), b = random.vector(), c = random.vector();
    const vec3 p = vec3::from(a), q = vec3::from(b), r = vec3::from(c);
    return same_bits(p.dot(q), a.dot(b)) && same_bits(p.dot(q - r), a.dot(b - c)) &&
           same_bits(p.squared_norm(), a.squaredNorm()) && same_bits((p - q).norm(), (a - b).norm()) &&
           same_bits((p - q).xy().norm(), (a - b).head<2>().norm()) && same_bits(p.norm(), a.norm()) &&
           same_bits(p.normalized(), a.normalized()) &&
           same_bits((p + 2.0 * q).normalized(), (a + 2.0 * b).normalized());
  });
}

TEST_CASE("the unit vectors of vec3 have Eigen's bits at any length") {
  for (const double length : {1.0, 1e200, 1e-200, 1e-310})
    always(3, [&](numbers& random) {
      const eigen_vec a = length * random.vector();
      const vec3 p = vec3::from(a);
      const double norm = a.stableNorm();  // Eigen's order depends on where the vector lies
      return same_bits(p.stable_normalized(), a.stableNormalized()) &&
             std::abs(p.stable_norm() - norm) <= 1e-15 * norm + 1e-323;
    });
  always(4, [](numbers& random) {
    eigen_vec a = random.vector();
    if (random.unit() < 0.3) a.head<2>() *= 1e-13;
    if (a.isZero(0)) return true;
    return same_bits(vec3::from(a).unit_orthogonal(), a.unitOrthogonal());
  });
}

TEST_CASE("the stable norm of vec3 is zero, infinite or not a number where the vector is") {
  const double infinity = std::numeric_limits<double>::infinity();
  CHECK(vec3{}.stable_norm() == 0);
  CHECK(vec3{}.stable_normalized() == vec3{});
  CHECK(vec3{0, infinity, 1}.stable_norm() == infinity);
  CHECK(vec3{0, 0, 1e200}.stable_norm() == 1e200);
  CHECK(vec3{0, 3e200, -4e200}.stable_norm() == Approx(5e200));
  CHECK(vec3{0, 3e-320, -4e-320}.stable_norm() == Approx(5e-320).epsilon(1e-3));
  CHECK_FALSE(is_finite(vec3{0, infinity, 1}));
  CHECK_FALSE(is_finite(vec3{0, 0, std::numeric_limits<double>::quiet_NaN()}));
  CHECK(is_finite(vec3{1e300, 0, 0}));
}

TEST_CASE("vec3f has the bits of Vector3f") {
  always(5, [](numbers& random) {
    const auto a = random.matrix<Eigen::Vector3f>(), b = random.matrix<Eigen::Vector3f>();
    const eigen_vec d = random.vector();
    const auto s = float(random.next());
    const vec3f p = vec3f::from(a), q = vec3f::from(b);
    return same_bits(p.dot(q), a.dot(b)) && same_bits(p.squared_norm(), a.squaredNorm()) &&
           same_bits((p - q).squared_norm(), (a - b).squaredNorm()) &&
           same_bits((p - q).norm(), (a - b).norm()) && same_bits(p.normalized(), a.normalized()) &&
           same_bits(p.cross(q), a.cross(b)) && same_bits(p + q, a + b) && same_bits(s * p, s * a) &&
           same_bits(p / s, a / s) && same_bits(vec3f(vec3::from(d)), d.cast<float>()) &&
           same_bits(vec3(p), a.cast<double>());
  });
}

TEST_CASE("vec2 has the bits of Vector2d") {
  always(6, [](numbers& random) {
    const auto a = random.matrix<Eigen::Vector2d>(), b = random.matrix<Eigen::Vector2d>();
    const double s = random.next();
    const vec2 p = vec2::from(a), q = vec2::from(b);
    return same_bits(p.dot(q), a.dot(b)) && same_bits((p - q).norm(), (a - b).norm()) &&
           same_bits(p.normalized(), a.normalized()) && same_bits(p + q, a + b) && same_bits(-p, -a) &&
           same_bits(s * p, s * a) && same_bits(p / s, a / s);
  });
}

TEST_CASE("mat2 has the bits of Matrix2d") {
  always(7, [](numbers& random) {
    const auto a = random.matrix<Eigen::Matrix2d>(), b = random.matrix<Eigen::Matrix2d>();
    const auto v = random.matrix<Eigen::Vector2d>(), w = random.matrix<Eigen::Vector2d>();
    const double s = random.next();
    const mat2 m = plain(a), n = plain(b);
    const vec2 p = vec2::from(v), q = vec2::from(w);
    Eigen::Matrix2d sum = a;
    sum += v * w.transpose() / s;
    return same_bits(m * p, a * v) && same_bits(m * n, a * b) && same_bits(m.transpose(), a.transpose()) &&
           same_bits(m.determinant(), a.determinant()) && same_bits(m.inverse(), a.inverse()) &&
           same_bits(m + outer(p, q) / s, sum) && same_bits(m.inverse() * p, a.inverse() * v) &&
           same_bits((m * p - q).norm(), (a * v - w).norm()) &&
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
    return same_bits(m + outer(s * p, q), weighted) && same_bits(m + outer(s * (p - r), q - r), centered) &&
           same_bits(m + outer(p, q) / s, divided) && same_bits(m / s - outer(p, p), less) &&
           same_bits(m - s * m, a - s * a);
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

TEST_CASE("rigid transforms, their products and inverses have the bits of Isometry3d") {
  always(11, [](numbers& random) {
    const Eigen::Isometry3d s = random.rigid_transform(), t = random.rigid_transform();
    const eigen_vec v = random.vector(), w = random.vector();
    const rigid a = from_eigen(s), b = rigid::from(t);
    const vec3 p = vec3::from(v), q = vec3::from(w);
    return same_bits(a * p, s * v) && same_bits(a * b, s * t) && same_bits(a.inverse(), s.inverse()) &&
           same_bits(a * p - q, s * v - w) && same_bits((a * p - q).norm(), (s * v - w).norm()) &&
           same_bits((a * p - q).xy().norm(), (s * v - w).head<2>().norm()) &&
           same_bits(a * (p - q), s * (v - w)) && same_bits((a * p).z, (s * v).z()) &&
           same_bits(a.rotation * p, s.linear() * v) && same_bits(a.inverse() * b, s.inverse() * t) &&
           same_bits(a.inverse() * b * a, s.inverse() * t * s) &&
           same_bits((a * p - b * p).norm() + 1, (s * v - t * v).norm() + 1) &&
           same_bits(transpose_times(a.rotation, p), s.linear().transpose() * v);
  });
}

TEST_CASE("shifts before and after a rigid transform have the bits of Translation3d") {
  always(12, [](numbers& random) {
    const Eigen::Isometry3d t = random.rigid_transform();
    const eigen_vec v = random.vector(), w = random.vector();
    const double turn = 4 * random.next();
    const rigid a = from_eigen(t);
    const vec3 p = vec3::from(v), q = vec3::from(w);
    const Eigen::Isometry3d about =
        Eigen::Translation3d(v) * Eigen::AngleAxisd(turn, eigen_vec::UnitZ()) * Eigen::Translation3d(-v);
    const Eigen::Isometry3d all =
        Eigen::Translation3d(v) * Eigen::AngleAxisd(turn, eigen_vec::UnitZ()) * Eigen::Translation3d(-v) * t;
    const Eigen::Isometry3d moved = Eigen::Translation3d(w) * t * Eigen::Translation3d(-v);
    const Eigen::Isometry3d moved_back = Eigen::Translation3d(w) * t * Eigen::Translation3d(-w) * t;
    return same_bits(shifted_after(a, p), Eigen::Translation3d(v) * t) &&
           same_bits(shifted_before(a, p), t * Eigen::Translation3d(v)) &&
           same_bits(rigid::turn_about(p, turn), about) && same_bits(rigid::turn_about(p, turn) * a, all) &&
           same_bits(shifted_before(shifted_after(a, q), -p), moved) &&
           same_bits(shifted_before(shifted_after(a, q), -q) * a, moved_back);
  });
}

TEST_CASE("rotations about an axis, and the angle of a rotation, have the bits of AngleAxisd") {
  always(13, [](numbers& random) {
    const eigen_vec axis = (random.vector() + eigen_vec(0, 0, 1e-3)).normalized();
    const double angle = random.next() * (random.unit() < 0.2 ? 1e-9 : 1);
    const eigen_mat a = Eigen::AngleAxisd(angle, axis).toRotationMatrix(), b = random.rotation();
    const eigen_mat z = Eigen::AngleAxisd(angle, eigen_vec::UnitZ()).toRotationMatrix();
    return same_bits(rotation_about(vec3::from(axis), angle), a) && same_bits(rotation_about_z(angle), z) &&
           same_bits(rotation_angle(plain(a)), Eigen::AngleAxisd(a).angle()) &&
           same_bits(rotation_angle(plain(a) * plain(b).transpose()),
                     Eigen::AngleAxisd(a * b.transpose()).angle()) &&
           same_bits(rotation_angle(transpose_times(plain(a), plain(b))),
                     Eigen::AngleAxisd(a.transpose() * b).angle());
  });
}

TEST_CASE("the angle of a rotation is exact for tiny turns and for half turns") {
  for (const double angle : {1e-3, 1e-12, 1e-17, 1e-200, 3.14159})
    for (const vec3& axis : {vec3{1, 0, 0}, vec3{0, 1, 0}, vec3{0, 0, 1}, vec3{0.6, 0, 0.8}})
      CHECK(rotation_angle(rotation_about(axis, angle)) == Approx(angle).epsilon(1e-12));
  CHECK(rotation_angle(mat3::identity()) == 0);
  CHECK(rotation_angle(mat3::diagonal_of({1, -1, -1})) == std::acos(-1.0));
}

TEST_CASE("rigid transforms survive the way to Eigen and back") {
  numbers random(14);
  for (int i = 0; i < 100; ++i) {
    const Eigen::Isometry3d t = random.rigid_transform();
    CHECK(to_eigen(from_eigen(t)).matrix() == t.matrix());
    CHECK(rigid::from(t).as<Eigen::Isometry3d>().matrix() == t.matrix());
    CHECK(to_eigen(from_eigen(eigen_mat(t.linear()))) == t.linear());
    CHECK(to_eigen(from_eigen(eigen_vec(t.translation()))) == t.translation());
  }
  CHECK(to_eigen(rigid::identity()).matrix() == Eigen::Matrix4d::Identity());
  CHECK(from_eigen(Eigen::Vector2d(1, 2)) == vec2{1, 2});
  CHECK(to_eigen(vec2{1, 2}) == Eigen::Vector2d(1, 2));
}

namespace {

/// Symmetric, of full rank or less, with equal eigenvalues or nearly so.
eigen_mat random_symmetric(numbers& random) {
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

}  // namespace

TEST_CASE("the eigenvalues and vectors of a symmetric mat3 have the bits of Eigen's closed form") {
  always(15, [](numbers& random) {
    const eigen_mat a = random_symmetric(random);
    Eigen::SelfAdjointEigenSolver<eigen_mat> solver;
    solver.computeDirect(a);
    const eigen_of_mat3 e = symmetric_eigen(plain(a));
    return same_bits(e.values, solver.eigenvalues()) && same_bits(e.vectors, solver.eigenvectors());
  });
}

TEST_CASE("the eigenvectors of a symmetric mat3 diagonalise it, however few are distinct") {
  always(16, [](numbers& random) {
    const eigen_mat a = random_symmetric(random);
    const eigen_of_mat3 e = symmetric_eigen(plain(a));
    const eigen_mat v = to_eigen(e.vectors);
    const double size = a.cwiseAbs().maxCoeff();
    return e.values.x <= e.values.y && e.values.y <= e.values.z && v.allFinite() &&
           std::abs(v.col(0).norm() - 1) < 1e-12 && std::abs(v.col(2).norm() - 1) < 1e-12 &&
           (v * to_eigen(e.values).asDiagonal() * v.transpose() - a).cwiseAbs().maxCoeff() <= 1e-6 * size;
  });
  const eigen_of_mat3 zero = symmetric_eigen(mat3{}), equal = symmetric_eigen(4.0 * mat3::identity());
  CHECK((zero.values == vec3{} && zero.vectors == mat3::identity()));
  CHECK((equal.values == vec3{4, 4, 4} && equal.vectors == mat3::identity()));
}

TEST_CASE("the eigenvalues and vectors of a symmetric mat2 have the bits of Eigen's closed form") {
  always(17, [](numbers& random) {
    Eigen::Matrix2d a = random.matrix<Eigen::Matrix2d>();
    a(0, 1) = a(1, 0);
    if (random.unit() < 0.2) a = a.col(0) * a.col(0).transpose();
    if (random.unit() < 0.1) a = a(0, 0) * Eigen::Matrix2d::Identity();
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver;
    solver.computeDirect(a);
    const eigen_of_mat2 e = symmetric_eigen(plain(a));
    return same_bits(e.values, solver.eigenvalues()) && same_bits(e.vectors, solver.eigenvectors());
  });
}

TEST_CASE("the rotation of a covariance has the bits of Eigen's JacobiSVD") {
  always(18, [](numbers& random) {
    eigen_mat a = random.matrix<eigen_mat>();
    if (random.unit() < 0.2) a.col(2) = a.col(0) - 2 * a.col(1);
    if (random.unit() < 0.1) a = a.col(0) * a.col(1).transpose();
    if (random.unit() < 0.1) a = random_symmetric(random);
    const Eigen::JacobiSVD<eigen_mat> svd(a, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const eigen_mat v = svd.matrixV(), u = svd.matrixU();
    const double handedness = (v * u.transpose()).determinant() < 0 ? -1 : 1;
    Eigen::Isometry3d r;  // to whose part Eigen assigns number by number, not two at a time
    r.linear() = v * eigen_vec(1, 1, handedness).asDiagonal() * u.transpose();
    const svd_of_mat3 own(plain(a));
    const rotation_of_covariance fit(plain(a));
    return same_bits(own.values, svd.singularValues()) && same_bits(own.u, u) && same_bits(own.v, v) &&
           same_bits(fit.rotation, r.linear()) && fit.singular_values == own.values;
  });
}

TEST_CASE("the rotation of a covariance turns the source onto the target, mirrored points too") {
  numbers random(19);
  for (int i = 0; i < 200; ++i) {
    const eigen_mat truth = random.rotation();
    eigen_mat covariance = eigen_mat::Zero();
    for (int k = 0; k < 5; ++k) {
      const eigen_vec p = random.vector();
      covariance += p * (truth * p).transpose();
    }
    CHECK((to_eigen(rotation_of_covariance(plain(covariance)).rotation) - truth).norm() < 1e-9);
    const mat3 mirrored = rotation_of_covariance(plain(eigen_mat(-covariance))).rotation;
    CHECK(mirrored.determinant() == Approx(1));
  }
  CHECK(rotation_of_covariance(mat3{}).rotation == mat3::identity());
  CHECK(rotation_of_covariance(mat3{}).singular_values == vec3{});
}

namespace {

/// Positive definite but for what the kind says: singular, indefinite, or badly scaled.
matrix6 random_normal_matrix(numbers& random) {
  matrix6 m = matrix6::Zero();
  const auto kind = random.source() % 5;
  const int rows = kind == 1 ? 4 : 12;
  for (int i = 0; i < rows; ++i) {
    const vector6 row = random.matrix<vector6>();
    m += row * row.transpose();
  }
  if (kind == 2) m.row(3) *= 1e-6, m.col(3) *= 1e-6;
  if (kind == 3) {
    m.topRows<2>().setZero();
    m.leftCols<2>().setZero();
    m.topLeftCorner<2, 2>().setIdentity();
  }
  return m;
}
small_matrix plain(const matrix6& m, std::size_t size = 6) {
  small_matrix result;
  result.size = size;
  for (std::size_t c = 0; c < size; ++c)
    for (std::size_t r = 0; r < size; ++r) result(r, c) = m(Eigen::Index(r), Eigen::Index(c));
  return result;
}

}  // namespace

TEST_CASE("the solution of six normal equations has the bits of Eigen's LDLT") {
  always(20, [](numbers& random) {
    const matrix6 m = random_normal_matrix(random);
    const vector6 b = random.matrix<vector6>();
    const Eigen::LDLT<matrix6> oracle(m);
    const vector6 x = oracle.solve(b);
    small_vector right;
    for (int i = 0; i < 6; ++i) right[std::size_t(i)] = b[i];
    const small_solver solver(plain(m));
    const small_vector own = solver.solve(right);
    bool same = solver.succeeded() == (oracle.info() == Eigen::Success);
    for (int i = 0; i < 6; ++i) same = same && same_bits(own[std::size_t(i)], x[i]);
    return same;
  });
}

TEST_CASE("the inverse of a small matrix is that of Eigen's LDLT, of three to six rows") {
  numbers random(21);
  for (int i = 0; i < 1000; ++i) {
    matrix6 all = matrix6::Identity();
    for (int k = 0; k < 12; ++k) {
      const vector6 row = random.matrix<vector6>();
      all += row * row.transpose();
    }
    const auto size = 3 + Eigen::Index(random.source() % 4);
    const Eigen::MatrixXd m = all.topLeftCorner(size, size);
    const Eigen::MatrixXd inverse = m.ldlt().solve(Eigen::MatrixXd::Identity(size, size));
    const small_matrix own = small_solver(plain(all, std::size_t(size))).inverse();
    double error = 0;
    for (Eigen::Index r = 0; r < size; ++r)
      for (Eigen::Index c = 0; c < size; ++c)
        error = std::max(error, std::abs(own(std::size_t(r), std::size_t(c)) - inverse(r, c)));
    CHECK(error <= 1e-10 * inverse.cwiseAbs().maxCoeff());
  }
}

TEST_CASE("the solver says what has no factors, and leaves at zero what is not determined") {
  small_matrix indefinite;
  indefinite.size = 3;
  indefinite(0, 1) = indefinite(1, 0) = 1;
  CHECK_FALSE(small_solver(indefinite).succeeded());
  small_matrix zero;
  CHECK(small_solver(zero).succeeded());
  CHECK(small_solver(zero).solve({1, 2, 3, 4, 5, 6}) == small_vector{});
  small_matrix some;
  some.size = 4;
  some.add_square({1, 0, 0, 2}, 2);
  const small_vector x = small_solver(some).solve({2, 0, 0, 4});
  CHECK(x[0] + 2 * x[3] == Approx(1));
  CHECK((x[1] == 0 && x[2] == 0));
}

}  // namespace globalmatch::detail
