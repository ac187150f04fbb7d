#include "globalmatch/detail/published/cylinder_ransac.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "catch.hpp"
#include "cylinder_scenes.hpp"
#include "forest_scenes.hpp"
#include "support/message_of.hpp"

namespace globalmatch::test_cylinder_ransac {

using namespace detail;

using Vector3d = vec3;
using scenes::axis_error;
using scenes::leaning;
using scenes::on_surface;
using scenes::oriented_points;
using scenes::upright;
using support::message_of;

namespace {

constexpr double half_round = std::numbers::pi;

/// Adds points anywhere in a box around the stem that the laser could have hit: none inside it.
void add_outliers(oriented_points& seen, random_source& random, const cylinder& c, std::size_t count) {
  while (count > 0) {
    const Vector3d p =
        c.point + Vector3d{scenes::in_range(random, -0.5, 0.5), scenes::in_range(random, -0.5, 0.5),
                           scenes::in_range(random, 0, 3)};
    if (c.surface_distance(p) < 0.03) continue;
    seen.points.push_back(p);
    seen.normals.push_back(scenes::unit_direction(random));
    --count;
  }
}

std::optional<cylinder> fit(const oriented_points& seen, const cylinder_options& options = {}) {
  random_source random(options.seed);
  return fit_cylinder(seen.points, seen.normals, options, random);
}

}  // namespace

TEST_CASE("exact cylinders are recovered to a micrometre from half of their round") {
  random_source random(1);
  for (const cylinder& truth :
       {upright(0, 0, 0, 0.05), upright(3, -4, 1, 0.15), leaning(1, 2, 0, 0.3, 10, 50),
        leaning(-2, 0, 5, 0.1, 20, 200), upright(900, -700, 50, 0.55)}) {
    CAPTURE(truth.radius);
    const auto found = fit(on_surface(random, truth, 300, {.arc = half_round}));
    REQUIRE(found);
    CHECK(axis_error(truth, *found) < 1e-6);
    CHECK(found->radius == Approx(truth.radius).margin(1e-6));
    CHECK((found->axis - truth.axis).norm() < 1e-6);
  }
}

TEST_CASE("cylinders are recovered to 1 mm from half of their round with 3 mm noise and 30 % outliers") {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    random_source random(seed);
    const cylinder truth = leaning(scenes::in_range(random, -9, 9), scenes::in_range(random, -9, 9), 1,
                                   scenes::in_range(random, 0.06, 0.25), scenes::in_range(random, 0, 15),
                                   scenes::in_range(random, 0, 360));
    oriented_points seen = on_surface(random, truth, 1400, {.arc = half_round, .noise = 0.003});
    add_outliers(seen, random, truth, 600);
    const auto found = fit(seen);
    REQUIRE(found);
    CHECK(axis_error(truth, *found) < 0.001);
    CHECK(std::abs(found->radius - truth.radius) < 0.001);
    CHECK((found->axis - truth.axis).norm() < 0.001);
  }
}

TEST_CASE("of two cylinders the one that more points lie on is found") {
  random_source random(2);
  const cylinder more = upright(0, 0, 0, 0.12), fewer = upright(0.5, 0, 0, 0.15);
  oriented_points seen = on_surface(random, more, 600, {.noise = 0.002});
  const oriented_points other = on_surface(random, fewer, 300, {.noise = 0.002});
  seen.points.insert(seen.points.end(), other.points.begin(), other.points.end());
  seen.normals.insert(seen.normals.end(), other.normals.begin(), other.normals.end());
  const auto found = fit(seen);
  REQUIRE(found);
  CHECK(axis_error(more, *found) < 0.002);
}

TEST_CASE("useless normals do not hide an upright stem") {
  random_source random(3);
  const cylinder truth = upright(0, 0, 0, 0.1);
  oriented_points seen = on_surface(random, truth, 200, {.noise = 0.002});
  for (Vector3d& n : seen.normals) n = scenes::unit_direction(random);
  const auto found = fit(seen);
  REQUIRE(found);
  CHECK(axis_error(truth, *found) < 0.003);
}

