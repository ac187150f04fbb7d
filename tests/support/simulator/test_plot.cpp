#include "support/simulator/plot.hpp"

#include "bare_plot.hpp"
#include "catch.hpp"
#include "support/message_of.hpp"
#include "support/simulator/stations.hpp"

#include <algorithm>
#include <cmath>

namespace globalmatch::support::test_plot {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

double horizontal_distance(const Vector3d& a, const Vector3d& b) {
  return (a - b).head<2>().norm();
}

plot_options small_plot() {
  plot_options o;
  o.width = 24;
  o.depth = 20;
  o.margin = 5;
  return o;
}

}  // namespace

TEST_CASE("a plot is the same for one seed and another for the next") {
  plot_options options = small_plot();
  const plot first = grow_plot(options), again = grow_plot(options);
  options.seed = 2;
  const plot other = grow_plot(options);
  REQUIRE(first.stems.size() == again.stems.size());
  for (std::size_t i = 0; i < first.stems.size(); ++i) {
    CHECK(first.stems[i].position == again.stems[i].position);
    CHECK(first.stems[i].dbh == again.stems[i].dbh);
  }
  CHECK(first.stems[0].position != other.stems[0].position);
}

TEST_CASE("stems stand on the ground, as densely as asked for, and know whether they are on the plot") {
  plot_options options = small_plot();
  options.layout.stems_per_hectare = 2000;
  options.ground.slope = 15;
  const plot scene = grow_plot(options);
  CHECK(double(scene.stems.size()) == Approx(0.2 * 34 * 30).epsilon(0.05));
  std::size_t inside = 0;
  for (const stem& s : scene.stems) {
    CHECK(s.position.z() == scene.ground.height(s.position.x(), s.position.y()));
    CHECK(s.inside == (std::abs(s.position.x()) <= 12 && std::abs(s.position.y()) <= 10));
    CHECK(!s.harvested);
    inside += s.inside;
  }
  CHECK(inside > 60);
  CHECK(inside < scene.stems.size());
}

TEST_CASE("pairs stand half a metre apart, and stems of one root closer and leaning away") {
  plot_options options = small_plot();
  options.trees.lean = options.trees.multi_stem = 0;
  options.trees.pairs = 1;
  const auto pairs = grow_plot(options).stems;
  REQUIRE(pairs.size() > 20);
  for (std::size_t i = 0; i + 1 < pairs.size(); i += 2)
    CHECK(horizontal_distance(pairs[i].position, pairs[i + 1].position) == Approx(0.5));
  options.trees.pairs = 0;
  options.trees.multi_stem = 1;
  std::size_t leaning = 0;
  const auto stems = grow_plot(options).stems;
  for (std::size_t i = 0; i + 1 < stems.size(); ++i) {
    if (stems[i + 1].lean.norm() < 0.04) continue;
    ++leaning;
    double nearest = 100;
    for (const stem& other : stems)
      if (&other != &stems[i + 1])
        nearest = std::min(nearest, horizontal_distance(other.position, stems[i + 1].position));
    CHECK(nearest < 0.451);
  }
  CHECK(double(leaning) > 0.4 * double(stems.size()));
}

TEST_CASE("the common lean goes one way") {
  plot_options options = small_plot();
  options.trees.lean = options.trees.pairs = options.trees.multi_stem = 0;
  options.trees.common_lean = 10;
  const auto stems = grow_plot(options).stems;
  REQUIRE(!stems.empty());
  for (const stem& s : stems) {
    CHECK(s.lean == stems[0].lean);
    CHECK(s.lean.norm() == Approx(std::tan(10 * degree)));
  }
}

TEST_CASE("a harvest takes its share of the stems, and changes nothing else in the plot") {
  plot_options options = small_plot();
  options.width = options.depth = 60;
  const plot before = grow_plot(options);
  options.harvest = 0.4;
  const plot after = grow_plot(options);
  REQUIRE(before.stems.size() == after.stems.size());
  const auto felled =
      std::count_if(after.stems.begin(), after.stems.end(), [](const stem& s) { return s.harvested; });
  CHECK(double(felled) / double(after.stems.size()) == Approx(0.4).margin(0.08));
  for (std::size_t i = 0; i < before.stems.size(); ++i) {
    CHECK(before.stems[i].position == after.stems[i].position);
    CHECK(before.stems[i].dbh == after.stems[i].dbh);
    CHECK(before.stems[i].lean == after.stems[i].lean);
  }
  REQUIRE(before.shrubs.size() == after.shrubs.size());
  for (std::size_t i = 0; i < before.shrubs.size(); ++i)
    CHECK(before.shrubs[i].position == after.shrubs[i].position);
}

