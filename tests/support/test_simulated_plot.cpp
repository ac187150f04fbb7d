#include "support/simulated_plot.hpp"

#include "catch.hpp"
#include "message_of.hpp"

#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

namespace globalmatch::support {
namespace {

using Eigen::Vector3d;

double plan_distance(const Vector3d& a, const Vector3d& b) {
  return (a - b).head<2>().norm();
}

/// An option with a value that must be refused.
template <class Options>
using wrong_option = std::pair<std::string, std::function<void(Options&)>>;

}  // namespace

TEST_CASE("a plot is the same for one seed and another for the next") {
  plot_options options;
  const plot first = grow_plot(options), again = grow_plot(options);
  options.seed = 2;
  const plot other = grow_plot(options);
  REQUIRE(first.stems.size() == again.stems.size());
  REQUIRE(first.stems.size() == other.stems.size());
  for (std::size_t i = 0; i < first.stems.size(); ++i) {
    CHECK(first.stems[i].position == again.stems[i].position);
    CHECK(first.stems[i].trunk.top == again.stems[i].trunk.top);
    CHECK(first.stems[i].position != other.stems[i].position);
  }
}

TEST_CASE("stems are as many as asked for, on the plot, apart from one another, and within their limits") {
  plot_options options;
  options.width = 40;
  options.depth = 30;
  options.stems_per_hectare = 2000;
  options.slope = 10;
  const plot scene = grow_plot(options);
  REQUIRE(scene.stems.size() == 240);
  for (const simulated_stem& stem : scene.stems) {
    CHECK(std::abs(stem.position.x()) <= 20);
    CHECK(std::abs(stem.position.y()) <= 15);
    CHECK(stem.position.z() == scene.ground.height(stem.position.x(), stem.position.y()));
    CHECK(stem.radius >= options.min_radius);
    CHECK(stem.radius <= options.max_radius);
    for (const simulated_stem& other : scene.stems)
      if (&other != &stem) CHECK(plan_distance(stem.position, other.position) >= options.min_spacing);
  }
}

TEST_CASE(
    "a trunk passes through its position, has its radius at breast height, and leans no more than asked") {
  const plot_options options;
  for (const simulated_stem& stem : grow_plot(options).stems) {
    const Vector3d line = stem.trunk.top - stem.trunk.bottom;
    const Vector3d axis = line.normalized();
    const double below = (stem.position - stem.trunk.bottom).dot(axis);
    CHECK((stem.position - stem.trunk.bottom - below * axis).norm() < 1e-12);
    const double share = (below + 1.3) / line.norm();
    CHECK(stem.trunk.bottom_radius + share * (stem.trunk.top_radius - stem.trunk.bottom_radius) ==
          Approx(stem.radius));
    CHECK(axis.z() >= std::cos(options.max_lean * std::numbers::pi / 180));
    CHECK(line.norm() - below >= options.min_height - 1e-9);
    CHECK(line.norm() - below <= options.max_height + 1e-9);
  }
}

TEST_CASE("the ground rises by the slope, with waves no higher than the relief") {
  plot_options options;
  options.slope = 20;
  options.relief = 0.4;
  const height_field ground = grow_plot(options).ground;
  CHECK(ground.gradient.norm() == Approx(std::tan(20 * std::numbers::pi / 180)));
  double lowest = 0, highest = 0;
  for (double x = -25; x <= 25; x += 0.5) {
    for (double y = -25; y <= 25; y += 0.5) {
      const double wave = ground.height(x, y) - ground.gradient.dot(Eigen::Vector2d(x, y));
      lowest = std::min(lowest, wave);
      highest = std::max(highest, wave);
    }
  }
  CHECK(lowest >= -0.4);
  CHECK(highest <= 0.4);
  CHECK(highest - lowest > 0.2);
}

TEST_CASE("a plot may be bare: no stems, no crowns, no shrubs, no relief") {
  plot_options options;
  options.stems_per_hectare = options.shrubs_per_hectare = options.relief = 0;
  const plot scene = grow_plot(options);
  CHECK(scene.stems.empty());
  CHECK(scene.branches.empty());
  CHECK(scene.leaves.empty());
  CHECK(scene.ground.height(3, 4) == 0);
}

TEST_CASE(
    "stations stand level above the ground, clear of stems, around the first, each with a yaw of its own") {
  plot_options options;
  options.stems_per_hectare = 1500;
  options.slope = 15;
  const plot scene = grow_plot(options);
  const std::vector<station> stations = place_stations(scene, {.count = 5});
  REQUIRE(stations.size() == 5);
  CHECK(stations[0].plot_from_scan.translation().head<2>().norm() < 3);
  for (std::uint32_t i = 0; i < 5; ++i) {
    const Eigen::Isometry3d& pose = stations[i].plot_from_scan;
    const Vector3d place = pose.translation();
    CHECK(stations[i].number == i + 1);
    CHECK(place.z() == Approx(scene.ground.height(place.x(), place.y()) + 1.6));
    CHECK(pose.linear().isUnitary(1e-12));
    CHECK((pose.linear() * Vector3d::UnitZ() - Vector3d::UnitZ()).norm() < 1e-12);
    for (const simulated_stem& stem : scene.stems)
      CHECK(plan_distance(place, stem.position) - stem.radius >= 0.7);
    for (std::uint32_t j = 0; j < i; ++j) {
      CHECK(!pose.linear().isApprox(stations[j].plot_from_scan.linear(), 1e-3));
      CHECK(plan_distance(place, stations[j].plot_from_scan.translation()) > 5);
    }
  }
}

TEST_CASE("a single station needs no room around the middle") {
  plot_options options;
  options.width = options.depth = 5;
  const plot scene = grow_plot(options);
  CHECK(place_stations(scene, {.count = 1}).size() == 1);
}

TEST_CASE("grow_plot refuses options that make no sense, by name") {
  const double nan = std::nan("");
  const std::vector<wrong_option<plot_options>> all = {
      {"plot_options.width", [](plot_options& o) { o.width = 0; }},
      {"plot_options.depth", [nan](plot_options& o) { o.depth = nan; }},
      {"plot_options.stems_per_hectare", [](plot_options& o) { o.stems_per_hectare = -1; }},
      {"plot_options.stems_per_hectare", [](plot_options& o) { o.min_spacing = 10; }},
      {"plot_options.min_spacing", [](plot_options& o) { o.min_spacing = -0.1; }},
      {"plot_options.min_radius", [](plot_options& o) { o.min_radius = 0; }},
      {"plot_options.max_radius", [](plot_options& o) { o.max_radius = 0.01; }},
      {"plot_options.min_height", [](plot_options& o) { o.min_height = 1; }},
      {"plot_options.max_height", [](plot_options& o) { o.max_height = 5; }},
      {"plot_options.max_lean", [](plot_options& o) { o.max_lean = 90; }},
      {"plot_options.branches_per_stem", [](plot_options& o) { o.branches_per_stem = 1000000; }},
      {"plot_options.crown_density", [](plot_options& o) { o.crown_density = -1; }},
      {"plot_options.shrubs_per_hectare", [nan](plot_options& o) { o.shrubs_per_hectare = nan; }},
      {"plot_options.relief", [](plot_options& o) { o.relief = -1; }},
      {"plot_options.slope", [](plot_options& o) { o.slope = 60; }}};
  for (const auto& [field, spoil] : all) {
    plot_options options;
    spoil(options);
    INFO(field);
    CHECK(message_of([&] { grow_plot(options); }).starts_with(field));
  }
}

TEST_CASE("place_stations refuses options that make no sense, by name") {
  const plot scene = grow_plot();
  const std::vector<wrong_option<station_options>> all = {
      {"station_options.count", [](station_options& o) { o.count = 0; }},
      {"station_options.distance", [](station_options& o) { o.distance = 25; }},
      {"station_options.distance", [](station_options& o) { o.distance = 0; }},
      {"station_options.scanner_height", [](station_options& o) { o.scanner_height = 0; }},
      {"station_options.clearance", [](station_options& o) { o.clearance = -1; }},
      {"station_options.clearance", [](station_options& o) { o.clearance = 8; }}};
  for (const auto& [field, spoil] : all) {
    station_options options;
    spoil(options);
    INFO(field);
    CHECK(message_of([&] { place_stations(scene, options); }).starts_with(field));
  }
}

}  // namespace globalmatch::support