TEST_CASE("the same seed gives the same bits, another seed may not") {
  random_source random(4);
  const cylinder truth = leaning(0, 0, 0, 0.15, 5, 0);
  oriented_points seen = on_surface(random, truth, 300, {.arc = half_round, .noise = 0.003});
  add_outliers(seen, random, truth, 150);
  const auto first = fit(seen), again = fit(seen);
  REQUIRE(first);
  REQUIRE(again);
  CHECK(first->point == again->point);
  CHECK(first->axis == again->axis);
  CHECK(first->radius == again->radius);
  cylinder_options other;
  other.seed = 99;
  const auto another = fit(seen, other);
  REQUIRE(another);
  CHECK(axis_error(*first, *another) < 0.001);
}

TEST_CASE("cylinders beyond the limits of radius and lean are not found") {
  random_source random(5);
  const auto find = [&](const cylinder& truth, const auto& change) {
    cylinder_options options;
    change(options);
    return fit(on_surface(random, truth, 300, {.noise = 0.001}), options);
  };
  const cylinder stem = leaning(0, 0, 0, 0.2, 12, 90);
  CHECK(find(stem, [](cylinder_options&) {}));
  CHECK_FALSE(find(stem, [](auto& o) { o.max_radius = 0.19; }));
  CHECK_FALSE(find(stem, [](auto& o) { o.min_radius = 0.21; }));
}

TEST_CASE("a cylinder within the limits is found, if any, in a stem beyond them") {
  random_source random(12);
  const cylinder_options options;
  int count = 0;
  for (const cylinder& truth :
       {upright(0, 0, 0, 0.8), leaning(0, 0, 0, 0.2, 60, 0), leaning(0, 0, 0, 0.2, 27, 0)}) {
    const auto found = fit(on_surface(random, truth, 300, {.noise = 0.001}));
    if (!found) continue;
    ++count;
    CHECK(within_limits(*found, options));
  }
  CHECK(count > 0);
}

TEST_CASE("a found cylinder always points up and lies within the limits") {
  const cylinder_options options;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    random_source random(seed);
    oriented_points clutter;
    add_outliers(clutter, random, upright(0, 0, 0, 0.05), 60);
    const auto found = fit(clutter);
    if (!found) continue;
    ++count;
    CHECK(found->axis.z > 0);
    CHECK(found->axis.norm() == Approx(1));
    CHECK(within_limits(*found, options));
  }
  CHECK(count > 10);
}

TEST_CASE("degenerate points make no cylinder") {
  const auto find = [](const std::vector<Vector3d>& points) {
    return fit({points, std::vector<Vector3d>(points.size(), Vector3d{1, 0, 0})});
  };
  CHECK_FALSE(find({}));
  CHECK_FALSE(find({{1, 2, 3}}));
  CHECK_FALSE(find(std::vector<Vector3d>(5, Vector3d{1, 2, 3})));
  CHECK_FALSE(find(std::vector<Vector3d>(50, Vector3d{1, 2, 3})));
  std::vector<Vector3d> pole, bar, wall;
  for (int i = 0; i < 50; ++i) {
    pole.push_back({1, 2, 0.06 * i});
    bar.push_back({0.06 * i, 2, 1});
    for (int j = 0; j < 20; ++j) wall.push_back({0.1 * j, 0, 0.06 * i});
  }
  CHECK_FALSE(find(pole));
  CHECK_FALSE(find(bar));
  CHECK_FALSE(find(wall));
}

TEST_CASE("zero normals do no harm") {
  random_source random(10);
  const cylinder truth = upright(0, 0, 0, 0.1);
  oriented_points seen = on_surface(random, truth, 200, {});
  for (Vector3d& n : seen.normals) n = {};
  const auto found = fit(seen);
  REQUIRE(found);
  CHECK(axis_error(truth, *found) < 1e-6);
}

