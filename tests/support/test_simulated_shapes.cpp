#include "support/simulated_shapes.hpp"

#include "catch.hpp"

#include <cmath>

namespace globalmatch::support {
namespace {

using Eigen::Vector3d;

const frustum cylinder = {{0, 0, 0}, {0, 0, 4}, 0.5, 0.5};
const frustum cone = {{0, 0, 0}, {0, 0, 4}, 0.5, 0.1};

ray ray_through(const Vector3d& origin, const Vector3d& through) {
  return {origin, (through - origin).normalized()};
}

}  // namespace

TEST_CASE("a ray hits the near side of a cylinder, in the middle and off it") {
  for (const double aside : {0.0, 0.1, -0.3, 0.49}) {
    const ray level = {{-5, aside, 2}, Vector3d::UnitX()};
    CHECK(first_hit(cylinder, level) == Approx(5 - std::sqrt(0.25 - aside * aside)));
  }
}

TEST_CASE("a ray misses a cylinder beside it, above it, below it and behind the scanner") {
  CHECK(first_hit(cylinder, {{-5, 0.51, 2}, Vector3d::UnitX()}) == no_hit);
  CHECK(first_hit(cylinder, {{-5, 0, 4.01}, Vector3d::UnitX()}) == no_hit);
  CHECK(first_hit(cylinder, {{-5, 0, -0.01}, Vector3d::UnitX()}) == no_hit);
  CHECK(first_hit(cylinder, {{5, 0, 2}, Vector3d::UnitX()}) == no_hit);
}

TEST_CASE("a ray along the axis misses a cylinder, and hits a cone only where it lies inside") {
  const ray outside = {{0.3, 0, -1}, Vector3d::UnitZ()}, wide = {{0.6, 0, -1}, Vector3d::UnitZ()};
  CHECK(first_hit(cylinder, outside) == no_hit);
  CHECK(first_hit(cone, outside) == Approx(3));  // the radius is 0.3 two metres up
  CHECK(first_hit(cone, wide) == no_hit);
}

TEST_CASE("a hit lies on the side of a cone that leans") {
  const frustum leaning = {{1, 2, 0}, {2, 1.5, 8}, 0.3, 0.05};
  const Vector3d axis = (leaning.top - leaning.bottom).normalized();
  const double length = (leaning.top - leaning.bottom).norm();
  const Vector3d scanner(-6, 3, 1.6);
  for (double height = 0.5; height < 7.9; height += 0.5) {
    const ray r = ray_through(scanner, leaning.bottom + height * axis);
    const double distance = first_hit(leaning, r);
    REQUIRE(distance < (leaning.bottom + height * axis - scanner).norm());
    const Vector3d hit = scanner + distance * r.direction - leaning.bottom;
    const double along = hit.dot(axis);
    CHECK((hit - along * axis).norm() == Approx(0.3 + (0.05 - 0.3) * along / length).epsilon(1e-9));
  }
}

TEST_CASE("leaves let a ray through as often as Beer and Lambert say, and return it from inside") {
  constexpr int rays = 20000;
  const leaf_cloud leaves = {{5, 0, 1}, {1, 2, 0.5}, 0.7};
  const ray r = {{0, 0, 1}, Vector3d::UnitX()};
  random_source random(1);
  int through = 0;
  for (int i = 0; i < rays; ++i) {
    const double distance = first_hit(leaves, r, random);
    if (distance == no_hit) {
      ++through;
    } else {
      REQUIRE(distance >= 4);
      REQUIRE(distance <= 6);
    }
  }
  const double expected = std::exp(-0.7 * 2);
  CHECK(std::abs(double(through) / rays - expected) < 4 * std::sqrt(expected * (1 - expected) / rays));
}

TEST_CASE("leaves beside a ray or behind it return nothing, and those around the scanner do") {
  const leaf_cloud dense = {{5, 0, 1}, {1, 2, 0.5}, 1e6};
  random_source random(2);
  CHECK(first_hit(dense, {{0, 0, 1.51}, Vector3d::UnitX()}, random) == no_hit);
  CHECK(first_hit(dense, {{0, 0, 1}, -Vector3d::UnitX()}, random) == no_hit);
  CHECK(first_hit(dense, {{5, 0, 1}, Vector3d::UnitX()}, random) < 0.001);
}

}  // namespace globalmatch::support
