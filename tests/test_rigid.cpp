#include "globalmatch/detail/core/rigid.hpp"

#include <Eigen/Dense>

#include <cmath>

#include "catch.hpp"
#include "globalmatch/detail/core/eigen_border.hpp"
#include "oracles/eigen_bits.hpp"

namespace globalmatch::detail::test_rigid {

using namespace oracles;

TEST_CASE("rigid transforms, their products and inverses have the bits of Isometry3d") {
  always(11, [](numbers& random) {
    const Eigen::Isometry3d s = random.rigid_transform(), t = random.rigid_transform();
    const eigen_vec v = random.vector(), w = random.vector();
    const rigid a = from_eigen(s), b = from_eigen(t);
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

}  // namespace globalmatch::detail::test_rigid
