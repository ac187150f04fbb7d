#include "globalmatch/detail/core/vectors.hpp"

#include <Eigen/Dense>

#include <cmath>
#include <limits>

#include "catch.hpp"
#include "oracles/eigen_bits.hpp"

namespace globalmatch::detail::test_vectors {

using namespace oracles;

TEST_CASE("the sums, products and quotients of vec3 have Eigen's bits") {
  always(1, [](numbers& random) {
    const eigen_vec a = random.vector(), b = random.vector();
    const double s = random.next();
    const vec3 p = vec3::from(a), q = vec3::from(b);
    vec3 changed = p;
    changed += q, changed -= p, changed /= s;
    eigen_vec eigen = a;
    eigen += b, eigen -= a, eigen /= s;
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
    const vec3f p = plain(a), q = plain(b);
    return same_bits(p.dot(q), a.dot(b)) && same_bits(p.squared_norm(), a.squaredNorm()) &&
           same_bits((p - q).squared_norm(), (a - b).squaredNorm()) &&
           same_bits(vec3f(vec3::from(d)), d.cast<float>()) && same_bits(vec3(p), a.cast<double>());
  });
}

TEST_CASE("vec2 has the bits of Vector2d") {
  always(6, [](numbers& random) {
    const auto a = random.matrix<Eigen::Vector2d>(), b = random.matrix<Eigen::Vector2d>();
    const double s = random.next();
    const vec2 p = plain(a), q = plain(b);
    return same_bits(p.dot(q), a.dot(b)) && same_bits((p - q).norm(), (a - b).norm()) &&
           same_bits(p.normalized(), a.normalized()) && same_bits(p + q, a + b) && same_bits(-p, -a) &&
           same_bits(s * p, s * a) && same_bits(p / s, a / s);
  });
}

}  // namespace globalmatch::detail::test_vectors
