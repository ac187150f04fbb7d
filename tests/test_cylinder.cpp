#include "globalmatch/detail/mapping/cylinder.hpp"

#include <cmath>
#include <vector>

#include "catch.hpp"
#include "forest_scenes.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "leaning_stems.hpp"

namespace globalmatch::test_cylinder {

using namespace detail;

using Vector3d = vec3;
using scenes::leaning;
using scenes::leaning_cylinder;
using scenes::upright;

TEST_CASE("distances from axis and surface, and the place of the axis at a height, are those of geometry") {
  const cylinder c{{1, 2, 3}, {0, 0, 1}, 0.5};
  CHECK(c.axis_distance({4, 6, 100}) == Approx(5));
  CHECK(c.surface_distance({4, 6, -100}) == Approx(4.5));
  CHECK(c.surface_distance({1, 2.25, 7}) == Approx(-0.25));
  CHECK(c.at_height(10) == Vector3d{1, 2, 10});
  const cylinder tilted{{0, 0, 0}, Vector3d{3, 0, 4}.normalized(), 0.1};
  CHECK((tilted.at_height(8) - Vector3d{6, 0, 8}).norm() < 1e-12);
  CHECK(tilted.axis_distance({4, 0, -3}) == Approx(5));
}

TEST_CASE("limits of radius and lean are inclusive") {
  cylinder_options options;
  CHECK(within_limits(upright(0, 0, 0, options.min_radius), options));
  CHECK(within_limits(upright(0, 0, 0, options.max_radius), options));
  CHECK_FALSE(within_limits(upright(0, 0, 0, options.min_radius - 1e-9), options));
  CHECK_FALSE(within_limits(upright(0, 0, 0, options.max_radius + 1e-9), options));
  CHECK(within_limits(leaning(0, 0, 0, 0.1, 29.99, 30), options));
  CHECK_FALSE(within_limits(leaning(0, 0, 0, 0.1, 30.01, 30), options));
}

TEST_CASE("points of a tapered cylinder that leans lie on its surface, at each height") {
  const cylinder c = leaning_cylinder();
  const vec3 across = c.axis.unit_orthogonal();
  for (const double z : {9.0, 12.2, 16.5}) {
    CHECK(c.at_height(z).z == Approx(z));
    CHECK(c.axis_distance(c.at_height(z)) == Approx(0).margin(1e-9));
    CHECK(c.surface_distance(c.at_height(z) + c.radius_at_height(z) * across) == Approx(0).margin(1e-9));
  }
  CHECK(c.radius_at_height(9) > c.radius_at_height(16.5));
}

TEST_CASE("a circle through three points is as far from each") {
  random_source random(1);
  for (int i = 0; i < 50; ++i) {
    const auto place = [&] { return vec2{30 + random.normal(), -8 + random.normal()}; };
    const vec2 a = place(), b = place(), c = place();
    const auto found = circle_through(a, b, c);
    REQUIRE(found);
    for (const vec2& p : {a, b, c}) CHECK((p - found->center).norm() == Approx(found->radius));
  }
}

TEST_CASE("the surface distance is that of the nearest point of the axis, less the radius there") {
  random_source random(13);
  const cylinder c = leaning_cylinder();
  for (int i = 0; i < 100; ++i) {
    const vec3 p = c.point + 2 * vec3{random.normal(), random.normal(), random.normal()};
    const double along = c.axis.dot(p - c.point);
    const double distance = (p - (c.point + along * c.axis)).norm();
    CHECK(c.axis_distance(p) == Approx(distance));
    CHECK(c.surface_distance(p) == Approx(distance - (0.23 - 0.011 * along)).margin(1e-12));
  }
}

TEST_CASE("there is no circle through points of a line, or through equal ones") {
  CHECK_FALSE(circle_through({1, 2}, {2, 4}, {-3, -6}));
  CHECK_FALSE(circle_through({1, 2}, {1, 2}, {5, -1}));
  CHECK_FALSE(circle_through({1, 2}, {1, 2}, {1, 2}));
  const auto found = circle_through({3, 1}, {-1, 5}, {-5, 1});
  REQUIRE(found);
  CHECK(found->center.x == Approx(-1));
  CHECK(found->center.y == Approx(1));
  CHECK(found->radius == Approx(4));
}

}  // namespace globalmatch::test_cylinder
