#include "globalmatch/detail/published/cloth_ground.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"

namespace globalmatch::test_cloth_ground {

using namespace detail;

TEST_CASE("the cloth falls on the lowest point of each node") {
  random_source random(204);
  lowest_raster lowest;
  lowest.columns = 10, lowest.rows = 6;
  for (int i = 0; i < 60; ++i)
    lowest.points.push_back(i % 7 == 3 ? no_point : vec3f(vec3{0.0, 0.0, 300 + random.normal()}));
  const auto minima = cloth_cell_minima(lowest, 5, 3);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 5; ++c) {
      float expected = std::numeric_limits<float>::infinity();
      for (int k = 0; k < 4; ++k) {
        const float z = lowest.points[lowest.cell(2 * c + k % 2, 2 * r + k / 2)].z;
        if (!std::isnan(z)) expected = std::min(expected, z);
      }
      CHECK(minima[std::size_t(5 * r + c)] == expected);
    }
}

TEST_CASE("a node without points has no minimum, and the cloth there is as high as around it") {
  lowest_raster lowest;
  lowest.columns = 12, lowest.rows = 8;
  const auto height = [](int c, int r) { return 50 + 0.05f * float(c) - 0.08f * float(r); };
  for (int r = 0; r < 8; ++r)
    for (int c = 0; c < 12; ++c)
      lowest.points.push_back(c / 2 == 3 && r / 2 == 1 ? no_point : vec3f(0, 0, height(c, r)));
  const auto minima = cloth_cell_minima(lowest, 6, 4);
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 6; ++c) {
      const float minimum = minima[std::size_t(6 * r + c)];
      if (c == 3 && r == 1)
        CHECK_FALSE(std::isfinite(minimum));
      else
        CHECK(minimum == height(2 * c, 2 * r + 1));
    }
  const auto heights = cloth_under_vegetation(lowest, 6, 4, {});
  REQUIRE(heights.size() == 24);
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 6; ++c) {
      const double at = heights[std::size_t(6 * r + c)];
      if (c == 3 && r == 1)  // between the lowest and the highest of its neighbours
        CHECK((at > height(6, 5) - 0.001 && at < height(6, 1) + 0.001));
      else
        CHECK(at == Approx(height(2 * c, 2 * r + 1)).margin(0.03));
    }
}

}  // namespace globalmatch::test_cloth_ground
