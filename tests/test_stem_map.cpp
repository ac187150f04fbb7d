#include "globalmatch/stem_map.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string_view>
#include <utility>

#include "catch.hpp"
#include "forest_scenes.hpp"

namespace globalmatch::test_stem_map {

using namespace detail;

namespace {

/// 8 x 6 nodes, half a metre apart, on a plane.
terrain plane_terrain() {
  terrain ground;
  ground.resolution = 0.5;
  ground.columns = 8;
  ground.rows = 6;
  for (int r = 0; r < ground.rows; ++r)
    for (int c = 0; c < ground.columns; ++c) {
      const double x = (c + 0.5) * ground.resolution, y = (r + 0.5) * ground.resolution;
      ground.heights.push_back(static_cast<float>(1 + 0.25 * x - 0.5 * y));
    }
  ground.has_data.assign(ground.heights.size(), 1);
  return ground;
}

}  // namespace

TEST_CASE("heights between nodes are bilinear, and exact on a plane up to the raster's edge") {
  const terrain ground = plane_terrain();
  random_source random(1);
  for (int i = 0; i < 200; ++i) {
    const double x = scenes::in_range(random, 0, 4), y = scenes::in_range(random, 0, 3);
    CHECK(ground.interpolated_height(x, y) == Approx(1 + 0.25 * x - 0.5 * y).margin(1e-6));
  }
  for (const double x : {0.0, 4.0})
    for (const double y : {0.0, 3.0})
      CHECK(ground.interpolated_height(x, y) == Approx(1 + 0.25 * x - 0.5 * y).margin(1e-6));
}

TEST_CASE("the height at a node is that of the node, and in the middle of four their mean") {
  terrain ground = plane_terrain();
  ground.heights[ground.node(3, 2)] = 10;
  CHECK(ground.interpolated_height(1.75, 1.25) == Approx(10));
  const double mean = (10.0 + ground.heights[ground.node(4, 2)] + ground.heights[ground.node(3, 3)] +
                       ground.heights[ground.node(4, 3)]) /
                      4;
  CHECK(ground.interpolated_height(2, 1.5) == Approx(mean));
}

TEST_CASE("a terrain covers its raster with its edge and nothing else") {
  const terrain ground = plane_terrain();
  CHECK(ground.covers(0, 0));
  CHECK(ground.covers(4, 3));
  CHECK_FALSE(ground.covers(-1e-9, 1));
  CHECK_FALSE(ground.covers(1, -1e-9));
  CHECK_FALSE(ground.covers(4.0000001, 1));
  CHECK_FALSE(ground.covers(1, 3.0000001));
  CHECK_FALSE(ground.covers(std::numeric_limits<double>::quiet_NaN(), 1));
  CHECK_FALSE(ground.covers(1, std::numeric_limits<double>::infinity()));
}

TEST_CASE("there is no height where no ground was seen, but an interpolated one") {
  terrain ground = plane_terrain();
  ground.has_data[ground.node(3, 2)] = 0;
  CHECK_FALSE(ground.is_known(1.75, 1.25));
  CHECK(ground.height_at(1.75, 1.25) == std::nullopt);
  CHECK(ground.interpolated_height(1.75, 1.25) == Approx(1 + 0.25 * 1.75 - 0.5 * 1.25));
  CHECK(ground.is_known(2.01, 1.25));
  REQUIRE(ground.height_at(2.25, 1.25));
  CHECK(*ground.height_at(2.25, 1.25) == Approx(1 + 0.25 * 2.25 - 0.5 * 1.25));
}

TEST_CASE("there is no height beyond the raster") {
  const terrain ground = plane_terrain();
  CHECK(ground.is_known(4, 3));
  CHECK_FALSE(ground.is_known(4.1, 1));
  CHECK(ground.height_at(-0.1, 1) == std::nullopt);
  CHECK(ground.height_at(1, 1e9) == std::nullopt);
}

TEST_CASE("an empty terrain covers and knows nothing") {
  const terrain ground;
  CHECK(ground.empty());
  CHECK_FALSE(ground.covers(0, 0));
  CHECK(ground.height_at(0, 0) == std::nullopt);
}

TEST_CASE("the terrain is bilinear between nodes, and goes on beyond the last ones") {
  terrain ground;
  ground.resolution = 0.5;
  ground.columns = 6, ground.rows = 4;
  const auto height = [](double x, double y) { return 20 + 3 * x - 2 * y + 0.7 * x * y; };
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 6; ++c) {
      ground.heights.push_back(float(height((c + 0.5) * 0.5, (r + 0.5) * 0.5)));
      ground.has_data.push_back(c == 4 && r == 1 ? 0 : 1);
    }
  for (const auto& [x, y] : {std::pair(0.3, 0.9), {1.1, 0.6}, {2.2, 1.6}, {0.05, 0.1}, {2.95, 1.9}})
    CHECK(ground.interpolated_height(x, y) == Approx(height(x, y)).epsilon(1e-5));
  CHECK_FALSE(ground.height_at(2.25, 0.75));
  CHECK(ground.height_at(0.75, 1.75).has_value());
  CHECK_FALSE(ground.height_at(1, 2.1));
}

