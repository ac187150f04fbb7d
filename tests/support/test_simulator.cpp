#include "support/simulator.hpp"

#include "catch.hpp"
#include "message_of.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

namespace globalmatch::support {
namespace {

using Eigen::Vector3d;

constexpr double degree = std::numbers::pi / 180;

plot small_plot(bool with_leaves = true) {
  plot_options options;
  options.width = options.depth = 24;
  options.slope = 8;
  if (!with_leaves) options.crown_density = options.shrubs_per_hectare = 0;
  return grow_plot(options);
}

std::vector<station> two_stations(const plot& scene) {
  return place_stations(scene, {.distance = 6});
}

scanner_options coarse_scanner() {
  scanner_options options;
  options.angular_step = 1;
  options.range_noise = 0;
  return options;
}

/// A scanner at the origin, 1.6 m above level ground, among upright cylinders.
struct bare_scene {
  plot scene = {50, 50};
  station origin = {Eigen::Isometry3d(Eigen::Translation3d(0, 0, 1.6))};

  void add_cylinder(double x, double y, double radius) {
    scene.stems.push_back({{x, y, 0}, radius, {{x, y, -0.5}, {x, y, 15}, radius, radius}});
  }
};

/// How far a point is from the side of a cone, measured across the axis; infinite beyond its ends.
double distance_from_side(const frustum& cone, const Vector3d& p) {
  const Vector3d line = cone.top - cone.bottom;
  const double share = (p - cone.bottom).dot(line) / line.squaredNorm();
  if (share < -1e-9 || share > 1 + 1e-9) return no_hit;
  const double radius = (1 - share) * cone.bottom_radius + share * cone.top_radius;
  return std::abs((p - cone.bottom - share * line).norm() - radius);
}

bool lies_on_a_surface(const plot& scene, const Vector3d& p) {
  constexpr double close = 1e-5;
  return std::abs(p.z() - scene.ground.height(p.x(), p.y())) < close ||
         std::any_of(scene.stems.begin(), scene.stems.end(),
                     [&](const simulated_stem& s) { return distance_from_side(s.trunk, p) < close; }) ||
         std::any_of(scene.branches.begin(), scene.branches.end(),
                     [&](const frustum& b) { return distance_from_side(b, p) < close; }) ||
         std::any_of(scene.leaves.begin(), scene.leaves.end(), [&](const leaf_cloud& l) {
           return (p - l.centre).cwiseQuotient(l.semi_axes).norm() < 1 + close;
         });
}

/// Where a ray first dives below the ground, found by small steps along it.
double ground_hit(const plot& scene, const ray& r, double max_range) {
  const auto above_ground = [&](double range) {
    const Vector3d p = r.origin + range * r.direction;
    return p.z() > scene.ground.height(p.x(), p.y());
  };
  double low = 0, high = 0.05;
  for (; above_ground(high); low = high, high += 0.05)
    if (high > max_range) return no_hit;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (above_ground(middle) ? low : high) = middle;
  }
  return low;
}

}  // namespace

TEST_CASE("a scan is the same bits for any number of threads") {
  const plot scene = small_plot();
  const station from = two_stations(scene)[1];
  scanner_options options = coarse_scanner();
  options.range_noise = 0.003;
  const simulated_scan one = scan_plot(scene, from, options, {.threads = 1});
  REQUIRE(one.points.size() > 10000);
  for (const int threads : {2, 3}) {
    const simulated_scan more = scan_plot(scene, from, options, {.threads = threads});
    CHECK(one.points == more.points);
    CHECK(one.returns_per_stem == more.returns_per_stem);
  }
}

TEST_CASE("another seed, or another station's number, gives other noise") {
  const bare_scene bare;
  scanner_options options = coarse_scanner();
  options.range_noise = 0.003;
  const simulated_scan scan = scan_plot(bare.scene, bare.origin, options);
  station other_number = bare.origin;
  other_number.number = 2;
  CHECK(scan.points != scan_plot(bare.scene, other_number, options).points);
  options.seed = 2;
  CHECK(scan.points != scan_plot(bare.scene, bare.origin, options).points);
}

