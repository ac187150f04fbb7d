#include "globalmatch/detail/survey/plan_pose.hpp"

#include <Eigen/Geometry>

#include <cmath>

#include "catch.hpp"
#include "globalmatch/detail/core/eigen_border.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_plan_pose {

using namespace detail;

namespace {

plan_pose any_pose(random_source& random) {
  return {{scenes::uniform(random, -50, 50), scenes::uniform(random, -50, 50)},
          scenes::uniform(random, -3, 3)};
}

Eigen::Isometry2d affine(const plan_pose& p) {
  return Eigen::Translation2d(p.shift.x, p.shift.y) * Eigen::Rotation2Dd(p.yaw);
}

}  // namespace

TEST_CASE("poses in plan are composed, inverted and applied as affine transforms are") {
  random_source random(1);
  for (int i = 0; i < 100; ++i) {
    const plan_pose a = any_pose(random), b = any_pose(random);
    CHECK(affine(a * b).isApprox(affine(a) * affine(b), 1e-12));
    CHECK(affine(a.inverse()).isApprox(affine(a).inverse(), 1e-12));
    const vec2 p = b.shift, placed = a * p;
    CHECK((affine(a) * Eigen::Vector2d(p.x, p.y) - Eigen::Vector2d(placed.x, placed.y)).norm() < 1e-12);
  }
}

TEST_CASE("a pose in plan is what of a transform in space is horizontal") {
  random_source random(2);
  for (int i = 0; i < 100; ++i) {
    const plan_pose pose = any_pose(random);
    const rigid raised = in_space(pose, 7);
    CHECK(raised.translation.z == 7);
    const plan_pose back = plan_of(raised);
    CHECK(back.shift == pose.shift);
    CHECK(back.yaw == Approx(pose.yaw).margin(1e-12));
  }
}

TEST_CASE("a quarter turn is the derivative of a turn") {
  const vec2 v = {3, -2};
  constexpr double small = 1e-6;
  const vec2 turned = plan_pose{{0, 0}, small}.turned(v), derivative = (turned - v) / small;
  CHECK((derivative - quarter_turned(v)).norm() < 1e-5);
}

}  // namespace globalmatch::test_plan_pose
