#include "globalmatch/stem_map.hpp"

#include "catch.hpp"
#include "forest_scenes.hpp"

namespace globalmatch {

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

}  // namespace globalmatch
