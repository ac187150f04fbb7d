#include "globalmatch/detail/mapping/ground.hpp"
#include "globalmatch/detail/mapping/terrain_model.hpp"
#include "globalmatch/detail/published/cloth_ground.hpp"

#include <functional>

#include "catch.hpp"
#include "containers.hpp"
#include "forest_scenes.hpp"
#include "support/message_of.hpp"

namespace globalmatch::test_ground {

using namespace detail;

using Eigen::Vector3d;
using Eigen::Vector3f;
using support::message_of;

namespace {

constexpr double size = 20;  // [m]
using height_function = std::function<double(double, double)>;

/// Where the terrain is looked at: on a fine grid that stays `margin` [m] away from the edge of the scan.
template <class Visit>
void for_each_place(double margin, const Visit& visit) {
  for (double x = margin; x <= size - margin; x += 0.23)
    for (double y = margin; y <= size - margin; y += 0.23) visit(x, y);
}

/// Largest error of the terrain's height, for a scan in a frame whose z is up.
double max_error(const terrain& ground, const height_function& truth, double margin = 0) {
  double largest = 0;
  for_each_place(margin, [&](double x, double y) {
    const vec3 local = ground.frame.to_local({x, y, truth(x, y)});
    const auto height = ground.height_at(local.x, local.y);
    largest = std::max(largest, height ? std::abs(*height - local.z) : 1e9);
  });
  return largest;
}

std::optional<double> height_in_scan(const terrain& ground, double x, double y) {
  const vec3 local = ground.frame.to_local({x, y, 0});
  const auto height = ground.height_at(local.x, local.y);
  if (!height) return std::nullopt;
  return *height - local.z;
}

/// With the steps that the options ask for.
template <class Scan>
ground_model model_ground(const Scan& scan, const ground_options& options = {},
                          const Vector3d& up = Vector3d::UnitZ(), const execution& exec = {}) {
  bare_ground_finder* const find =
      options.filter == ground_filter::cloth ? &cloth_under_vegetation : &planes_under_vegetation;
  const auto model_of = [&](lowest_raster&& lowest, const ground_funnel& funnel, bool is_noisy) {
    return model_terrain(std::move(lowest), funnel, options, find, exec, is_noisy);
  };
  return model_ground(scan, options, from_eigen(up), model_of, exec);
}

constexpr double noise = 0.005;  // [m] standard deviation of the ground points

/// Some points again, lower by one to three metres.
void add_multipath(scenes::cloud& scan, random_source& random) {
  const auto count = static_cast<std::uint32_t>(scan.size());
  for (int i = 0; i < 40; ++i) {
    const Vector3d depth(0, 0, scenes::in_range(random, 1, 3));
    scan.push_back(scenes::exact(scan[random.below(count)].cast<double>() - depth));
  }
}

scenes::cloud sloped_scan(std::uint64_t seed, const scenes::slope& plane) {
  random_source random(seed);
  scenes::cloud scan = scenes::ground_points(random, size, 0.1, noise, plane);
  add_multipath(scan, random);
  return scan;
}

double rolling(double x, double y) {
  return 0.5 * std::sin(x / 2) + 0.3 * std::cos(y / 1.5);
}

}  // namespace

TEST_CASE("slopes with noise and multipath points are recovered to 2 cm, up to the edge of the scan") {
  for (const double degrees : {0, 15, 30})
    for (const double azimuth : {0, 60, 225}) {
      CAPTURE(degrees, azimuth);
      const scenes::slope plane{degrees, azimuth};
      const ground_model model = model_ground(sloped_scan(1, plane));
      CHECK(max_error(model.terrain, plane, 1) < 0.02);
      CHECK(max_error(model.terrain, plane) < 0.02);
      CHECK(model.funnel.low_outliers > 30);
    }
}

TEST_CASE("a slope does not sink the terrain, on the mean over the scan") {
  for (const double degrees : {0, 15, 30}) {
    CAPTURE(degrees);
    const scenes::slope plane{degrees, 30};
    const ground_model model = model_ground(sloped_scan(2, plane));
    double sum = 0, count = 0;
    for_each_place(0, [&](double x, double y) {
      if (const auto height = height_in_scan(model.terrain, x, y)) {
        sum += *height - plane(x, y);
        ++count;
      }
    });
    CHECK(std::abs(sum / count) < 0.01);
  }
}

TEST_CASE("bumps and hollows of the ground are followed") {
  random_source random(3);
  scenes::cloud scan = scenes::ground_points(random, size, 0.1, noise, rolling);
  add_multipath(scan, random);
  CHECK(max_error(model_ground(scan).terrain, rolling, 0.5) < 0.06);
}

TEST_CASE("a hole in the ground is known as a hole, and spanned") {
  random_source random(4);
  const scenes::slope plane{10, 0};
  scenes::cloud scan = scenes::ground_points(random, size, 0.1, noise, plane);
  std::erase_if(scan, [](const Vector3f& p) { return std::hypot(p.x() - 10, p.y() - 10) < 3; });
  const terrain ground = model_ground(scan).terrain;
  CHECK(height_in_scan(ground, 10, 10) == std::nullopt);
  CHECK(height_in_scan(ground, 11, 10.5) == std::nullopt);
  CHECK(height_in_scan(ground, 13.5, 10).has_value());
  const vec3 local = ground.frame.to_local({10, 10, plane(10, 10)});
  CHECK_FALSE(ground.is_known(local.x, local.y));
  CHECK(std::abs(ground.interpolated_height(local.x, local.y) - local.z) < 0.1);
}

TEST_CASE("the terrain ends where the scan does") {
  random_source random(5);
  const terrain ground = model_ground(scenes::ground_points(random, size, 0.1, 0, scenes::slope{})).terrain;
  CHECK(height_in_scan(ground, 0.1, 0.1).has_value());
  CHECK(height_in_scan(ground, size - 0.1, size - 0.1).has_value());
  CHECK(height_in_scan(ground, size + 2, 10) == std::nullopt);
  CHECK(height_in_scan(ground, 10, -2) == std::nullopt);
}

TEST_CASE("shrubs, stems and a roof of leaves do not lift the terrain by more than 5 cm") {
  random_source random(6);
  for (const double degrees : {0, 20}) {
    CAPTURE(degrees);
    const scenes::slope plane{degrees, 45};
    scenes::cloud scan = scenes::ground_points(random, size, 0.1, noise, plane);
    for (int i = 0; i < 40; ++i) {
      const double x = scenes::in_range(random, 0, size), y = scenes::in_range(random, 0, size);
      const Vector3d foot(x, y, plane(x, y));
      // Dense enough to hide most of the ground below it.
      std::erase_if(scan, [&](const Vector3f& p) {
        return random.uniform() < 0.8 && (p.cast<double>() - foot).head<2>().norm() < 0.5;
      });
      scenes::append(scan, scenes::shrub_points(random, foot + Vector3d(0, 0, 0.6), 0.5, 500));
      scenes::append(scan, scenes::stem_points(random, scenes::upright(y, x, plane(y, x), 0.1), 300));
    }
    for (const Vector3f& p : scenes::random_cloud(random, 5000, size))
      scan.push_back(scenes::exact({p.x(), p.y(), plane(p.x(), p.y()) + 8 + 0.1 * p.z()}));
    CHECK(max_error(model_ground(scan).terrain, plane) < 0.05);
  }
}

TEST_CASE("every container gives the same terrain, bit for bit") {
  const scenes::cloud scan = sloped_scan(7, {12, 100});
  const ground_model expected = model_ground(scan);
  containers::for_each_container(scan, [&](const std::string& kind, const auto& range) {
    CAPTURE(kind);
    const ground_model model = model_ground(range);
    CHECK((model.terrain.heights == expected.terrain.heights));
    CHECK((model.terrain.has_data == expected.terrain.has_data));
    CHECK(model.terrain.frame.origin == expected.terrain.frame.origin);
    CHECK(model.funnel.points == scan.size());
    CHECK(model.funnel.ground_points == expected.funnel.ground_points);
  });
}

TEST_CASE("the terrain has the same bits for 1, 2 and 8 threads") {
  const scenes::cloud scan = sloped_scan(8, {20, 10});
  const Vector3d up = Vector3d::UnitZ();
  const terrain alone = model_ground(scan, {}, up, {.threads = 1}).terrain;
  for (const int threads : {2, 8}) {
    const terrain together = model_ground(scan, {}, up, {.threads = threads}).terrain;
    CHECK((together.heights == alone.heights));
    CHECK((together.has_data == alone.has_data));
  }
}

TEST_CASE("a scan in map coordinates has the same terrain in a shifted frame") {
  const scenes::cloud scan = sloped_scan(9, {20, 200});
  const Vector3d shift(500000, 5300000, 1000);
  std::vector<Vector3d> shifted;
  for (const Vector3f& p : scan) shifted.push_back(p.cast<double>() + shift);
  const terrain here = model_ground(scan).terrain, there = model_ground(shifted).terrain;
  CHECK((there.heights == here.heights));
  CHECK((there.has_data == here.has_data));
  CHECK(there.frame.origin == here.frame.origin + detail::from_eigen(shift));
}

TEST_CASE("the terrain of a turned scan is the same along its own up") {
  const scenes::slope plane{15, 70};
  const Vector3d up = Vector3d(0.4, -0.2, 0.8).normalized();
  const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), up);
  std::vector<Vector3d> turned;
  for (const Vector3f& p : sloped_scan(10, plane)) turned.push_back(turn * p.cast<double>());
  const terrain ground = model_ground(turned, {}, up).terrain;
  double largest = 0;
  for_each_place(0.5, [&](double x, double y) {
    const vec3 local = ground.frame.to_local(from_eigen(turn * Vector3d(x, y, plane(x, y))));
    const auto height = ground.height_at(local.x, local.y);
    largest = std::max(largest, height ? std::abs(*height - local.z) : 1e9);
  });
  CHECK(largest < 0.02);
}