TEST_CASE("ground points of the nodes around a place are visited, each once") {
  random_source random(205);
  terrain ground;
  ground.resolution = 0.5;
  ground.columns = 12, ground.rows = 8;
  ground.first_ground.push_back(0);
  for (int r = 0; r < 8; ++r)
    for (int c = 0; c < 12; ++c) {
      ground.heights.push_back(0);
      for (std::uint32_t k = random.below(3); k > 0; --k)
        ground.ground.push_back(vec3f(vec3{(c + random.uniform()) * 0.5, (r + random.uniform()) * 0.5, 1}));
      ground.first_ground.push_back(std::uint32_t(ground.ground.size()));
    }
  for (const auto& [x, y] : {std::pair(4.4, 1.3), {0.2, 3.8}, {5.9, 0.1}}) {
    std::size_t visited = 0, expected = 0;
    ground.for_each_ground_near(x, y, 0.8, [&, x = x, y = y](const vec3f& p) {
      ++visited;
      CHECK(std::abs(p.x - x) < 0.8 + 0.5);
      CHECK(std::abs(p.y - y) < 0.8 + 0.5);
    });
    const auto node = [](double v) { return std::floor(v / 0.5); };
    for (const vec3f& p : ground.ground)
      expected += node(p.x) >= node(x - 0.8) && node(p.x) <= node(x + 0.8) && node(p.y) >= node(y - 0.8) &&
                  node(p.y) <= node(y + 0.8);
    CHECK(visited == expected);
  }
}

TEST_CASE("the step that lost the stems is the first that leaves nothing, or else too little") {
  const auto step = [](std::string_view name, std::size_t in, std::size_t out) {
    return funnel_step{name, "clusters", in, "cylinders", out, "not like a stem", "scan nearer"};
  };
  CHECK(where_lost({step("a", 100, 50), step("b", 50, 3), step("c", 3, 0)}, 4) ==
        "c: 0 cylinders of 3 clusters; scan nearer");
  CHECK(where_lost({step("a", 100, 50), step("b", 50, 3), step("c", 3, 2)}, 4) ==
        "b: 3 cylinders of 50 clusters; scan nearer");
  CHECK(where_lost({step("a", 100, 50)}, 4).empty());
  CHECK(where_lost({}, 4).empty());
}

TEST_CASE("the funnel of mapping hangs together: what a step is given is what an earlier one left") {
  mapping_funnel f;
  f.ground.points = 1000;
  f.ground.not_finite = 10;
  f.understory = 300;
  f.thinned = 200;
  f.stem_points = 50;
  f.clusters = 9;
  f.cylinders = 8;
  f.likely = 7;
  f.stems = 6;
  const auto steps = explain(f);
  REQUIRE(steps.size() == 9);
  CHECK(steps.front().in == 1000);
  CHECK(steps.back().out == 6);
  for (std::size_t i = 3; i < steps.size(); ++i) CHECK(steps[i].in == steps[i - 1].out);
  for (const funnel_step& s : steps) {
    CHECK(!s.rest.empty());
    CHECK(!s.remedy.empty());
  }

  CHECK(steps[3].what == "cells");
  f.by_cells = false;
  CHECK(explain(f)[3].what == "thinned points");
}

TEST_CASE("a tilt is described in tenths of a degree, with what to do about it") {
  stem_map map;
  CHECK_FALSE(is_tilted(map));  // nothing is known of it
  const double angle = 8.14 * std::numbers::pi / 180;
  map.given_up = Eigen::Vector3d::UnitY();
  map.upright = upright_direction{{std::sin(angle), std::cos(angle), 0}, 0.001};
  CHECK(is_tilted(map));
  CHECK(describe_tilt(map) ==
        "stand 8.1 degrees off the vertical; a scan that was not level should turn freely (dof 6)");
  map.up_by_stems = true;
  CHECK(describe_tilt(map) ==
        "stand 8.1 degrees off the vertical, which is taken from them instead; a scan "
        "that was not level should turn freely (dof 6)");
  map.upright->sigma = 0.05;  // four of these are more
  CHECK_FALSE(is_tilted(map));
}

TEST_CASE("a stem is a point with its radius and the sigma of its position") {
  stem s;
  s.position = {1, -2, 3};
  s.radius = 0.2;
  s.radius_sigma = 0.01;
  s.position_sigma = 0.03;
  s.height_sigma = 0.04;
  CHECK(point_traits<stem>::xyz(s) == Eigen::Vector3d(1, -2, 3));
  CHECK(point_traits<stem>::radius(s) == 0.2);
  CHECK(point_traits<stem>::position_sigma(s) == 0.03);
}

}  // namespace globalmatch::test_stem_map