TEST_CASE("the pose of each station lays its noiseless returns on ground, stems, branches and leaves") {
  const plot scene = small_plot();
  const scanner_options options = coarse_scanner();
  for (const station& from : two_stations(scene)) {
    const simulated_scan scan = scan_plot(scene, from, options);
    std::size_t on_surface = 0;
    bool in_range = true;
    for (const Vector3d& p : scan.points) {
      on_surface += lies_on_a_surface(scene, from.plot_from_scan * p);
      in_range = in_range && p.norm() >= options.min_range && p.norm() <= options.max_range;
    }
    CHECK(on_surface == scan.points.size());
    CHECK(in_range);
  }
}

TEST_CASE("a scan equals a brute-force search over all surfaces for the nearest along each ray") {
  const plot scene = small_plot(false);
  const station from = two_stations(scene)[1];
  scanner_options options = coarse_scanner();
  options.angular_step = 3;
  std::vector<Vector3d> expected;
  for (int column = 0; column < 120; ++column) {
    for (int row = 0; row < 50; ++row) {
      const double azimuth = 3 * (column + 0.5) * degree, elevation = (-60 + 3 * (row + 0.5)) * degree;
      const Vector3d direction(std::cos(elevation) * std::cos(azimuth),
                               std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      const ray r = {from.plot_from_scan.translation(), from.plot_from_scan.linear() * direction};
      double range = ground_hit(scene, r, options.max_range);
      for (const simulated_stem& s : scene.stems) range = std::min(range, first_hit(s.trunk, r));
      for (const frustum& b : scene.branches) range = std::min(range, first_hit(b, r));
      if (range >= options.min_range && range <= options.max_range) expected.push_back(range * direction);
    }
  }
  const simulated_scan scan = scan_plot(scene, from, options);
  CHECK(scan.rays == 120 * 50);
  REQUIRE(scan.points.size() == expected.size());
  double worst = 0;
  for (std::size_t i = 0; i < expected.size(); ++i)
    worst = std::max(worst, (scan.points[i] - expected[i]).norm());
  CHECK(worst < 1e-3);
}

TEST_CASE("a stem in the shadow of another one gets no returns") {
  bare_scene bare;
  bare.add_cylinder(10, 0, 0.1);
  scanner_options options = coarse_scanner();
  options.angular_step = 0.2;
  CHECK(scan_plot(bare.scene, bare.origin, options).returns_per_stem[0] > 20);
  bare.add_cylinder(5, 0, 0.3);
  const simulated_scan scan = scan_plot(bare.scene, bare.origin, options);
  CHECK(scan.returns_per_stem[0] == 0);
  CHECK(scan.returns_per_stem[1] > 20);
}

TEST_CASE("the returns of a bare cylinder match theory: d h / (r step)^2") {
  for (const double distance : {8.0, 12.0}) {
    bare_scene bare;
    bare.add_cylinder(0, distance, 0.2);
    scanner_options options = coarse_scanner();
    options.angular_step = 0.06;
    options.min_elevation = -12;
    options.max_elevation = 12;
    const simulated_scan scan = scan_plot(bare.scene, bare.origin, options);
    const double step = distance * options.angular_step * degree;  // [m] between rays at the stem
    CHECK(scan.returns_per_stem[0] == Approx(0.4 * (3 - 0.2) / (step * step)).epsilon(0.05));
  }
}

TEST_CASE("returns per stem equal a brute-force count of noiseless returns from 0.2 m to 3 m") {
  const plot scene = small_plot();
  const station from = two_stations(scene)[0];
  scanner_options options = coarse_scanner();
  options.angular_step = 0.5;
  const simulated_scan scan = scan_plot(scene, from, options);
  std::vector<std::uint32_t> counts(scene.stems.size());
  for (const Vector3d& in_scan : scan.points) {
    const Vector3d p = from.plot_from_scan * in_scan;
    const double height = p.z() - scene.ground.height(p.x(), p.y());
    if (height < 0.2 || height > 3) continue;
    for (std::size_t i = 0; i < counts.size(); ++i)
      counts[i] += distance_from_side(scene.stems[i].trunk, p) < 1e-9;
  }
  CHECK(scan.returns_per_stem == counts);
  CHECK(*std::max_element(counts.begin(), counts.end()) > 100);
}

TEST_CASE("ranges have gaussian noise of the size asked for, along the ray") {
  const plot scene = small_plot();
  const station from = two_stations(scene)[0];
  scanner_options options = coarse_scanner();
  const std::vector<Vector3d> exact = scan_plot(scene, from, options).points;
  options.range_noise = 0.01;
  const std::vector<Vector3d> noisy = scan_plot(scene, from, options).points;
  REQUIRE(exact.size() == noisy.size());
  double sum = 0, square_sum = 0, across = 0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    const double error = noisy[i].norm() - exact[i].norm();
    sum += error;
    square_sum += error * error;
    across = std::max(across, (noisy[i].normalized() - exact[i].normalized()).norm());
  }
  const double count = double(exact.size());
  CHECK(std::abs(sum / count) < 4 * 0.01 / std::sqrt(count));
  CHECK(std::sqrt(square_sum / count) == Approx(0.01).epsilon(0.05));
  CHECK(across < 1e-12);
}

