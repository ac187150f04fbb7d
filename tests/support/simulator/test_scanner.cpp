#include "support/simulator/scanner.hpp"

#include "bare_plot.hpp"
#include "catch.hpp"
#include "support/message_of.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace globalmatch::support::test_scanner {
namespace {

using namespace detail;

using Eigen::Vector3d;

plot bare_plot(std::vector<stem> stems = {}) {
  plot scene = grow_plot(bare_options());
  scene.stems = std::move(stems);
  return scene;
}

scanner_options level_band(scanner_options o, double half_width) {
  o.min_elevation = -half_width;
  o.max_elevation = half_width;
  return o;
}

/// Same rays, same hits: what differs is what the errors did to the ranges.
struct compared_scans {
  std::vector<Vector3d> exact, measured;

  double error(std::size_t i) const { return measured[i].norm() - exact[i].norm(); }
};

compared_scans compare(const plot& scene, scanner_options options) {
  const std::vector<Vector3d> measured = scan_of(scene, options).points;
  options.range_noise = options.noise_per_metre = options.mixed_pixels = options.multipath = 0;
  return {scan_of(scene, options).points, measured};
}

}  // namespace

TEST_CASE("the returns of a bare cylinder match theory: d h / (r step)^2") {
  struct trial {
    double diameter, range, step;
  };
  for (const trial& t : {trial{0.4, 8, 0.06}, trial{0.2, 12, 0.036}, trial{0.3, 20, 0.036},
                         trial{0.6, 25, 0.05}, trial{0.1, 10, 0.036}}) {
    INFO(t.diameter << " m thick, " << t.range << " m away, " << t.step << " degrees");
    const plot scene = bare_plot({cylinder(0, t.range, t.diameter)});
    const simulated_scan scan = scan_of(scene, level_band(perfect_scanner(t.step), 12));
    const double spacing = t.range * t.step * degree;  // [m] between rays at the stem
    CHECK(scan.returns_per_stem[0] == Approx(t.diameter * (3 - 0.2) / (spacing * spacing)).epsilon(0.05));
  }
}

TEST_CASE("what stands behind a stem gets no returns, and the stem itself does") {
  const scanner_options options = level_band(perfect_scanner(0.2), 12);
  CHECK(scan_of(bare_plot({cylinder(10, 0, 0.2)}), options).returns_per_stem[0] > 50);
  const auto returns =
      scan_of(bare_plot({cylinder(10, 0, 0.2), cylinder(5, 0, 0.6)}), options).returns_per_stem;
  CHECK(returns[0] == 0);
  CHECK(returns[1] > 50);
}

TEST_CASE("what is nearer than the shortest range hides the rest but returns nothing") {
  const scanner_options options = level_band(perfect_scanner(0.5), 12);
  const auto returns =
      scan_of(bare_plot({cylinder(5, 0, 0.2), cylinder(0.4, 0, 0.2)}), options).returns_per_stem;
  CHECK(returns == std::vector<std::uint32_t>{0, 0});
}

TEST_CASE("noiseless returns from level ground lie on it, within the scanner's ranges") {
  scanner_options options = perfect_scanner(1);
  options.min_range = 3;
  options.max_range = 20;
  const simulated_scan scan = scan_of(bare_plot(), options);
  CHECK(scan.rays == 360 * 145);
  REQUIRE(scan.points.size() > 8000);
  double highest = 0, nearest = 100, furthest = 0;
  for (const Vector3d& p : scan.points) {
    highest = std::max(highest, std::abs(p.z() + 1.6));
    nearest = std::min(nearest, p.norm());
    furthest = std::max(furthest, p.norm());
  }
  CHECK(highest < 1e-4);
  CHECK(nearest >= 3);
  CHECK(furthest <= 20);
}

TEST_CASE("ranges have gaussian noise of the size asked for, along the ray, and more of it far away") {
  scanner_options options = perfect_scanner(0.5);
  options.range_noise = 0.01;
  SECTION("the same everywhere") {
    const compared_scans scans = compare(bare_plot(), options);
    REQUIRE(scans.exact.size() == scans.measured.size());
    double sum = 0, square_sum = 0, across = 0, beyond_two = 0;
    for (std::size_t i = 0; i < scans.exact.size(); ++i) {
      sum += scans.error(i);
      square_sum += scans.error(i) * scans.error(i);
      beyond_two += std::abs(scans.error(i)) > 0.02;
      across = std::max(across, (scans.exact[i].normalized() - scans.measured[i].normalized()).norm());
    }
    const double count = double(scans.exact.size());
    CHECK(std::abs(sum / count) < 4 * 0.01 / std::sqrt(count));
    CHECK(std::sqrt(square_sum / count) == Approx(0.01).epsilon(0.03));
    CHECK(beyond_two / count == Approx(0.0455).epsilon(0.1));
    CHECK(across < 1e-12);
  }
  SECTION("growing with range") {
    options.noise_per_metre = 0.001;
    const compared_scans scans = compare(bare_plot(), options);
    double square_sum = 0;
    for (std::size_t i = 0; i < scans.exact.size(); ++i)
      square_sum += std::pow(scans.error(i) / (0.01 + 0.001 * scans.exact[i].norm()), 2);
    CHECK(std::sqrt(square_sum / double(scans.exact.size())) == Approx(1).epsilon(0.03));
  }
}