TEST_CASE("outliers a million kilometres away and points that are not finite do not change the terrain") {
  const scenes::slope plane{15, 70};
  const scenes::cloud scan = sloped_scan(11, plane);
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  for (const Vector3f& outlier : {Vector3f(1e9f, 0, 0), Vector3f(5, 5, -1e9f), Vector3f(5, 5, 1e9f),
                                  Vector3f(-1e9f, 1e9f, -1e9f), Vector3f(nan, 1, 1)}) {
    CAPTURE(outlier.transpose());
    scenes::cloud spoiled = scan;
    spoiled.insert(spoiled.begin() + 1000, outlier);
    CHECK(max_error(model_ground(spoiled).terrain, plane) < 0.02);
    spoiled.insert(spoiled.begin(), outlier);
    CHECK(max_error(model_ground(spoiled).terrain, plane) < 0.02);
  }
}

TEST_CASE("without finite points the terrain is empty, and the funnel says why") {
  const Vector3d not_finite(0, 0, std::numeric_limits<double>::infinity());
  for (const auto& scan : {std::vector<Vector3d>{}, std::vector<Vector3d>(7, not_finite)}) {
    const ground_model model = model_ground(scan);
    CHECK(model.terrain.empty());
    CHECK(model.funnel.points == scan.size());
    CHECK(model.funnel.not_finite == scan.size());
    CHECK(model.funnel.ground_points == 0);
  }
}

