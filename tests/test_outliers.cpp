#include "globalmatch/detail/mapping/outliers.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "catch.hpp"
#include "forest_scenes.hpp"

namespace globalmatch::test_outliers {

using namespace detail;

using scenes::nan;

namespace {

constexpr double resolution = 0.25;  // [m]

std::size_t occupied(const lowest_raster& raster) {
  std::size_t count = 0;
  for (int r = 0; r < raster.rows; ++r)
    for (int c = 0; c < raster.columns; ++c) count += raster.holds(c, r) ? 1 : 0;
  return count;
}

/// A raster of the given heights, row by row.
lowest_raster raster_of(int columns, int rows, const std::vector<float>& heights) {
  lowest_raster raster;
  raster.resolution = resolution;
  raster.columns = columns;
  raster.rows = rows;
  for (const float z : heights) raster.points.push_back({0, 0, z});
  return raster;
}

}  // namespace

TEST_CASE("low outliers that come singly or in twos are removed") {
  std::vector<float> heights(100, 0.0f);
  heights[33] = -0.5f;
  heights[66] = heights[77] = -2;
  lowest_raster raster = raster_of(10, 10, heights);
  CHECK(remove_low_outliers(raster, 0.3) == 3);
  CHECK_FALSE(raster.holds(3, 3));
  CHECK_FALSE(raster.holds(6, 6));
  CHECK_FALSE(raster.holds(7, 7));
  CHECK(occupied(raster) == 97);
  CHECK(remove_low_outliers(raster, 0.3) == 0);
}

TEST_CASE("a low outlier in a corner of the scan is removed") {
  std::vector<float> heights(100, 0.0f);
  heights[0] = -1e9f;
  lowest_raster raster = raster_of(10, 10, heights);
  CHECK(remove_low_outliers(raster, 0.3) == 1);
  CHECK_FALSE(raster.holds(0, 0));
}

TEST_CASE("a hollow of three cells, one less deep, and steep slopes stay") {
  std::vector<float> hollow(100, 0.0f), shallow(100, 0.0f), steep(100);
  hollow[44] = hollow[45] = hollow[54] = -1;
  shallow[44] = -0.29f;
  for (std::size_t i = 0; i < 100; ++i) steep[i] = float(i % 10) * float(resolution) * 1.7f;  // 60 degrees
  for (const auto& heights : {hollow, shallow, steep}) {
    lowest_raster raster = raster_of(10, 10, heights);
    CHECK(remove_low_outliers(raster, 0.3) == 0);
    CHECK(occupied(raster) == 100);
  }
}

TEST_CASE("cells with hardly a neighbour are left as they are") {
  constexpr float n = std::numeric_limits<float>::quiet_NaN();
  lowest_raster raster = raster_of(5, 1, {0, n, -5, 0, 0});
  CHECK(remove_low_outliers(raster, 0.3) == 0);
}

TEST_CASE(
    "unreachable points are those above what the slope reaches from any that has neighbours, by brute "
    "force") {
  constexpr double slope = 1, step = 0.5;
  constexpr int columns = 17, rows = 11;
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    random_source random(seed);
    std::vector<float> heights;
    for (int i = 0; i < columns * rows; ++i)
      heights.push_back(random.uniform() < 0.6 ? float(nan) : float(3 * random.uniform()));
    lowest_raster raster = raster_of(columns, rows, heights);
    const auto has_company = [&](int j) {
      int others = 0;
      for (int k = 0; k < columns * rows; ++k)
        others += k != j && !std::isnan(heights[std::size_t(k)]) &&
                  std::abs(k % columns - j % columns) <= 2 && std::abs(k / columns - j / columns) <= 2;
      return others >= 4;
    };
    std::vector<bool> expected;
    for (int i = 0; i < columns * rows; ++i) {
      bool unreachable = false;
      for (int j = 0; j < columns * rows; ++j) {
        // in steps along rows, columns and diagonals
        const int dc = std::abs(i % columns - j % columns), dr = std::abs(i / columns - j / columns);
        const double way = resolution * (std::max(dc, dr) + (std::sqrt(2) - 1) * std::min(dc, dr));
        const auto at = [&](int k) { return double(heights[std::size_t(k)]); };
        unreachable = unreachable || (has_company(j) && at(i) > at(j) + slope * way + step + 1e-5);
      }
      expected.push_back(unreachable);
    }
    const std::size_t removed = remove_unreachable(raster, slope, step);
    CHECK(removed > 0);
    CHECK(removed == std::size_t(std::count(expected.begin(), expected.end(), true)));
    for (std::size_t i = 0; i < heights.size(); ++i)
      CHECK(std::isnan(raster.points[i].z) == (expected[i] || std::isnan(heights[i])));
  }
}