TEST_CASE("mixed pixels lie between two surfaces that one beam hits, at edges only") {
  // A stem 10 m away, and one as wide as a wall whose face is 1 m behind it.
  const plot scene = bare_plot({cylinder(10, 0, 0.4), cylinder(21, 0, 20)});
  scanner_options options = level_band(perfect_scanner(0.02), 0.5);
  options.mixed_pixels = 1;
  options.max_range = 15;
  const compared_scans scans = compare(scene, options);
  REQUIRE(scans.exact.size() == scans.measured.size());
  const double edge = std::asin(0.2 / 10);
  const double beam = options.beam_radius / 10 + 1e-3 * options.beam_divergence;
  int mixed = 0, away_from_edges = 0, outside_the_gap = 0;
  for (std::size_t i = 0; i < scans.exact.size(); ++i) {
    if (std::abs(scans.error(i)) < 1e-6) continue;
    const double azimuth = std::abs(std::atan2(scans.exact[i].y(), scans.exact[i].x()));
    // At the wall's own edges beams leave into the open, and graze.
    if (azimuth > 0.3) continue;
    ++mixed;
    away_from_edges += std::abs(azimuth - edge) > 1.2 * beam;
    outside_the_gap += scans.measured[i].norm() < 9.9 || scans.measured[i].norm() > 11.3;
  }
  CHECK(mixed > 20);
  CHECK(away_from_edges == 0);
  CHECK(outside_the_gap == 0);
}

TEST_CASE("surfaces further apart than a pulse is long are resolved: no mixed pixels") {
  const plot scene = bare_plot({cylinder(10, 0, 0.4), cylinder(23, 0, 20)});  // the gap is 3 m
  scanner_options options = level_band(perfect_scanner(0.02), 0.5);
  options.mixed_pixels = 1;
  options.max_range = 15;
  const compared_scans scans = compare(scene, options);
  std::size_t on_stem = 0, on_wall = 0, between = 0;
  for (const Vector3d& p : scans.measured) {
    if (std::abs(p.y()) > 3) continue;  // at the wall's own edges beams graze
    on_stem += p.norm() < 10.2;
    on_wall += p.norm() > 12.9;
    between += p.norm() >= 10.2 && p.norm() <= 12.9;
  }
  CHECK(on_stem > 1000);
  CHECK(on_wall > 1000);
  CHECK(between == 0);
}

TEST_CASE("multipath points lie below the ground, on their ray, as often as asked for") {
  scanner_options options = perfect_scanner(0.25);
  options.multipath = 0.01;
  options.max_elevation = -10;  // flatter rays hardly get below the ground
  const compared_scans scans = compare(bare_plot({cylinder(10, 0, 0.4)}), options);
  REQUIRE(scans.exact.size() == scans.measured.size());
  std::size_t low = 0;
  for (std::size_t i = 0; i < scans.exact.size(); ++i) {
    if (scans.error(i) == 0) continue;
    ++low;
    CHECK(scans.measured[i].z() < -1.6 - 0.3);
    CHECK(scans.error(i) > 0.5);
    CHECK(scans.error(i) < 5);
    CHECK((scans.measured[i].normalized() - scans.exact[i].normalized()).norm() < 1e-12);
  }
  const double share = double(low) / double(scans.exact.size());
  CHECK(share > 0.006);
  CHECK(share < 0.01);
}

TEST_CASE("multipath points are few and isolated unless asked for otherwise") {
  scanner_options options = perfect_scanner(0.1);
  options.multipath = scanner_options().multipath;
  std::vector<Vector3d> low;
  for (const Vector3d& p : scan_of(bare_plot(), options).points)
    if (p.z() < -1.9) low.push_back(p);
  CHECK(low.size() >= 3);
  CHECK(low.size() < 100);
  for (const Vector3d& p : low)
    CHECK(std::count_if(low.begin(), low.end(), [&](const Vector3d& q) { return (p - q).norm() < 0.1; }) ==
          1);
}