TEST_CASE("what is nearer than the shortest range hides the rest but returns nothing") {
  bare_scene bare;
  bare.add_cylinder(5, 0, 0.1);
  scanner_options options = coarse_scanner();
  options.min_elevation = -15;
  options.max_elevation = 15;
  CHECK(scan_plot(bare.scene, bare.origin, options).returns_per_stem[0] > 20);
  bare.add_cylinder(0.4, 0, 0.1);
  const simulated_scan scan = scan_plot(bare.scene, bare.origin, options);
  CHECK(scan.returns_per_stem == std::vector<std::uint32_t>{0, 0});
}

TEST_CASE("scan_plot refuses options that make no sense, by name") {
  const bare_scene bare;
  const double nan = std::nan("");
  const std::vector<std::pair<std::string, std::function<void(scanner_options&)>>> all = {
      {"scanner_options.angular_step", [](scanner_options& o) { o.angular_step = 0; }},
      {"scanner_options.angular_step", [nan](scanner_options& o) { o.angular_step = nan; }},
      {"scanner_options.min_elevation", [](scanner_options& o) { o.min_elevation = -91; }},
      {"scanner_options.max_elevation", [](scanner_options& o) { o.max_elevation = -60; }},
      {"scanner_options.min_range", [](scanner_options& o) { o.min_range = -1; }},
      {"scanner_options.max_range", [](scanner_options& o) { o.max_range = 0.5; }},
      {"scanner_options.range_noise", [](scanner_options& o) { o.range_noise = -0.001; }}};
  for (const auto& [field, spoil] : all) {
    scanner_options options;
    spoil(options);
    INFO(field);
    CHECK(message_of([&] { scan_plot(bare.scene, bare.origin, options); }).starts_with(field));
  }
}

TEST_CASE("scan_plot refuses a station that is not level or stands in the ground") {
  const bare_scene bare;
  station tilted = bare.origin, buried = bare.origin;
  tilted.plot_from_scan.rotate(Eigen::AngleAxisd(0.05, Vector3d::UnitX()));
  buried.plot_from_scan.translation().z() = -0.1;
  for (const station& wrong : {tilted, buried})
    CHECK(message_of([&] { scan_plot(bare.scene, wrong); }).starts_with("station.plot_from_scan"));
}

}  // namespace globalmatch::support
