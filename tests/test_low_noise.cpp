#include "globalmatch/detail/mapping/low_noise.hpp"

#include "catch.hpp"
#include "forest_scenes.hpp"
#include "globalmatch/detail/mapping/outliers.hpp"
#include "globalmatch/stem_mapping.hpp"

namespace globalmatch::test_low_noise {

using namespace detail;

namespace {

/// 20 x 20 m of cells with points on a slope, of which `change(c, r)` is subtracted.
template <class Change>
lowest_raster slope_raster(double slope, const Change& change) {
  lowest_raster raster{{}, 0.25, 80, 80, {}};
  for (int r = 0; r < 80; ++r)
    for (int c = 0; c < 80; ++c)
      raster.points.push_back(
          {float(0.25 * c + 0.1), float(0.25 * r + 0.1), float(slope * 0.25 * c - change(c, r))});
  return raster;
}

}  // namespace

TEST_CASE("a clump below the ground is removed, on flat ground and on slopes, and nothing else") {
  for (const double slope : {0.0, 0.3, 0.6})
    for (const double depth : {3.0, 10.0, 60.0})
      for (const int width : {2, 3, 4}) {
        auto raster = slope_raster(slope, [&](int c, int r) {
          return c >= 41 && c < 41 + width && r >= 30 && r < 30 + width ? depth : 0;
        });
        CHECK(remove_low_clumps(raster, 1, 1) == std::size_t(width * width));
        for (int r = 0; r < 80; ++r)
          for (int c = 0; c < 80; ++c)
            CHECK(raster.holds(c, r) == !(c >= 41 && c < 41 + width && r >= 30 && r < 30 + width));
      }
}

TEST_CASE("a ditch, a hollow and a slope without clumps keep all their points") {
  auto ditch = slope_raster(0.2, [](int c, int) { return c >= 40 && c < 44 ? 2 : 0; });
  CHECK(remove_low_clumps(ditch, 1, 1) == 0);
  auto hollow = slope_raster(
      0, [](int c, int r) { return 2 * std::exp(-0.003 * (std::pow(c - 40, 2) + std::pow(r - 40, 2))); });
  CHECK(remove_low_clumps(hollow, 1, 1) == 0);
  auto slope = slope_raster(1, [](int, int) { return 0; });
  CHECK(remove_low_clumps(slope, 1, 1) == 0);
  lowest_raster empty;
  CHECK(remove_low_clumps(empty, 1, 1) == 0);
}

TEST_CASE("cells below the pairs around them are noise, on a slope too") {
  for (const double slope : {0.0, 0.6}) {
    auto raster = slope_raster(slope, [](int c, int r) { return c % 7 == 3 && r % 7 == 3 ? 0.2 : 0; });
    CHECK(remove_below_pairs(raster, 0.12) == 11 * 11);
    CHECK(remove_below_pairs(raster, 0.12) == 0);
  }
}

TEST_CASE("a thin layer that holds most points is the ground, a thicket is not") {
  height_histogram noisy, thicket, clean, few;
  for (int i = 0; i < 100; ++i) {
    noisy.add(0.82);
    thicket.add(0.02 * i);
    clean.add(0.02);
  }
  noisy.add(0);
  CHECK(noisy.layer_above_terrain() == Approx(0.7).margin(0.11));
  CHECK(std::isnan(thicket.layer_above_terrain()));
  CHECK(std::isnan(clean.layer_above_terrain()));
  few.add(0.8);
  CHECK(std::isnan(few.layer_above_terrain()));
  for (int i = 0; i < 20; ++i) noisy.add(0);  // ground below grass
  CHECK(std::isnan(noisy.layer_above_terrain()));
}

TEST_CASE("a sample keeps places to a millimetre, also of scans with points at 0 and outliers far away") {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<vec3> points = {{0, 0, 0},
                                    {691000.123, 5334000.456, 512.789},
                                    {0, 0, 0},
                                    {691020.001, 5334010.002, 513.003},
                                    {1e9, -1e9, 1e9},
                                    {nan, 1, 2},
                                    {691021.5, 5334011.25, 513.125}};
  sampled_points sample;
  std::vector<vec3> kept;
  for (const vec3& p : points) sample.push_back(p);
  sample.begin_chunk();
  sample.push_back(points[1]);
  sample.for_each([&](const vec3& p) { kept.push_back(p); });
  REQUIRE(kept.size() == 7);
  for (std::size_t i = 0; i < 5; ++i) CHECK((kept[i] - points[i]).norm() < 1e-3);
  CHECK((kept[5] - points[6]).norm() < 1e-3);
  CHECK(kept[6] == points[1]);
}

TEST_CASE("noise scattered below dense ground does not move the terrain") {
  random_source random(5);
  scenes::cloud scan = scenes::ground_points(random, 20, 0.02, 0.01, scenes::slope{10, 30});
  const stem_map clean = map_stems(scan);
  std::size_t low = 0;
  for (Eigen::Vector3f& p : scan)
    if (random.below(300) == 0) {
      p.z() -= float(scenes::in_range(random, 0.2, 1.5));
      ++low;
    }
  const stem_map noisy = map_stems(scan);
  CHECK(noisy.funnel.ground.low_points > low / 2);
  CHECK(clean.funnel.ground.low_points == 0);
  double largest = 0;
  for (double x = 1; x < 19; x += 0.5)
    for (double y = 1; y < 19; y += 0.5) {
      const vec3 local = noisy.terrain.frame.to_local({x, y, scenes::slope{10, 30}(x, y)});
      largest = std::max(largest, std::abs(noisy.terrain.interpolated_height(local.x, local.y) - local.z));
    }
  CHECK(largest < 0.1);
}

}  // namespace globalmatch::test_low_noise