TEST_CASE("grass, logs, stumps and poles are as many as asked for") {
  plot_options options = bare_options();
  options.width = options.depth = 20;
  const std::size_t nothing = surfaces_of(grow_plot(options)).curves.size();
  CHECK(nothing == 0);
  options.undergrowth.blades_per_square_metre = 12;
  CHECK(surfaces_of(grow_plot(options)).curves.size() == 2 * 12 * 400);
  options.undergrowth.blades_per_square_metre = 0;
  options.undergrowth.logs_per_hectare = 500;
  CHECK(surfaces_of(grow_plot(options)).curves.size() == 2 * 20);
  options.undergrowth.logs_per_hectare = 0;
  options.undergrowth.stumps_per_hectare = options.undergrowth.poles_per_hectare = 5000;
  CHECK(surfaces_of(grow_plot(options)).curves.size() == 2 * 200);
}

TEST_CASE("shrubs, stumps and poles keep away from a clearing, and stay where they are elsewhere") {
  plot_options options = bare_options();
  options.width = options.depth = 20;
  options.undergrowth.shrubs_per_hectare = 500;
  options.undergrowth.stumps_per_hectare = options.undergrowth.poles_per_hectare = 5000;
  const plot scene = grow_plot(options);
  const surfaces all = surfaces_of(scene);
  const auto near = [](const Vector2d& clearing, double distance) {
    return
        [=](const Eigen::Vector4f& p) { return (p.head<2>().cast<double>() - clearing).norm() < distance; };
  };
  const auto count_stumps_and_poles = [&](const surfaces& in, const Vector2d& clearing) {
    return std::count_if(in.curve_points.begin(), in.curve_points.end(), [&](const Eigen::Vector4f& p) {
      const bool is_twig = p.w() < 0.0149f;
      return !is_twig && near(clearing, 0.79)(p);
    });
  };
  const auto count_leaves = [&](const surfaces& in, const Vector2d& clearing) {
    return std::count_if(in.discs.begin(), in.discs.end(), near(clearing, 0.4));
  };
  // In the middle of something, so that there is something to be cleared.
  const Vector2d at_shrub = scene.shrubs[0].position.head<2>();
  const Vector2d at_stump = all.curve_points.back().head<2>().cast<double>();
  CHECK(count_leaves(all, at_shrub) > 0);
  CHECK(count_stumps_and_poles(all, at_stump) > 0);

  const std::vector<Vector2d> clearings = {at_shrub, at_stump};
  const surfaces cleared = surfaces_of(scene, clearings);
  for (const Vector2d& clearing : clearings) {
    CHECK(count_leaves(cleared, clearing) == 0);
    CHECK(count_stumps_and_poles(cleared, clearing) == 0);
  }
  CHECK(double(cleared.discs.size()) > 0.5 * double(all.discs.size()));
  for (const Eigen::Vector4f& p : cleared.curve_points)
    if (std::find(all.curve_points.begin(), all.curve_points.end(), p) == all.curve_points.end())
      FAIL("something stands at " << p.transpose() << " where nothing stood before");
}

TEST_CASE("stations stand above the ground, clear of stems, around the first, each with a yaw of its own") {
  plot_options options = small_plot();
  options.width = options.depth = 50;
  options.layout.stems_per_hectare = 1500;
  options.ground.slope = 15;
  const plot scene = grow_plot(options);
  const std::vector<station> stations = place_stations(scene, {.count = 5});
  REQUIRE(stations.size() == 5);
  CHECK(stations[0].plot_from_scan.translation().head<2>().norm() < 3);
  for (std::uint32_t i = 0; i < 5; ++i) {
    const Eigen::Isometry3d& pose = stations[i].plot_from_scan;
    const Vector3d place = pose.translation();
    CHECK(stations[i].number == i + 1);
    CHECK(place.z() == Approx(scene.ground.height(place.x(), place.y()) + 1.7));
    CHECK(pose.linear().isUnitary(1e-12));
    CHECK((pose.linear() * Vector3d::UnitZ() - Vector3d::UnitZ()).norm() < 1e-12);
    for (const stem& s : scene.stems) CHECK(horizontal_distance(place, s.position) - 0.5 * s.dbh >= 0.7);
    for (std::uint32_t j = 0; j < i; ++j) {
      CHECK(!pose.linear().isApprox(stations[j].plot_from_scan.linear(), 1e-3));
      CHECK(horizontal_distance(place, stations[j].plot_from_scan.translation()) > 8);
    }
  }
}

