#include "support/simulator/layout.hpp"

#include "bare_plot.hpp"
#include "catch.hpp"
#include "support/message_of.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace globalmatch::support::test_layout {
namespace {

using Eigen::Vector2d;

/// Of each place to its nearest neighbour, sorted.
std::vector<double> nearest_distances(const std::vector<Vector2d>& places) {
  std::vector<double> distances;
  for (const Vector2d& place : places) {
    double nearest = 1e9;
    for (const Vector2d& other : places)
      if (&other != &place) nearest = std::min(nearest, (place - other).norm());
    distances.push_back(nearest);
  }
  std::sort(distances.begin(), distances.end());
  return distances;
}

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / double(values.size());
}

layout_options exact_rows() {
  layout_options o;
  o.arrangement = arrangement::rows;
  o.row_spacing = 5;
  o.tree_spacing = 3;
  o.row_jitter = o.missing = 0;
  return o;
}

}  // namespace

TEST_CASE("random and clumped places are as many as asked for, in the rectangle, and keep their distance") {
  for (const arrangement a : {arrangement::random, arrangement::clumped}) {
    layout_options options;
    options.arrangement = a;
    options.stems_per_hectare = 1000;
    const auto places = tree_places(options, {25, 20}, 1, 1);
    CHECK(places.size() == 200);
    CHECK(nearest_distances(places).front() >= options.min_spacing);
    for (const Vector2d& place : places) CHECK((std::abs(place.x()) <= 25 && std::abs(place.y()) <= 20));
    CHECK(tree_places(options, {25, 20}, 0.5, 1).size() == 100);
    CHECK(tree_places(options, {25, 20}, 1, 1) == places);
    CHECK(tree_places(options, {25, 20}, 1, 2) != places);
  }
}

TEST_CASE("clumped places are nearer to one another than random ones") {
  layout_options options;
  options.stems_per_hectare = 250;
  const double random = mean(nearest_distances(tree_places(options, {40, 40}, 1, 3)));
  options.arrangement = arrangement::clumped;
  const double clumped = mean(nearest_distances(tree_places(options, {40, 40}, 1, 3)));
  CHECK(random > 2.8);  // 3.2 m for a Poisson process
  CHECK(clumped < 0.7 * random);
}

TEST_CASE("rows have the spacing asked for, between them and along them") {
  const auto places = tree_places(exact_rows(), {30, 25}, 1, 1);
  CHECK(places.size() == 20 * 10);
  for (const Vector2d& place : places) {
    CHECK(std::remainder(place.x() - places[0].x(), 3) == Approx(0).margin(1e-9));
    CHECK(std::remainder(place.y() - places[0].y(), 5) == Approx(0).margin(1e-9));
  }
  const auto distances = nearest_distances(places);
  CHECK(distances.front() == Approx(3));
  CHECK(distances.back() == Approx(3));
}

TEST_CASE("rows lose the share of trees that is missing, and jitter about their places") {
  layout_options options = exact_rows();
  options.missing = 0.2;
  options.row_jitter = 0.1;
  const auto places = tree_places(options, {90, 75}, 1, 4);
  CHECK(double(places.size()) == Approx(0.8 * 60 * 30).epsilon(0.05));
  double square_sum = 0;
  for (const Vector2d& place : places) square_sum += std::pow(std::remainder(place.y() - 2.5, 5), 2);
  CHECK(std::sqrt(square_sum / double(places.size())) == Approx(0.1).epsilon(0.05));
}

TEST_CASE("tree_places refuses options that make no sense, by name") {
  const std::vector<wrong_option<layout_options>> all = {
      {"layout_options.stems_per_hectare", [](auto& o) { o.stems_per_hectare = -1; }},
      {"layout_options.stems_per_hectare", [](auto& o) { o.min_spacing = 10; }},
      {"layout_options.min_spacing", [](auto& o) { o.min_spacing = std::nan(""); }},
      {"layout_options.clump_size", [](auto& o) { o.clump_size = 0; }},
      {"layout_options.clump_radius", [](auto& o) { o.clump_radius = 0; }},
      {"layout_options.row_spacing", [](auto& o) { o.row_spacing = 0; }},
      {"layout_options.tree_spacing", [](auto& o) { o.tree_spacing = 0.1; }},
      {"layout_options.row_jitter", [](auto& o) { o.row_jitter = -1; }},
      {"layout_options.missing", [](auto& o) { o.missing = 2; }},
      {"layout_options.arrangement", [](auto& o) { o.arrangement = static_cast<arrangement>(7); }}};
  for (const auto& [field, spoil] : all) {
    layout_options options;
    spoil(options);
    INFO(field);
    CHECK(message_of([&] { tree_places(options, {20, 20}, 1, 1); }).starts_with(field));
  }
}

}  // namespace globalmatch::support::test_layout
