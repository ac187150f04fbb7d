#include "globalmatch/detail/core/eigen_border.hpp"

#include <Eigen/Dense>

#include "catch.hpp"
#include "oracles/eigen_bits.hpp"

namespace globalmatch::detail::test_eigen_border {

using namespace oracles;

TEST_CASE("rigid transforms survive the way to Eigen and back") {
  numbers random(14);
  for (int i = 0; i < 100; ++i) {
    const Eigen::Isometry3d t = random.rigid_transform();
    CHECK(to_eigen(from_eigen(t)).matrix() == t.matrix());
    CHECK(to_eigen(from_eigen(eigen_vec(t.translation()))) == t.translation());
  }
  CHECK(to_eigen(rigid::identity()).matrix() == Eigen::Matrix4d::Identity());
  CHECK(to_eigen(vec2{1, 2}) == Eigen::Vector2d(1, 2));
}

TEST_CASE("each number comes to the place that Eigen has it in, also of what is no rotation") {
  Eigen::Matrix3d m;
  m << 1, 2, 3, 4, 5, 6, 7, 8, 10;
  const mat3 own = plain(m);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) CHECK(own(r, c) == m(r, c));
  const rigid skewed{own, {-11, 12, 13}};
  const Eigen::Isometry3d t = to_eigen(skewed);
  Eigen::Matrix4d expected = Eigen::Matrix4d::Identity();
  expected.topLeftCorner<3, 3>() = m;
  expected.topRightCorner<3, 1>() << -11, 12, 13;
  CHECK(t.matrix() == expected);
  CHECK(from_eigen(t).rotation == own);
  CHECK(from_eigen(t).translation == vec3{-11, 12, 13});
  CHECK(to_eigen(vec3{3, -1, 2}) == Eigen::Vector3d(3, -1, 2));
}

}  // namespace globalmatch::detail::test_eigen_border
