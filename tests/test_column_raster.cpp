#include "globalmatch/detail/mapping/column_raster.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "catch.hpp"
#include "forest_scenes.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "globalmatch/detail/mapping/cell_sorter.hpp"

namespace globalmatch::test_column_raster {

using namespace detail;

namespace {

constexpr double width = 0.25, cell = width / 5;  // [m]

/// Points about (-0.4, 1.2), on both sides of zero, in the order of cells.
local_points clutter(std::size_t count, random_source& random) {
  local_points points;
  for (std::size_t i = 0; i < count; ++i)
    points.push_back(
        vec3f(vec3{1.7 * random.uniform() - 1.1, random.uniform() - 0.35, 9 * random.uniform() - 2}),
        static_cast<point_index>(i));
  return sort_into_cells(std::move(points), cell).points();
}

std::vector<point_index> all_of(const local_points& points) {
  std::vector<point_index> all;
  for (point_index i = 0; i < points.size(); ++i) all.push_back(i);
  return all;
}

using cells = std::map<std::pair<int, int>, std::vector<point_index>>;  // by y, x

cells cells_of(const local_points& points) {
  cells result;
  for (point_index i = 0; i < points.size(); ++i)
    result[{int(std::floor(points.y[i] / cell)), int(std::floor(points.x[i] / cell))}].push_back(i);
  return result;
}

/// Height bins that points within two cells of a cell fill.
int bins_around(const cells& taken, const local_points& points, int y, int x) {
  std::set<int> bins;
  for (const auto& [at, members] : taken)
    if (std::abs(at.first - y) <= 2 && std::abs(at.second - x) <= 2)
      for (const point_index i : members) bins.insert(((int(std::floor(points.z[i] / 0.1)) % 64) + 64) % 64);
  return int(bins.size());
}

}  // namespace

TEST_CASE("whole numbers are rounded down on both sides of zero") {
  for (const double v : {-3.0, -2.999, -0.5, -1e-9, 0.0, 0.5, 0.999, 1.0, 41.7, -41.7})
    CHECK(whole_number(v) == int(std::floor(v)));
}

TEST_CASE("height bins are a tenth of a metre high and repeat after 64") {
  CHECK(height_bit(0.05) == 1);
  CHECK(height_bit(0.15) == 2);
  CHECK(height_bit(-0.05) == std::uint64_t(1) << 63);
  CHECK(height_bit(0.25) == height_bit(0.25 + 6.4));
  CHECK(height_bit(0.25) == height_bit(0.25 - 12.8));
  CHECK(height_bit(0.25) != height_bit(0.25 + 3.2));
}

TEST_CASE("a square about a place, and a rectangle widened, reach as far on all sides") {
  const rectangle s = square_about({3, -1}, 0.5), w = rectangle{{1, 2}, {4, 8}}.widened(0.25);
  CHECK((s.low == vec2{2.5, -1.5} && s.high == vec2{3.5, -0.5}));
  CHECK((w.low == vec2{0.75, 1.75} && w.high == vec2{4.25, 8.25}));
}

TEST_CASE("the densest column is the one around which most height bins are filled, by brute force") {
  random_source random(1);
  for (const std::size_t count : {1u, 40u, 700u}) {
    const local_points points = clutter(count, random);
    const auto members = all_of(points);
    const column_raster raster(points, members, width);
    const cells taken = cells_of(points);
    int most = 0;
    for (const auto& [at, own] : taken)
      most = std::max(most, bins_around(taken, points, at.first, at.second));
    const auto best = raster.densest();
    REQUIRE(best);
    CHECK(best->bins == most);
    const int x = int(std::floor(best->center.x / cell)), y = int(std::floor(best->center.y / cell));
    CHECK(best->center.x == Approx((x + 0.5) * cell));
    CHECK(best->center.y == Approx((y + 0.5) * cell));
    CHECK(taken.count({y, x}) == 1);
    CHECK(bins_around(taken, points, y, x) == most);
  }
}

TEST_CASE("columns in a box, and every so many of their points, are those of a search among all") {
  random_source random(2);
  const local_points points = clutter(600, random);
  const auto members = all_of(points);
  const column_raster raster(points, members, width);
  const cells taken = cells_of(points);
  for (int trial = 0; trial < 40; ++trial) {
    const double x = 2 * random.uniform() - 1.3, y = 1.4 * random.uniform() - 0.5;
    const rectangle box{{x, y}, {x + 0.9 * random.uniform(), y + 0.4 * random.uniform()}};
    std::vector<point_index> expected;
    for (const auto& [at, own] : taken)
      if (at.second >= std::floor(box.low.x / cell) && at.second <= std::floor(box.high.x / cell) &&
          at.first >= std::floor(box.low.y / cell) && at.first <= std::floor(box.high.y / cell))
        expected.insert(expected.end(), own.begin(), own.end());
    CHECK(raster.count_in(box) == expected.size());
    for (const std::size_t step : {1u, 3u, 7u}) {
      std::vector<point_index> found, some;
      raster.for_each_in(box, step, [&](point_index i) { found.push_back(i); });
      for (std::size_t k = 0; k < expected.size(); k += step) some.push_back(expected[k]);
      CHECK(found == some);
    }
  }
}

TEST_CASE("columns that are taken out are gone, for those around them too") {
  random_source random(3);
  const local_points points = clutter(500, random);
  const auto members = all_of(points);
  column_raster raster(points, members, width);
  cells taken = cells_of(points);
  const rectangle everything{{-9, -9}, {9, 9}};
  for (auto best = raster.densest(); best; best = raster.densest()) {
    const rectangle box = square_about(best->center, 0.3);
    const auto gone = [&](double x, double y) {
      return x + 2 * y < best->center.x + 2 * best->center.y + 0.01;
    };
    raster.remove(box, gone);
    std::erase_if(taken, [&](const auto& entry) {
      const auto [y, x] = entry.first;
      return x >= std::floor(box.low.x / cell) && x <= std::floor(box.high.x / cell) &&
             y >= std::floor(box.low.y / cell) && y <= std::floor(box.high.y / cell) &&
             gone((x + 0.5) * cell, (y + 0.5) * cell);
    });
    int most = 0;
    std::size_t left = 0;
    for (const auto& [at, own] : taken) {
      most = std::max(most, bins_around(taken, points, at.first, at.second));
      left += own.size();
    }
    CHECK(raster.count_in(everything) == left);
    const auto next = raster.densest();
    CHECK((next ? next->bins : 0) == most);
  }
  CHECK(taken.empty());
}

TEST_CASE("a cluster without points has no columns") {
  column_raster raster(local_points{}, {}, width);
  CHECK_FALSE(raster.densest());
  CHECK(raster.count_in({{-9, -9}, {9, 9}}) == 0);
  raster.remove({{-9, -9}, {9, 9}}, [](double, double) { return true; });
  CHECK_FALSE(raster.densest());
}

}  // namespace globalmatch::test_column_raster