TEST_CASE("the pose of a tilted scanner is tilted, by the angle asked for, each its own way") {
  const plot scene = grow_plot(bare_options());
  const auto stations = place_stations(scene, {.count = 3, .tilt = 8});
  for (const station& s : stations) CHECK(std::acos(s.plot_from_scan.linear()(2, 2)) / degree == Approx(8));
  CHECK(
      !stations[0].plot_from_scan.linear().col(2).isApprox(stations[1].plot_from_scan.linear().col(2), 1e-3));
}

TEST_CASE("ways go through the plot above the ground, clear of stems, another one for each station") {
  plot_options options = small_plot();
  options.width = options.depth = 50;
  const plot scene = grow_plot(options);
  const auto first = walk_path(scene, {}, 1, 0.1), second = walk_path(scene, {}, 2, 0.1);
  CHECK(first.size() > 400);
  CHECK(first.front() != second.front());
  for (const Vector3d& place : first) {
    CHECK(place.z() == Approx(scene.ground.height(place.x(), place.y()) + 1.7));
    CHECK(place.head<2>().cwiseAbs().maxCoeff() < 30);
    for (const stem& s : scene.stems) REQUIRE(horizontal_distance(place, s.position) - 0.5 * s.dbh >= 0.7);
  }
}

TEST_CASE("grow_plot refuses options that make no sense, by name") {
  const double nan = std::nan("");
  const std::vector<wrong_option<plot_options>> all = {
      {"plot_options.width", [](auto& o) { o.width = 0; }},
      {"plot_options.depth", [nan](auto& o) { o.depth = nan; }},
      {"plot_options.margin", [](auto& o) { o.margin = -1; }},
      {"plot_options.harvest", [](auto& o) { o.harvest = 1.5; }},
      {"ground_options.slope", [](auto& o) { o.ground.slope = 60; }},
      {"layout_options.missing", [](auto& o) { o.layout.missing = -1; }},
      {"tree_options.height", [](auto& o) { o.trees.height = 1; }},
      {"undergrowth_options.shrubs_per_hectare", [nan](auto& o) { o.undergrowth.shrubs_per_hectare = nan; }},
      {"undergrowth_options.shrub_min_height", [](auto& o) { o.undergrowth.shrub_min_height = 0; }},
      {"undergrowth_options.shrub_max_height", [](auto& o) { o.undergrowth.shrub_max_height = 0.1; }},
      {"undergrowth_options.shrub_leaves", [](auto& o) { o.undergrowth.shrub_leaves = 100000; }},
      {"undergrowth_options.shrub_leaf_radius", [](auto& o) { o.undergrowth.shrub_leaf_radius = 0; }},
      {"undergrowth_options.blades_per_square_metre",
       [](auto& o) { o.undergrowth.blades_per_square_metre = -1; }},
      {"undergrowth_options.grass_height", [](auto& o) { o.undergrowth.grass_height = 0; }},
      {"undergrowth_options.logs_per_hectare", [](auto& o) { o.undergrowth.logs_per_hectare = -1; }},
      {"undergrowth_options.stumps_per_hectare", [](auto& o) { o.undergrowth.stumps_per_hectare = -1; }},
      {"undergrowth_options.poles_per_hectare", [](auto& o) { o.undergrowth.poles_per_hectare = -1; }}};
  for (const auto& [field, spoil] : all) {
    plot_options options;
    spoil(options);
    INFO(field);
    CHECK(message_of([&] { grow_plot(options); }).starts_with(field));
  }
}

TEST_CASE("place_stations refuses options that make no sense, by name") {
  plot_options dense = small_plot();
  dense.width = dense.depth = 40;
  dense.layout.stems_per_hectare = 1000;
  const plot scene = grow_plot(dense);
  const std::vector<wrong_option<station_options>> all = {
      {"station_options.count", [](auto& o) { o.count = 0; }},
      {"station_options.distance", [](auto& o) { o.distance = 20; }},
      {"station_options.distance", [](auto& o) { o.distance = 0; }},
      {"station_options.scanner_height", [](auto& o) { o.scanner_height = 0; }},
      {"station_options.clearance", [](auto& o) { o.clearance = -1; }},
      {"station_options.clearance", [](auto& o) { o.clearance = 8; }},
      {"station_options.tilt", [](auto& o) { o.tilt = std::nan(""); }}};
  for (const auto& [field, spoil] : all) {
    station_options options;
    spoil(options);
    INFO(field);
    CHECK(message_of([&] { place_stations(scene, options); }).starts_with(field));
  }
}

}  // namespace globalmatch::support::test_plot