TEST_CASE("one point, equal points and collinear points have a terrain through them") {
  std::vector<Vector3d> line;
  for (int i = 0; i < 50; ++i) line.push_back({0.25 * i, 3, 0});
  for (const auto& scan : {std::vector<Vector3d>{{7, 8, 9}}, std::vector<Vector3d>(100, {7, 8, 9}), line}) {
    const ground_model model = model_ground(scan);
    REQUIRE_FALSE(model.terrain.empty());
    for (const Vector3d& p : scan) {
      const auto height = height_in_scan(model.terrain, p.x(), p.y());
      REQUIRE(height);
      CHECK(*height == Approx(p.z()).margin(1e-3));
    }
    CHECK(std::all_of(model.terrain.heights.begin(), model.terrain.heights.end(),
                      [](float z) { return std::isfinite(z); }));
  }
}

TEST_CASE("the ground points are points of the scan that lie near the terrain") {
  const scenes::slope plane{10, 0};
  const scenes::cloud scan = sloped_scan(12, plane);
  const ground_model model = model_ground(scan);
  CHECK(model.funnel.ground_points == model.terrain.ground.size());
  CHECK(model.terrain.ground.size() > 4000);
  float largest = 0;
  for (const vec3f& p : model.terrain.ground) {
    const Vector3d q = to_eigen(model.terrain.frame.to_scan(vec3(p)));
    largest = std::max(largest, float(std::abs(q.z() - plane(q.x(), q.y()))));
  }
  CHECK(largest < 0.1f);
}

TEST_CASE("bad ground options are refused by name") {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const auto message = [](const auto& spoil) {
    ground_options options;
    spoil(options);
    return message_of([&] { model_ground(std::vector<Vector3d>{}, options); });
  };
  CHECK(message([](ground_options&) {}).empty());
  for (const double bad : {0.0, -1.0, nan, std::numeric_limits<double>::infinity()}) {
    CHECK(message([&](auto& o) { o.resolution = bad; }).starts_with("ground.resolution"));
    CHECK(message([&](auto& o) { o.cloth.time_step = bad; }).starts_with("ground.cloth.time_step"));
    CHECK(message([&](auto& o) { o.cloth.gravity = bad; }).find("ground.cloth.gravity") != std::string::npos);
    CHECK(message([&](auto& o) { o.low_point_depth = bad; }).starts_with("ground.low_point_depth"));
    CHECK(message([&](auto& o) { o.max_slope = bad; }).starts_with("ground.max_slope"));
    CHECK(message([&](auto& o) { o.ground_band = bad; }).starts_with("ground.ground_band"));
    CHECK(message([&](auto& o) { o.hole_radius = bad; }).starts_with("ground.hole_radius"));
  }
  CHECK(message([](auto& o) { o.resolution = 1e-12; }).starts_with("ground.resolution"));
  for (const double bad : {-1.0, nan}) {
    CHECK(message([&](auto& o) {
            o.cloth.convergence_threshold = bad;
          }).starts_with("ground.cloth.convergence_threshold"));
    CHECK(message([&](auto& o) { o.cloth.slope_step = bad; }).starts_with("ground.cloth.slope_step"));
  }
  CHECK(message([](auto& o) { o.cloth.rigidness = 0; }).starts_with("ground.cloth.rigidness"));
  CHECK(message([](auto& o) { o.cloth.max_iterations = 0; }).starts_with("ground.cloth.max_iterations"));
}

TEST_CASE("modelling the ground can be cancelled at any report") {
  const scenes::cloud scan = sloped_scan(13, {});
  for (int allowed = 0; allowed < 3; ++allowed) {
    int reports = 0;
    const execution exec{.on_progress = [&](const progress&) { return reports++ < allowed; }};
    CHECK_THROWS_AS(model_ground(scan, {}, Vector3d::UnitZ(), exec), operation_cancelled);
    CHECK(reports == allowed + 1);
  }
}

}  // namespace globalmatch::test_ground
