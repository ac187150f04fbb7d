#include "globalmatch/detail/mapping/terrain_model.hpp"

#include <cmath>
#include <utility>

#include "catch.hpp"
#include "forest_scenes.hpp"

namespace globalmatch::test_terrain_model {

using namespace detail;

namespace {

/// Cells whose lowest points lie on a plane, in a frame whose origin is (100, 200, `origin`) of the scan.
lowest_raster sloping_cells(int side, double origin, double slope) {
  lowest_raster raster;
  raster.frame.origin = {100, 200, origin};
  raster.resolution = 0.25;
  raster.columns = raster.rows = side;
  for (int r = 0; r < side; ++r)
    for (int c = 0; c < side; ++c) {
      const double x = 0.25 * (c + 0.5), y = 0.25 * (r + 0.5);
      raster.points.push_back(vec3f(vec3{x, y, slope * x}));
    }
  return raster;
}

}  // namespace

TEST_CASE("without lowest points there is no terrain, and no ground") {
  const ground_model model = model_terrain({}, {.points = 7}, {}, &planes_under_vegetation, {});
  CHECK(model.terrain.empty());
  CHECK(model.terrain.status == ground_status::none);
  CHECK(model.funnel.points == 7);
}

TEST_CASE("the terrain under lowest points on a plane is that plane, and ground was seen") {
  for (const double slope : {0.0, 0.4}) {
    const ground_model model =
        model_terrain(sloping_cells(80, 12, slope), {}, {}, &planes_under_vegetation, {});
    CHECK(model.terrain.status == ground_status::seen);
    CHECK_FALSE(model.terrain.cut_off);
    CHECK(model.funnel.ground_points > 5000);
    for (const double x : {2.0, 9.7, 17.0})
      CHECK(model.terrain.interpolated_height(x, 10) == Approx(slope * x).margin(0.01));
  }
}

TEST_CASE("lowest points far below their neighbours are left out, and counted") {
  lowest_raster cells = sloping_cells(80, 0, 0.1);
  for (const int c : {10, 33, 61}) cells.points[cells.cell(c, 40)].z -= 4;
  const ground_model model = model_terrain(std::move(cells), {}, {}, &planes_under_vegetation, {});
  CHECK(model.funnel.low_outliers == 3);
  for (const int c : {10, 33, 61}) {
    const double x = 0.25 * (c + 0.5);
    CHECK(model.terrain.interpolated_height(x, 0.25 * 40.5) == Approx(0.1 * x).margin(0.02));
  }
}

TEST_CASE("heights that are normalised already lie over ground at height 0 of the scan") {
  for (const double origin : {-3.0, 5.0}) {
    ground_options options;
    options.filter = ground_filter::normalized;
    const ground_model model =
        model_terrain(sloping_cells(40, origin, 0.3), {.cells = 1600}, options, &planes_under_vegetation, {});
    CHECK(model.terrain.status == ground_status::normalised);
    CHECK(model.terrain.columns == 20);
    CHECK(model.funnel.ground_points == 1600);
    CHECK(model.terrain.interpolated_height(4, 6) == Approx(-origin));
    CHECK(model.terrain.is_known(4, 6));
  }
}

TEST_CASE("how many cells of a node hold points: four in a dense scan, one in a sparse one") {
  lowest_raster cells = sloping_cells(20, 0, 0);
  CHECK(held_cells_a_node(cells) == 4);
  for (int r = 0; r < 20; ++r)
    for (int c = 0; c < 20; ++c)
      if (r % 2 == 1 || c % 2 == 0) cells.points[cells.cell(c, r)] = no_point;
  CHECK(held_cells_a_node(cells) == 1);
  cells.points.assign(cells.points.size(), no_point);
  CHECK(held_cells_a_node(cells) == 0);
}

}  // namespace globalmatch::test_terrain_model
