#include "globalmatch/detail/core/visible_ranges.hpp"

#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <set>
#include <vector>

#include "catch.hpp"
#include "seen_forest.hpp"

namespace globalmatch::test_visible_ranges {

using namespace detail;

namespace {

vec3f direction(double azimuth, double range, double slope = 0) {
  return {float(range * std::cos(azimuth)), float(range * std::sin(azimuth)), float(range * slope)};
}

constexpr vec3 upright = {0, 0, 1};

/// Base of a stem on the ground, 1.5 m below the scanner at the origin of `seen_from`.
vec3 base_at(double azimuth, double distance) {
  return {distance * std::cos(azimuth), distance * std::sin(azimuth), 0};
}

}  // namespace

TEST_CASE("columns go round once, counter-clockwise, a quarter of a degree wide at most") {
  constexpr int directions = 14400;
  int changes = 0, last = visible_ranges::return_at(direction(1e-6, 10))->cell;
  const int first = last;
  std::set<int> cells = {first};
  for (int k = 1; k <= directions; ++k) {
    const int cell =
        visible_ranges::return_at(direction(1e-6 + 2 * std::numbers::pi * k / directions, 10))->cell;
    if (cell == last) continue;
    ++changes;
    const bool is_next = cell == last + 1 || (cell == first && last == first + visible_ranges::columns - 1);
    CHECK(is_next);
    last = cell;
    cells.insert(cell);
  }
  CHECK(changes == visible_ranges::columns);
  CHECK(cells.size() == visible_ranges::columns);
}

TEST_CASE("a point that is too near, too far, too steep or not a number tells nothing") {
  const float nan = std::numeric_limits<float>::quiet_NaN(),
              infinity = std::numeric_limits<float>::infinity();
  for (const vec3f& p : {direction(1, 0.5), direction(1, 700), direction(1, 10, 1.1), direction(1, 10, -1.1),
                         vec3f{0, 0, 0}, vec3f{nan, 1, 1}, vec3f{5, 5, nan}, vec3f{infinity, 1, 1}})
    CHECK_FALSE(visible_ranges::return_at(p));
  const auto seen = visible_ranges::return_at(direction(2, 12.345, -0.99));
  REQUIRE(seen);
  CHECK(std::abs(seen->range - 1234) <= 1);
  CHECK(seen->cell < visible_ranges::columns);  // of the lowest row
}

TEST_CASE("the furthest return of a direction counts") {
  visible_ranges visible;
  CHECK(visible.empty());
  for (const double range : {10.0, 30.0, 20.0}) visible.add(*visible_ranges::return_at(direction(1, range)));
  CHECK(std::abs(visible.ranges[visible_ranges::return_at(direction(1, 5))->cell] - 3000) <= 1);
}

TEST_CASE("a scanner sees past any place but those where a stem hides what is behind it") {
  for (int k = 0; k < 36; ++k) {
    const double azimuth = 2 * std::numbers::pi * k / 36 + 0.01;
    const visible_ranges visible =
        scenes::seen_from({{{10 * std::cos(azimuth), 10 * std::sin(azimuth)}, 0.15}}, {0, 0});
    CHECK_FALSE(visible.sees_past(base_at(azimuth, 10), upright, 0.15, 0.02));
    CHECK_FALSE(visible.sees_past(base_at(azimuth, 15), upright, 0.15, 0.02));  // hidden
    CHECK(visible.sees_past(base_at(azimuth, 8), upright, 0.15, 0.02));         // in front of it
    CHECK(visible.sees_past(base_at(azimuth + 0.1, 10), upright, 0.15, 0.02));  // beside it
    CHECK_FALSE(
        visible.sees_past(base_at(azimuth + 1, 39.8), upright, 0.15, 0.02));  // nothing is seen beyond
  }
}

TEST_CASE("a stem may stand within the error to either side of its place") {
  const visible_ranges visible = scenes::seen_from({{{10, 0}, 0.15}}, {0, 0});
  for (const double side : {-0.4, 0.4}) {
    CHECK(visible.sees_past({10, side, 0}, upright, 0.15, 0.05));
    CHECK_FALSE(visible.sees_past({10, side, 0}, upright, 0.15, 0.5));
  }
}

TEST_CASE("a stem that may stand anywhere is not seen past, nor one that is too far for any return") {
  const visible_ranges visible = scenes::seen_from({}, {0, 0});
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double error : {20.0, 1e10, 1e40, 1e300, infinity, std::nan("")})
    CHECK_FALSE(visible.sees_past({5, 3, 0}, upright, 0.1, error));
  for (const double far : {1e3, 1e20, 1e40, 1e300, infinity, std::nan("")})
    CHECK_FALSE(visible.sees_past({far, 3, 0}, upright, 0.1, 0.1));
  CHECK(visible.sees_past({5, 3, 0}, upright, 0.1, 0.1));
}

TEST_CASE("a stem that leans is looked for along its axis") {
  visible_ranges visible = scenes::seen_from({}, {0, 0});
  const vec3 base = {10, 0, 0}, axis = {0, 0.4, 1};
  for (int row = 0; row < visible_ranges::rows; ++row)  // hide what is behind it, row by row
    for (double across = -0.3; across <= 1.4; across += 0.01) {
      const double slope = visible_ranges::max_slope * (2 * (row + 0.5) / visible_ranges::rows - 1);
      const double height = 10 * slope + 1.5;
      if (std::abs(across - 0.4 * height) > 0.3) continue;
      visible.ranges[visible_ranges::return_at({10, float(across), float(10 * slope)})->cell] = 985;
    }
  CHECK_FALSE(visible.sees_past(base, axis, 0.15, 0.02));
  CHECK(visible.sees_past(base, upright, 0.15, 0.02));
}

TEST_CASE("only a stem that is wide enough for its distance covers a direction") {
  CHECK(visible_ranges::is_covered(20, 0.15));
  CHECK_FALSE(visible_ranges::is_covered(60, 0.15));
  CHECK_FALSE(visible_ranges::is_covered(1, 0.15));
  CHECK_FALSE(visible_ranges::is_covered(20, 0));
}

}  // namespace globalmatch::test_visible_ranges
