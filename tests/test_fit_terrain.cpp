#include "globalmatch/detail/mapping/fit_terrain.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "catch.hpp"
#include "forest_scenes.hpp"
#include "globalmatch/detail/core/random.hpp"

namespace globalmatch::test_fit_terrain {

using namespace detail;

namespace {

double slope(double x, double y) {
  return 60 + 0.25 * x - 0.4 * y;
}

/// A raster of lowest points, `columns` x `rows` nodes; `above(x, y)`: how far above the slope, NaN where
/// none.
template <class Above>
lowest_raster raster_of_nodes(int columns, int rows, random_source& random, const Above& above) {
  lowest_raster raster;
  raster.frame.origin = {1000, 2000, 30};
  raster.resolution = 0.25;
  raster.columns = 2 * columns, raster.rows = 2 * rows;
  for (int r = 0; r < raster.rows; ++r)
    for (int c = 0; c < raster.columns; ++c) {
      const double x = (c + random.uniform()) * 0.25, y = (r + random.uniform()) * 0.25, a = above(x, y);
      raster.points.push_back(std::isnan(a) ? no_point : vec3f(vec3{x, y, slope(x, y) + a}));
    }
  return raster;
}

std::vector<float> heights_of_nodes(int columns, int rows, double off) {
  std::vector<float> heights;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) heights.push_back(float(slope((c + 0.5) * 0.5, (r + 0.5) * 0.5) + off));
  return heights;
}

}  // namespace

TEST_CASE("heights along cells are those of the terrain, up to its edges and in rasters of one row") {
  random_source random(1);
  for (const auto& [columns, rows] : {std::pair(7, 5), {1, 4}, {6, 1}, {1, 1}, {2, 2}}) {
    CAPTURE(columns, rows);
    terrain ground;
    ground.resolution = 0.5;
    ground.columns = columns, ground.rows = rows;
    for (int i = 0; i < columns * rows; ++i) ground.heights.push_back(float(5 * random.normal()));
    for (int r = 0; r < 2 * rows; ++r) {
      const heights_along_cells along(ground, r);
      for (int c = 0; c < 2 * columns; ++c) {
        const double x = (c + 0.01 + 0.98 * random.uniform()) * 0.25,
                     y = (r + 0.01 + 0.98 * random.uniform()) * 0.25;
        CHECK(double(along.at(c, float(x), float(y))) ==
              Approx(ground.interpolated_height(x, y)).margin(1e-4));
      }
    }
  }
}

TEST_CASE("nodes have data as far as the hole from ground, by brute force") {
  random_source random(2);
  for (const int hole : {0, 1, 3}) {
    terrain ground;
    ground.columns = 19, ground.rows = 12;
    std::vector<std::uint8_t> of_node;
    for (int i = 0; i < 19 * 12; ++i) of_node.push_back(random.below(25) == 0 ? 2 : 0);
    mark_data(of_node, hole, ground, {});
    REQUIRE(ground.has_data.size() == of_node.size());
    for (int r = 0; r < 12; ++r)
      for (int c = 0; c < 19; ++c) {
        bool expected = false;
        for (int gr = 0; gr < 12; ++gr)
          for (int gc = 0; gc < 19; ++gc)
            expected = expected || (of_node[std::size_t(19 * gr + gc)] > 0 &&
                                    std::hypot(gr - r, gc - c) <= double(hole) + 1e-9);
        CHECK((ground.has_data[ground.node(c, r)] == 1) == expected);
      }
  }
}

TEST_CASE("ground points are handed over node by node, and none are where nothing is marked") {
  random_source random(3);
  const lowest_raster lowest = raster_of_nodes(5, 4, random, [](double, double) { return 0; });
  ground_marks marks{std::vector<std::uint8_t>(lowest.points.size()), std::vector<std::uint8_t>(20)};
  terrain nothing;
  nothing.columns = 5, nothing.rows = 4;
  CHECK_FALSE(collect_ground(lowest, marks, nothing, {}));
  std::vector<std::vector<vec3f>> expected(20);
  for (int r = 0; r < 8; ++r)
    for (int c = 0; c < 10; ++c)
      if ((marks.is_ground[lowest.cell(c, r)] = random.below(3) == 0)) {
        ++marks.of_node[std::size_t(5 * (r / 2) + c / 2)];
        expected[std::size_t(5 * (r / 2) + c / 2)].push_back(lowest.points[lowest.cell(c, r)]);
      }
  terrain ground;
  ground.columns = 5, ground.rows = 4;
  REQUIRE(collect_ground(lowest, marks, ground, {}));
  REQUIRE(ground.first_ground.size() == 21);
  for (std::size_t n = 0; n < 20; ++n)
    CHECK(std::vector<vec3f>(ground.ground.begin() + ground.first_ground[n],
                             ground.ground.begin() + ground.first_ground[n + 1]) == expected[n]);
}

TEST_CASE(
    "the terrain goes through the lowest points, from a surface that is off, between what is above and far "
    "below it") {
  random_source random(4);
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const lowest_raster lowest = raster_of_nodes(44, 30, random, [&](double x, double y) {
    if (std::hypot(x - 16, y - 9) < 2.6) return nan;            // a hole
    if (random.below(40) == 0) return -0.9 - random.uniform();  // multipath, below the band
    return random.below(4) == 0 ? 0.3 + 2 * random.uniform() : 0.01 * random.normal();
  });
  const ground_options options{.resolution = 0.5, .hole_radius = 1.5};
  for (const double off : {-0.2, 0.15}) {
    const terrain ground = fit_terrain(lowest, heights_of_nodes(44, 30, off), 44, 30, options);
    REQUIRE_FALSE(ground.empty());
    CHECK(ground.frame.origin == lowest.frame.origin);
    CHECK(ground.resolution == 0.5);
    REQUIRE(ground.heights.size() == 44 * 30);
    for (int r = 0; r < 30; ++r)
      for (int c = 0; c < 44; ++c) {
        const double x = (c + 0.5) * 0.5, y = (r + 0.5) * 0.5, from_hole = std::hypot(x - 16, y - 9);
        CAPTURE(x, y);
        CHECK(ground.heights[ground.node(c, r)] == Approx(slope(x, y)).margin(from_hole < 3.5 ? 0.15 : 0.04));
        if (from_hole < 0.4) CHECK(ground.has_data[ground.node(c, r)] == 0);
        if (from_hole > 2.9) CHECK(ground.has_data[ground.node(c, r)] == 1);
      }
    for (const vec3f& p : ground.ground) CHECK(std::abs(p.z - slope(p.x, p.y)) < 0.13);
    CHECK(double(ground.ground.size()) > 0.6 * 88 * 60);
    CHECK(ground.first_ground.back() == ground.ground.size());
  }
}

TEST_CASE("the terrain of no lowest points, or of none near the surface, is empty") {
  random_source random(5);
  const lowest_raster none =
      raster_of_nodes(6, 5, random, [](double, double) { return std::numeric_limits<double>::quiet_NaN(); });
  CHECK(fit_terrain(none, heights_of_nodes(6, 5, 0), 6, 5, {}).empty());
  const lowest_raster above = raster_of_nodes(6, 5, random, [](double, double) { return 3; });
  CHECK(fit_terrain(above, heights_of_nodes(6, 5, 0), 6, 5, {}).empty());
}

}  // namespace globalmatch::test_fit_terrain
