#include "globalmatch/detail/mapping/cell_columns.hpp"

#include <algorithm>
#include <cstdlib>
#include <set>
#include <vector>

#include "catch.hpp"
#include "forest_scenes.hpp"
#include "globalmatch/detail/mapping/cell_sorter.hpp"

namespace globalmatch::test_cell_columns {

using namespace detail;

TEST_CASE("runs near a place hold all points as near as asked for, and none far away") {
  random_source random(2);
  const cell_columns cells = sort_into_cells(scenes::as_local(scenes::random_cloud(random, 5000, 10)), 0.2);
  const local_points& points = cells.points();
  for (int repetition = 0; repetition < 50; ++repetition) {
    const double x = scenes::in_range(random, -6, 6), y = scenes::in_range(random, -6, 6);
    const double reach = scenes::in_range(random, 0, 4);
    std::set<std::uint32_t> found;
    cells.for_each_run_near(x, y, reach, [&](std::uint32_t begin, std::uint32_t end) {
      for (std::uint32_t i = begin; i < end; ++i) found.insert(i);
    });
    bool complete = true, near = true;
    for (std::uint32_t i = 0; i < points.size(); ++i) {
      const double away = std::max(std::abs(points.x[i] - x), std::abs(points.y[i] - y));
      if (away <= reach) complete = complete && found.contains(i);
      if (found.contains(i)) near = near && away <= reach + 0.2001;
    }
    CHECK(complete);
    CHECK(near);
  }
}

TEST_CASE("a window holds the columns around one that a search among all finds, wherever it is moved") {
  random_source random(4);
  const cell_columns cells = sort_into_cells(scenes::as_local(scenes::random_cloud(random, 3000, 10)), 0.2);
  const auto around = [&](std::size_t column, std::int32_t reach, std::int32_t from) {
    std::vector<std::size_t> found;
    const auto& center = cells.column_at(column);
    for (std::size_t c = 0; c < cells.columns(); ++c) {
      const auto away =
          std::max(std::abs(cells.column_at(c).x - center.x), std::abs(cells.column_at(c).y - center.y));
      if (away <= reach && away >= from) found.push_back(c);
    }
    return found;
  };
  column_window window(cells);
  const auto agrees_at = [&](std::size_t column) {
    window.move_to(column);
    bool same = true;
    for (std::int32_t reach = 0; reach <= column_window::max_half_width; ++reach)
      for (const std::int32_t from : {0, reach}) {
        std::vector<std::size_t> found;
        window.for_each_within(reach, from, [&](std::size_t c) { found.push_back(c); });
        same = same && found == around(column, reach, from);
      }
    return same;
  };
  bool same = true;
  for (std::size_t column = 0; column < cells.columns(); ++column) same = same && agrees_at(column);
  CHECK(same);
  for (int repetition = 0; repetition < 200; ++repetition)  // back and forth as well
    CHECK(agrees_at(random.below(static_cast<std::uint32_t>(cells.columns()))));
}

}  // namespace globalmatch::test_cell_columns
