#include "globalmatch/stem_mapping.hpp"

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "catch.hpp"
#include "forest_scenes.hpp"

// The functions that detail/verbs/find_stems.hpp defines, where the headers declare them: in both modes.
namespace globalmatch::test_find_stems {

using namespace detail;

namespace {

const vec3 up{0, 0, 1};

/// Three stems on level ground at height 2.
scenes::cloud three_stems() {
  random_source random(4);
  const auto level = [](double, double) { return 2.0; };
  scenes::cloud scan = scenes::ground_points(random, 10, 0.1, 0.005, level);
  for (const auto& [x, y] : {std::pair(2.0, 3.0), {7.0, 2.5}, {5.0, 8.0}})
    scenes::append(scan, scenes::stem_points(random, scenes::upright(x, y, 2, 0.12), 2500,
                                             {.to = 4, .arc = std::numbers::pi, .noise = 0.003}));
  return scan;
}

struct read_scan {
  ground_model ground;
  understory_parts layer;

  explicit read_scan(const scenes::cloud& scan, const mapping_options& options = {}) {
    ground_funnel funnel;
    lowest_raster lowest = gather_lowest_points(scan, options.ground.resolution / 2, up, funnel);
    ground = model_terrain(std::move(lowest), funnel, options.ground, {}, false);
    layer = select_understory_parts(scan, ground.terrain, options.understory, options.voxel_size, {});
  }
};

}  // namespace

TEST_CASE("the stems over a ground and its understory are those of the map of the scan") {
  const scenes::cloud scan = three_stems();
  read_scan read(scan);
  const std::size_t in_layer = read.layer.in_layer;
  const stem_map map = find_stems(std::move(read.ground), std::move(read.layer), up, {}, {}),
                 expected = map_stems(scan);
  REQUIRE(map.stems.size() == 3);
  REQUIRE(expected.stems.size() == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(map.stems[i].position == expected.stems[i].position);
    CHECK(map.stems[i].radius == Approx(0.12).margin(0.01));
    CHECK(map.stems[i].position.z() == Approx(2).margin(0.03));
  }
  CHECK(map.funnel.understory == in_layer);
  CHECK(map.funnel.likely >= 3);
  CHECK(map.stem_samples == expected.stem_samples);
}

TEST_CASE("the bare ground is found by the filter that the options ask for") {
  const scenes::cloud scan = three_stems();
  mapping_options cloth;
  cloth.ground.filter = ground_filter::cloth;
  const terrain by_planes = read_scan(scan).ground.terrain, by_cloth = read_scan(scan, cloth).ground.terrain;
  const auto local_height = [](const terrain& ground) { return 2 - ground.frame.origin.z; };
  CHECK(by_planes.interpolated_height(5, 5) == Approx(local_height(by_planes)).margin(0.02));
  CHECK(by_cloth.interpolated_height(5, 5) == Approx(local_height(by_cloth)).margin(0.05));
}

TEST_CASE("an understory without points has no stems, and says where they were lost") {
  read_scan read(three_stems());
  const stem_map map = find_stems(std::move(read.ground), {}, up, {}, {});
  CHECK(map.stems.empty());
  CHECK(map.terrain.status == ground_status::seen);
  CHECK(map.up == Eigen::Vector3d::UnitZ());
  CHECK(where_lost(explain(map.funnel), 1).starts_with("understory: 0 "));
}

}  // namespace globalmatch::test_find_stems
