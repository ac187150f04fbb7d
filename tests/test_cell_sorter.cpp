#include "globalmatch/detail/mapping/cell_sorter.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <map>
#include <memory>
#include <tuple>
#include <vector>

#include "catch.hpp"
#include "forest_scenes.hpp"
#include "support/message_of.hpp"

namespace globalmatch::test_cell_sorter {

using namespace detail;

using support::message_of;

namespace {

using cell_key = std::tuple<double, double, double>;  // y, x, z

cell_key key_of(const local_points& points, std::size_t i, double width) {
  const auto cell = [&](float v) { return std::floor(double(v) / width); };
  return {cell(points.y[i]), cell(points.x[i]), cell(points.z[i])};
}

}  // namespace

TEST_CASE("cells hold the points that one map entry a cell holds, row by row, column by column, from below") {
  random_source random(1);
  for (const auto& [count, extent, width] :
       {std::tuple(2000, 3.0, 0.25), {30000, 10.0, 0.05}, {500, 1000.0, 0.05}, {1, 1.0, 0.1}}) {
    CAPTURE(count, extent, width);
    const local_points scan = scenes::as_local(scenes::random_cloud(random, std::size_t(count), extent));
    std::map<cell_key, std::vector<point_index>> expected;
    for (std::size_t i = 0; i < scan.size(); ++i) expected[key_of(scan, i, width)].push_back(scan.index[i]);
    const cell_columns cells = sort_into_cells(scan, width);
    REQUIRE(cells.cells() == expected.size());
    auto entry = expected.begin();
    bool same = true;
    std::size_t columns = 0;
    for (std::size_t row = 0; row < cells.rows(); ++row)
      for (std::size_t column = cells.columns_begin(row); column < cells.columns_end(row);
           ++column, ++columns) {
        CHECK(std::size_t(cells.column_at(column).y) == row);
        for (auto c = cells.cells_begin(column); c < cells.cells_end(column); ++c, ++entry) {
          const auto first = cells.points().index.begin() + std::ptrdiff_t(cells.points_begin(c));
          const auto last = cells.points().index.begin() + std::ptrdiff_t(cells.points_end(c));
          same = same && std::vector<point_index>(first, last) == entry->second &&
                 key_of(cells.points(), cells.points_begin(c), width) == entry->first;
        }
      }
    CHECK(same);
    CHECK(columns == cells.columns());
    CHECK((entry == expected.end()));
  }
}

TEST_CASE("points in many parts are sorted as if they came in one") {
  random_source random(7);
  const local_points all = scenes::as_local(scenes::random_cloud(random, 4000, 10));
  const auto in_parts = [&] {  // that two threads gathered
    parted_points points;
    for (int thread = 0; thread < 2; ++thread) points.gathered.push_back(std::make_unique<local_points>());
    constexpr std::size_t count = 150;
    for (std::size_t p = 0; p < count; ++p) {
      local_points& own = *points.gathered[p % 3 == 0];
      const std::size_t before = own.size();
      for (std::size_t i = p * all.size() / count; i < (p + 1) * all.size() / count; ++i)
        own.push_back(all[i], all.index[i]);
      points.parts.push_back({&own, before, own.size()});
    }
    return points;
  };
  for (const int threads : {1, 3}) {
    const cell_columns one = sort_into_cells(all, 0.2);
    const cell_columns many = detail::cell_sorter(in_parts(), all.frame, 0.2).sorted({.threads = threads});
    CHECK(many.points().index == one.points().index);
    CHECK(many.points().x == one.points().x);
    CHECK(many.cells() == one.cells());
    CHECK(many.columns() == one.columns());
  }
}

TEST_CASE("cells are the same bits for 1, 2 and 8 threads") {
  random_source random(3);
  const local_points scan = scenes::as_local(scenes::random_cloud(random, 200000, 20));
  const cell_columns alone = sort_into_cells(scan, 0.05, {.threads = 1});
  for (const int threads : {2, 8}) {
    const cell_columns together = sort_into_cells(scan, 0.05, {.threads = threads});
    CHECK((together.points().index == alone.points().index));
    CHECK(together.cells() == alone.cells());
    CHECK(together.columns() == alone.columns());
  }
}

TEST_CASE("no points, equal points and points far apart have cells") {
  const cell_columns none = sort_into_cells({}, 0.05);
  CHECK(none.cells() == 0);
  none.for_each_run_near(0, 0, 1, [](std::uint32_t, std::uint32_t) { FAIL("there are no runs"); });
  CHECK(sort_into_cells(scenes::as_local(scenes::cloud(100, Eigen::Vector3f(1, 2, 3))), 0.05).cells() == 1);
  local_points far;
  far.push_back({0, 0, 0}, 0);
  far.push_back({3e6f, 10, -2e6f}, 1);
  CHECK(sort_into_cells(far, 0.05).cells() == 2);
}

TEST_CASE("a cell width that is not positive is refused") {
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()})
    CHECK(message_of([&] { sort_into_cells({}, bad); }).starts_with("cell width"));
}

TEST_CASE("sorting can be cancelled") {
  local_points points;
  points.push_back({0, 0, 0}, 0);
  const execution exec{.on_progress = [](const progress& p) { return p.stage != "cells"; }};
  CHECK_THROWS_AS(sort_into_cells(points, 0.05, exec), operation_cancelled);
}

}  // namespace globalmatch::test_cell_sorter