TEST_CASE("a slope of 40 degrees and a step of 0.4 m are reachable ground, a stem behind a shrub is not") {
  constexpr int columns = 40, rows = 8;
  std::vector<float> heights;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c)
      heights.push_back(float(std::tan(0.7) * resolution * c + (c > 20 ? 0.4 : 0)));
  lowest_raster raster = raster_of(columns, rows, heights);
  CHECK(remove_unreachable(raster, 1, 0.5) == 0);
  raster.points[raster.cell(30, 4)].z += 1.5f;
  CHECK(remove_unreachable(raster, 1, 0.5) == 1);
  CHECK_FALSE(raster.holds(30, 4));
}

TEST_CASE("a lone point far below the edge of a scan takes no ground with it") {
  constexpr int columns = 30, rows = 12;
  std::vector<float> heights(columns * rows, 0.0f);
  for (int r = 0; r < rows; ++r)
    for (int c = 20; c < columns; ++c) heights[std::size_t(r * columns + c)] = float(nan);
  heights[5 * columns + 21] = -8;  // multipath, with three points of ground within two cells
  heights[5 * columns + 28] = -8;  // and with none
  for (const int row : {3, 7}) heights[std::size_t(row * columns + 19)] = float(nan);
  lowest_raster raster = raster_of(columns, rows, heights);
  CHECK(remove_low_outliers(raster, 0.3) == 0);
  CHECK(remove_unreachable(raster, 1, 0.5) == 0);
}

TEST_CASE("points around a cell are those within two cells, itself left out, by brute force") {
  random_source random(41);
  std::vector<float> heights;
  for (int i = 0; i < 9 * 6; ++i)
    heights.push_back(random.below(3) == 0 ? std::numeric_limits<float>::quiet_NaN()
                                           : float(random.normal()));
  const lowest_raster raster = raster_of(9, 6, heights);
  for (int row = 0; row < 6; ++row)
    for (int column = 0; column < 9; ++column) {
      int count = 0;
      for (int r = 0; r < 6; ++r)
        for (int c = 0; c < 9; ++c)
          count += std::abs(r - row) <= 2 && std::abs(c - column) <= 2 && (r != row || c != column) &&
                   heights[std::size_t(9 * r + c)] < 0.2f;
      for (int minimum = 1; minimum <= 12; ++minimum)
        CHECK(are_around(raster, column, row, minimum, [](float z) { return z < 0.2f; }) ==
              (count >= minimum));
    }
}

TEST_CASE("an empty raster has no outliers, and a single point is none") {
  lowest_raster none = raster_of(0, 0, {}), one = raster_of(1, 1, {5});
  CHECK(remove_low_outliers(none, 0.3) == 0);
  CHECK(remove_unreachable(none, 1, 0.2) == 0);
  CHECK(remove_low_outliers(one, 0.3) == 0);
  CHECK(remove_unreachable(one, 1, 0.2) == 0);
  CHECK(one.holds(0, 0));
}

}  // namespace globalmatch::test_outliers
