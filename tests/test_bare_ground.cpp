#include "globalmatch/detail/mapping/bare_ground.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"

namespace globalmatch::test_bare_ground {

using namespace detail;

namespace {

/// Neither level nor at zero, steeper along one axis.
double slope(double x, double y) {
  return 120 + 0.35 * x - 0.15 * y;
}

/// A raster of lowest points on the slope; `vegetation(x, y)` is how far above it they lie, NaN where none
/// is.
template <class Vegetation>
lowest_raster raster_on_slope(int columns, int rows, random_source& random, const Vegetation& vegetation) {
  lowest_raster raster;
  raster.resolution = 0.25;
  raster.columns = columns, raster.rows = rows;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      const double x = (c + random.uniform()) * 0.25, y = (r + random.uniform()) * 0.25;
      const double above = vegetation(x, y);
      raster.points.push_back(std::isnan(above) ? no_point : vec3f(vec3{x, y, slope(x, y) + above}));
    }
  return raster;
}

}  // namespace

TEST_CASE("a plane under points is that of the lower ones, where a third stand out upwards") {
  random_source random(1);
  double lifted = 0;  // without leaving any out
  for (int trial = 0; trial < 20; ++trial) {
    std::vector<vec3f> points;
    plane_moments all;
    for (int i = 0; i < 60; ++i) {
      const double x = 5 + 5 * random.uniform(), y = 8 + 5 * random.uniform();
      const double above = i % 3 == 0 ? 0.3 + 2 * random.uniform() : 0.005 * random.normal();
      points.push_back(vec3f(vec3{x, y, slope(x, y) + above}));
      all.add(points.back());
    }
    const local_plane plane = plane_under(points, 6, 12);
    CHECK(plane.height == Approx(slope(6, 12)).margin(0.02));
    CHECK(plane.at(1, 0) - plane.height == Approx(0.35).margin(0.02));
    CHECK(plane.at(0, 1) - plane.height == Approx(-0.15).margin(0.02));
    lifted += (all.fit(6, 12, 3).height - slope(6, 12)) / 20;
    CHECK(points.size() <= 42);
    CHECK(points.size() >= 30);
  }
  CHECK(lifted > 0.2);
}

TEST_CASE("what lies below the ground is kept, and fewer than three points have no plane") {
  std::vector<vec3f> pit;
  for (int i = 0; i < 25; ++i) pit.push_back({float(i % 5), float(i / 5), i == 12 ? 9.0f : 10.0f});
  plane_under(pit, 2, 2);
  CHECK(pit.size() == 25);
  std::vector<vec3f> none, two = {{0, 0, 1}, {1, 0, 2}}, three = {{0, 0, 1}, {4, 0, 3}, {0, 4, 0}};
  CHECK_FALSE(plane_under(none, 0, 0).known());
  CHECK_FALSE(plane_under(two, 0, 0).known());
  CHECK(plane_under(three, 0, 0).at(4, 4) == Approx(2).margin(0.01));
}

TEST_CASE("the lowest point of each block of four by four cells is kept, of part blocks too") {
  random_source random(2);
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const lowest_raster raster = raster_on_slope(23, 14, random, [&](double x, double) {
    return x < 1 || random.below(3) == 0 ? nan : random.normal();
  });
  const lowest_of_blocks blocks(raster, {});
  CHECK(blocks.width == 1);
  REQUIRE(blocks.columns == 6);
  REQUIRE(blocks.rows == 4);
  for (int br = 0; br < 4; ++br)
    for (int bc = 0; bc < 6; ++bc) {
      const vec3f* expected = nullptr;
      for (int r = 4 * br; r < std::min(4 * br + 4, 14); ++r)
        for (int c = 4 * bc; c < std::min(4 * bc + 4, 23); ++c)
          if (const vec3f& p = raster.points[raster.cell(c, r)];
              !std::isnan(p.z) && (!expected || p.z < expected->z))
            expected = &p;
      const vec3f& kept = blocks.points[blocks.block(bc, br)];
      REQUIRE(std::isnan(kept.z) == (expected == nullptr));
      if (expected) CHECK(kept == *expected);
    }
}

TEST_CASE("heights under vegetation are those of the ground, next to points and far from them") {
  random_source random(3);
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const lowest_raster raster = raster_on_slope(90, 70, random, [&](double x, double y) {
    if (x > 14 && y > 9) return nan;  // a corner without points
    return random.below(4) == 0 ? 0.2 + 3 * random.uniform() : 0.004 * random.normal();
  });
  const auto heights = planes_under_vegetation(raster, 45, 35, {});
  REQUIRE(heights.size() == 45 * 35);
  for (int r = 0; r < 35; ++r)
    for (int c = 0; c < 45; ++c) {
      const double x = (c + 0.5) * 0.5, y = (r + 0.5) * 0.5;
      const bool far = x > 14 && y > 9;
      CAPTURE(x, y);
      CHECK(heights[std::size_t(45 * r + c)] == Approx(slope(x, y)).margin(far ? 0.5 : 0.06));
    }
}

TEST_CASE("without points nothing is known, and heights are the same for any number of threads") {
  random_source random(4);
  const lowest_raster none =
      raster_on_slope(9, 5, random, [](double, double) { return std::numeric_limits<double>::quiet_NaN(); });
  for (const float h : planes_under_vegetation(none, 5, 3, {})) CHECK(std::isnan(h));
  const lowest_raster raster =
      raster_on_slope(200, 160, random, [&](double, double) { return std::abs(random.normal()); });
  const auto alone = planes_under_vegetation(raster, 100, 80, {}, {.threads = 1});
  CHECK(planes_under_vegetation(raster, 100, 80, {}, {.threads = 3}) == alone);
}

}  // namespace globalmatch::test_bare_ground
