#include "globalmatch/detail/published/cylinder_ransac.hpp"

#include "catch.hpp"
#include "forest_scenes.hpp"
#include "support/message_of.hpp"

namespace globalmatch {

using namespace detail;

using Vector3d = vec3;
using scenes::leaning;
using scenes::seen_surface;
using scenes::upright;
using support::message_of;

namespace {

constexpr double half_round = std::numbers::pi;

struct oriented_points {
  std::vector<Vector3d> points, normals;
};

vec3 direction(random_source& random) {
  return from_eigen(scenes::random_direction(random));
}

/// Points on a cylinder with the normals of its surface, of either sign and a few degrees off.
oriented_points on_surface(random_source& random, const cylinder& c, std::size_t count,
                           const seen_surface& seen) {
  oriented_points result;
  for (std::size_t i = 0; i < count; ++i) {
    const auto [outwards, p] = scenes::random_surface_point(random, c, seen);
    const Vector3d normal = (outwards + 0.1 * direction(random)).normalized();
    result.points.push_back(p);
    result.normals.push_back(i % 2 == 0 ? normal : -normal);
  }
  return result;
}

/// Adds points anywhere in a box around the stem that the laser could have hit: none inside it.
void add_outliers(oriented_points& seen, random_source& random, const cylinder& c, std::size_t count) {
  while (count > 0) {
    const Vector3d p =
        c.point + Vector3d{scenes::in_range(random, -0.5, 0.5), scenes::in_range(random, -0.5, 0.5),
                           scenes::in_range(random, 0, 3)};
    if (c.surface_distance(p) < 0.03) continue;
    seen.points.push_back(p);
    seen.normals.push_back(direction(random));
    --count;
  }
}

std::optional<cylinder> fit(const oriented_points& seen, const cylinder_options& options = {}) {
  random_source random(options.seed);
  return fit_cylinder(seen.points, seen.normals, options, random);
}

/// Largest distance [m] of two axes over 3 m from the foot of the first.
double axis_error(const cylinder& truth, const cylinder& found) {
  double largest = 0;
  for (const double height : {0.0, 1.5, 3.0}) {
    const double z = truth.point.z + height;
    largest = std::max(largest, (truth.at_height(z) - found.at_height(z)).norm());
  }
  return largest;
}

}  // namespace

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
  for (Vector3d& n : seen.normals) n = direction(random);
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

TEST_CASE("limits of radius and lean are inclusive") {
  cylinder_options options;
  CHECK(within_limits(upright(0, 0, 0, options.min_radius), options));
  CHECK(within_limits(upright(0, 0, 0, options.max_radius), options));
  CHECK_FALSE(within_limits(upright(0, 0, 0, options.min_radius - 1e-9), options));
  CHECK_FALSE(within_limits(upright(0, 0, 0, options.max_radius + 1e-9), options));
  CHECK(within_limits(leaning(0, 0, 0, 0.1, 29.99, 30), options));
  CHECK_FALSE(within_limits(leaning(0, 0, 0, 0.1, 30.01, 30), options));
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

TEST_CASE("refining pulls a rough cylinder onto its points, and leaves outliers aside") {
  random_source random(6);
  const cylinder truth = leaning(5, 6, 0, 0.15, 8, 120);
  oriented_points seen = on_surface(random, truth, 500, {.arc = half_round});
  seen.points.push_back(truth.point + Vector3d{0.5, 0.5, 1});
  cylinder rough = truth;
  rough.point += Vector3d{0.005, -0.004, 0};
  rough.axis = (rough.axis + Vector3d{0.004, 0.003, 0}).normalized();
  rough.radius += 0.004;
  const auto found = refine_cylinder(rough, seen.points, 0.03, {});
  REQUIRE(found);
  CHECK(axis_error(truth, *found) < 1e-6);
  CHECK(found->radius == Approx(truth.radius).margin(1e-6));
}

TEST_CASE("refining gives nothing for few points, far ones, and none") {
  random_source random(7);
  const cylinder truth = upright(0, 0, 0, 0.15);
  const std::vector<Vector3d> few = on_surface(random, truth, 5, {}).points;
  CHECK_FALSE(refine_cylinder(truth, few, 0.03, {}));
  CHECK_FALSE(refine_cylinder(truth, {}, 0.03, {}));
  CHECK_FALSE(refine_cylinder(upright(2, 0, 0, 0.15), on_surface(random, truth, 100, {}).points, 0.03, {}));
}

TEST_CASE("the uncertainty of an axis grows as less of the round is seen, and with the noise") {
  random_source random(8);
  const cylinder truth = upright(0, 0, 0, 0.15);
  double last = 0;
  for (const double arc : {2 * half_round, half_round, half_round / 2, half_round / 6}) {
    const double sigma = axis_uncertainty(
        cylinder_covariance(truth, on_surface(random, truth, 300, {.arc = arc}).points, 0.003));
    CHECK(sigma > last);
    last = sigma;
  }
  const std::vector<Vector3d> points = on_surface(random, truth, 300, {.arc = half_round}).points;
  CHECK(axis_uncertainty(cylinder_covariance(truth, points, 0.006)) ==
        Approx(2 * axis_uncertainty(cylinder_covariance(truth, points, 0.003))));
}

TEST_CASE("the uncertainties of an axis and a radius are the scatter of their fits") {
  constexpr double noise = 0.003;
  constexpr int repetitions = 200;
  const cylinder truth = upright(0, 0, 1.5, 0.15);
  const seen_surface seen{.from = -1.5, .to = 1.5, .arc = half_round, .noise = noise};
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  double predicted = 0, squares = 0, radius_predicted = 0;
  for (int i = 0; i < repetitions; ++i) {
    random_source random(9, std::uint64_t(i));
    const std::vector<Vector3d> points = on_surface(random, truth, 200, seen).points;
    const auto found = refine_cylinder(truth, points, 0.03, {});
    REQUIRE(found);
    const Eigen::Vector2d error =
        to_eigen((found->at_height(found->point.z) - truth.at_height(found->point.z)).xy());
    covariance += error * error.transpose() / repetitions;
    const small_matrix told = cylinder_covariance(*found, points, noise);
    predicted += axis_uncertainty(told) / repetitions;
    squares += std::pow(found->radius - truth.radius, 2) / repetitions;
    radius_predicted += radius_uncertainty(told) / repetitions;
  }
  const double half = (covariance(0, 0) - covariance(1, 1)) / 2;
  const double largest = covariance.trace() / 2 + std::hypot(half, covariance(0, 1));
  CHECK(std::sqrt(largest) == Approx(predicted).epsilon(0.25));
  CHECK(std::sqrt(squares) == Approx(radius_predicted).epsilon(0.25));
}

TEST_CASE("a radius is less sure beyond the points it was seen by, where taper is not known") {
  random_source random(10);
  const cylinder truth = upright(0, 0, 1.5, 0.15);
  const auto seen = on_surface(random, truth, 300, {.from = -1, .to = 1, .noise = 0.003});
  const auto covariance = cylinder_covariance(truth, seen.points, 0.003, {.usual_taper = 0.005});
  CHECK(radius_uncertainty(covariance, 3) > 2 * radius_uncertainty(covariance, 0));
  CHECK(radius_uncertainty(cylinder_covariance(truth, seen.points, 0.003), 3) ==
        Approx(radius_uncertainty(cylinder_covariance(truth, seen.points, 0.003), 0)).epsilon(0.01));
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

}  // namespace globalmatch
