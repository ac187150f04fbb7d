#include "globalmatch/detail/core/growing_grid.hpp"

#include <cmath>
#include <set>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"

namespace globalmatch::test_growing_grid {

using namespace detail;

TEST_CASE("points of a growing grid are found as brute force finds them, each once, while it grows") {
  random_source random(1);
  constexpr double cell = 0.5;
  growing_grid<double, 2> grid(cell);
  std::vector<std::array<double, 2>> points;
  CHECK_FALSE(grid.any_near({0, 0}, 100, [](const auto&) { return true; }));
  for (std::uint32_t i = 0; i < 600; ++i) {
    points.push_back({6 * random.uniform() - 3, 6 * random.uniform() - 3});
    grid.add({points.back(), i});
    REQUIRE(grid.size() == points.size());
    if (i % 20 != 0) continue;
    for (const double search_radius : {0.1, 0.5, 1.7}) {
      const std::array<double, 2> center = {6 * random.uniform() - 3, 6 * random.uniform() - 3};
      std::set<std::uint32_t> expected, found;
      for (std::uint32_t k = 0; k < points.size(); ++k)
        if (std::abs(points[k][0] - center[0]) <= search_radius &&
            std::abs(points[k][1] - center[1]) <= search_radius)
          expected.insert(k);
      grid.for_each_near(center, search_radius,
                         [&](const auto& item) { CHECK(found.insert(item.label).second); });
      CHECK(found == expected);
    }
  }
}

TEST_CASE("a search in a growing grid ends with the point that was searched for") {
  growing_grid<float, 3> grid(1);
  for (std::uint32_t i = 0; i < 10; ++i) grid.add({{0.1f, 0.2f, 0.3f}, i});
  std::size_t looked_at = 0;
  CHECK(grid.any_near({0, 0, 0}, 0.5f, [&](const auto&) { return ++looked_at == 4; }));
  CHECK(looked_at == 4);
}

}  // namespace globalmatch::test_growing_grid