TEST_CASE("a scan is the same bits for any number of threads, and another for another station or seed") {
  plot_options grown;
  grown.width = grown.depth = 20;
  grown.margin = 0;
  const plot scene = grow_plot(grown);
  station from = place_stations(scene, {.count = 1})[0];
  scanner_options options;
  options.angular_step = 0.5;
  options.multipath = 0.001;
  const auto scan = [&](int threads) {
    const ray_caster caster(surfaces_of(scene), {.threads = threads});
    return scan_from(from, scene, caster, options, {.threads = threads});
  };
  const simulated_scan one = scan(1);
  REQUIRE(one.points.size() > 50000);
  for (const int threads : {2, 3}) {
    const simulated_scan more = scan(threads);
    CHECK(one.points == more.points);
    CHECK(one.returns_per_stem == more.returns_per_stem);
  }
  from.number = 2;
  CHECK(scan(1).points != one.points);
  from.number = 1;
  options.seed = 2;
  CHECK(scan(1).points != one.points);
}

TEST_CASE("a carried scanner sees all around its way, more where it has been, and its drift is bounded") {
  const plot scene = bare_plot({cylinder(0, 6, 0.4)});
  const ray_caster caster(surfaces_of(scene));
  std::vector<Vector3d> path;
  for (double x = -8; x <= 8; x += 0.5) path.emplace_back(x, 0, 1.6);
  station from;
  from.plot_from_scan = Eigen::Translation3d(path[0]) * Eigen::AngleAxisd(1, Vector3d::UnitZ());
  const mobile_options mobile = {.step = 0.5, .rays_per_place = 4000, .drift = 0.05};
  const simulated_scan scan = scan_along(path, from, scene, caster, perfect_scanner(1), mobile);
  CHECK(scan.rays == path.size() * 4000);
  CHECK(scan.returns_per_stem[0] > 100);
  std::size_t near = 0, far = 0;
  double worst = 0;
  for (const Vector3d& in_scan : scan.points) {
    const Vector3d p = from.plot_from_scan * in_scan;
    near += std::abs(p.x()) < 5 && std::abs(p.y()) < 2;
    far += std::abs(p.x()) < 5 && std::abs(p.y() - 12) < 2;
    if (std::abs(p.y()) < 5) worst = std::max(worst, std::abs(p.z()));  // there is nothing but the ground
  }
  CHECK(near > 10 * far);
  CHECK(far > 0);
  CHECK(worst <= 0.05 + 1e-4);
  CHECK(worst > 0.001);
  const auto again = scan_along(path, from, scene, caster, perfect_scanner(1), mobile, {.threads = 1});
  CHECK(again.points == scan.points);
}

TEST_CASE("scanners refuse options that make no sense, by name") {
  const plot scene = bare_plot();
  const ray_caster caster(surfaces_of(scene));
  const double nan = std::nan("");
  const std::vector<wrong_option<scanner_options>> all = {
      {"scanner_options.angular_step", [](auto& o) { o.angular_step = 0; }},
      {"scanner_options.angular_step", [nan](auto& o) { o.angular_step = nan; }},
      {"scanner_options.min_elevation", [](auto& o) { o.min_elevation = -91; }},
      {"scanner_options.max_elevation", [](auto& o) { o.max_elevation = -60; }},
      {"scanner_options.min_range", [](auto& o) { o.min_range = -1; }},
      {"scanner_options.max_range", [](auto& o) { o.max_range = 0.5; }},
      {"scanner_options.range_noise", [](auto& o) { o.range_noise = -0.001; }},
      {"scanner_options.noise_per_metre", [nan](auto& o) { o.noise_per_metre = nan; }},
      {"scanner_options.beam_radius", [](auto& o) { o.beam_radius = 1; }},
      {"scanner_options.beam_divergence", [](auto& o) { o.beam_divergence = -1; }},
      {"scanner_options.mixed_pixels", [](auto& o) { o.mixed_pixels = 1.5; }},
      {"scanner_options.multipath", [](auto& o) { o.multipath = -0.1; }}};
  for (const auto& [field, spoil] : all) {
    scanner_options options;
    spoil(options);
    INFO(field);
    CHECK(message_of([&] { scan_from(in_the_middle(), scene, caster, options); }).starts_with(field));
  }
  station buried;
  buried.plot_from_scan.translation().z() = -0.1;
  CHECK(message_of([&] { scan_from(buried, scene, caster); }).starts_with("station.plot_from_scan"));
  const std::vector<wrong_option<mobile_options>> mobile = {
      {"mobile_options.step", [](auto& o) { o.step = 0; }},
      {"mobile_options.rays_per_place", [](auto& o) { o.rays_per_place = 0; }},
      {"mobile_options.drift", [nan](auto& o) { o.drift = nan; }}};
  for (const auto& [field, spoil] : mobile) {
    mobile_options options;
    spoil(options);
    INFO(field);
    CHECK(message_of([&] {
            scan_along({{0, 0, 1}}, in_the_middle(), scene, caster, {}, options);
          }).starts_with(field));
  }
}

}  // namespace globalmatch::support::test_scanner