TEST_CASE("fitting refuses bad arguments by name") {
  random_source random(11);
  const oriented_points seen = on_surface(random, upright(0, 0, 0, 0.1), 20, {});
  const auto message = [&](const auto& spoil) {
    cylinder_options options;
    spoil(options);
    return message_of([&] { require_valid(options); });
  };
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(message([](cylinder_options&) {}).empty());
  for (const double bad : {0.0, -1.0, 0.6, 1e-12, nan})
    CHECK(message([&](auto& o) { o.min_radius = bad; }).starts_with("cylinder.min_radius"));
  CHECK(message([&](auto& o) { o.max_radius = nan; }).find("cylinder.max_radius") != std::string::npos);
  for (const double bad : {-1.0, 90.0, nan})
    CHECK(message([&](auto& o) { o.max_tilt_deg = bad; }).starts_with("cylinder.max_tilt_deg"));
  for (const double bad : {0.0, -1.0, nan})
    CHECK(message([&](auto& o) { o.distance_tolerance = bad; }).starts_with("cylinder.distance_tolerance"));
  for (const double bad : {0.0, -1.0, nan, std::numeric_limits<double>::infinity()})
    CHECK(message([&](auto& o) { o.taper_weight = bad; }).starts_with("cylinder.taper_weight"));
  CHECK(message([](auto& o) { o.max_iterations = 0; }).starts_with("cylinder.max_iterations"));
  cylinder_options no_draws;
  no_draws.max_iterations = 0;
  CHECK(message_of([&] { fit(seen, no_draws); }).starts_with("cylinder.max_iterations"));
  const std::vector<Vector3d> too_few(19, Vector3d{1, 0, 0});
  CHECK(message_of([&] { fit_cylinder(seen.points, too_few, {}, random); }).starts_with("normals"));
}

TEST_CASE("the common direction is the one that the squares of the normals are least along") {
  random_source random(14);
  const vec3 axis = vec3{0.4, -0.2, 1}.normalized(), u = axis.unit_orthogonal(), v = axis.cross(u);
  std::vector<vec3> normals;
  for (int i = 0; i < 60; ++i) {
    const double angle = 2.1 * random.uniform();  // one side only
    const vec3 n = std::cos(angle) * u + std::sin(angle) * v + 0.02 * random.normal() * axis;
    normals.push_back(i % 3 == 0 ? -n.normalized() : n.normalized());
  }
  const vec3 found = common_direction(normals);
  CHECK(std::abs(found.dot(axis)) > 0.999);
  const auto along = [&](const vec3& d) {
    double squares = 0;
    for (const vec3& n : normals) squares += n.dot(d) * n.dot(d);
    return squares;
  };
  for (int i = 0; i < 200; ++i)
    CHECK(along(found) <= along((found + 0.1 * scenes::unit_direction(random)).normalized()) + 1e-12);
}

TEST_CASE("the cost of a surface is cut off at the tolerance, and doubled inside") {
  const cylinder c = upright(2, -1, 0, 0.3);
  const auto at = [&](double from_axis) { return vec3{2 + from_axis, -1, 4}; };
  constexpr double tolerance = 0.02;
  const auto cost = [&](std::vector<vec3> points, double enough = 1e9) {
    return surface_cost(c, points, tolerance, enough);
  };
  CHECK(cost({}) == 0);
  CHECK(cost({at(0.31)}) == Approx(0.0001));
  CHECK(cost({at(0.29)}) == Approx(0.0001));
  CHECK(cost({at(0.5)}) == Approx(0.0004));
  CHECK(cost({at(0.1)}) == Approx(0.0008));
  CHECK(cost({at(0.31), at(0.5), at(0.1)}) == Approx(0.0013));
  CHECK(cost({at(0.5), at(0.5), at(0.5), at(0.5)}, 0.0007) == Approx(0.0008));  // no need to go on
}

}  // namespace globalmatch::test_cylinder_ransac
