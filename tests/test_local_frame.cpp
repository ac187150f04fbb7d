#include "globalmatch/detail/core/local_frame.hpp"

#include <Eigen/Geometry>

#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "catch.hpp"
#include "forest_scenes.hpp"
#include "support/message_of.hpp"

namespace globalmatch::test_local_frame {

using namespace detail;

using Eigen::Vector3d;
using scenes::infinity;
using scenes::nan;
using support::message_of;

namespace {

bool turns_upright(const Vector3d& up) {
  const Eigen::Matrix3d rotation = to_eigen(rigid{levelling_rotation(from_eigen(up)), {}}).linear();
  return rotation.allFinite() && (rotation * up.stableNormalized() - Vector3d::UnitZ()).norm() < 1e-8 &&
         rotation.isUnitary(1e-12) && rotation.determinant() > 0;
}

}  // namespace

TEST_CASE("levelling_rotation turns any up into +z") {
  random_source random(1);
  for (int i = 0; i < 200; ++i)
    CHECK(turns_upright(scenes::in_range(random, 0.1, 10) * scenes::random_direction(random)));
  for (const Vector3d& up : {Vector3d(0, 0, -1), Vector3d(1, 0, 0), Vector3d(0, -5, 0), Vector3d(1e-9, 0, -1),
                             Vector3d(1e-9, 1e-9, 1)})
    CHECK(turns_upright(up));
}

TEST_CASE("levelling_rotation takes an up of any length") {
  CHECK(turns_upright({3e-100, 4e-100, 1e-100}));
  CHECK(turns_upright({3e100, 4e100, 1e100}));
  CHECK(turns_upright({3e200, 4e200, 1e200}));
}

TEST_CASE("levelling_rotation of +z, however long, is exactly the identity") {
  for (const double length : {1.0, 0.3, 17.0}) CHECK(levelling_rotation({0, 0, length}) == mat3::identity());
}

TEST_CASE("levelling_rotation refuses an up that is zero or not finite") {
  for (const Vector3d& up : {Vector3d(0, 0, 0), Vector3d(0, nan, 1), Vector3d(0, 0, infinity)}) {
    CHECK(message_of([&] { levelling_rotation(from_eigen(up)); }).starts_with("up must be"));
  }
}

TEST_CASE("a local frame leads to local coordinates and back") {
  random_source random(2);
  for (int i = 0; i < 50; ++i) {
    const local_frame frame{{500000, 5300000, 1000},
                            levelling_rotation(from_eigen(scenes::random_direction(random)))};
    const vec3 p = frame.origin + 100 * from_eigen(scenes::random_direction(random));
    CHECK((frame.to_scan(frame.to_local(p)) - p).norm() < 1e-8);
    CHECK((frame.local_from_scan() * p - frame.to_local(p)).norm() < 1e-8);
    CHECK(frame.to_local(frame.origin) == vec3{});
  }
}

TEST_CASE("the angle between directions is exact for small and for large ones") {
  CHECK(angle_between(vec3{0, 0, 1}, vec3{std::sin(1e-9), 0, std::cos(1e-9)}) == Approx(1e-9));
  CHECK(angle_between(vec3{0, 0, 1}, -vec3{0, 0, 1}) == Approx(std::numbers::pi));
}

TEST_CASE("levelling takes the shortest way: it turns by the angle of up to +z, about a level axis") {
  random_source random(5);
  for (int i = 0; i < 100; ++i) {
    const Vector3d up = scenes::random_direction(random);
    const Eigen::Matrix3d shortest =
        Eigen::Quaterniond::FromTwoVectors(up, Vector3d::UnitZ()).toRotationMatrix();
    CHECK((to_eigen(rigid{levelling_rotation(from_eigen(up)), {}}).linear() - shortest).norm() < 1e-9);
  }
}

TEST_CASE("a level frame only shifts, to the last bit, and a tilted one is not level") {
  const local_frame level{{0.1, -0.7, 1e6}}, tilted{{0.1, -0.7, 3}, levelling_rotation({0.1, 0, 1})};
  CHECK(level.is_level());
  CHECK_FALSE(tilted.is_level());
  const vec3 p{1.3, 2.9, 1e6 + 0.25};
  CHECK(level.to_local(p) == p - level.origin);
  CHECK(level.local_from_scan().translation == -level.origin);
  const vec3 above = tilted.to_local(tilted.origin + 5 * vec3{0.1, 0, 1}.normalized());
  CHECK((above - vec3{0, 0, 5}).norm() < 1e-12);
}

}  // namespace globalmatch::test_local_frame
