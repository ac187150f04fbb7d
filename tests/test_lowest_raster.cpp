#include "globalmatch/detail/mapping/lowest_raster.hpp"

#include <cmath>
#include <vector>

#include "catch.hpp"

namespace globalmatch::detail::test_lowest_raster {

TEST_CASE("a raster holds the cells that have a point, and none beyond its edges") {
  lowest_raster raster;
  raster.columns = 3, raster.rows = 2;
  raster.points.assign(6, no_point);
  raster.points[raster.cell(2, 1)] = {0.6f, 0.3f, -4};
  raster.points[raster.cell(0, 1)] = {0.1f, 0.3f, 0};
  CHECK(raster.cell(2, 1) == 5);
  CHECK(raster.cell(0, 1) == 3);
  for (int r = -1; r <= 2; ++r)
    for (int c = -1; c <= 3; ++c) {
      CAPTURE(c, r);
      CHECK(raster.holds(c, r) == (r == 1 && (c == 0 || c == 2)));
    }
  CHECK_FALSE(lowest_raster{}.holds(0, 0));
  CHECK((std::isnan(no_point.x) && std::isnan(no_point.y) && std::isnan(no_point.z)));
}

}  // namespace globalmatch::detail::test_lowest_raster
