#include "globalmatch/detail/mapping/ground_surface.hpp"

#include "catch.hpp"
#include "forest_scenes.hpp"
#include "globalmatch/detail/mapping/stem_base.hpp"
#include "globalmatch/stem_mapping.hpp"

namespace globalmatch::test_ground_surface {

using namespace detail;

namespace {

/// A terrain whose node (c, r) holds `points(c, r)` ground points at `height(c, r)`.
template <class Points, class Height>
terrain with_ground(int size, const Points& points, const Height& height) {
  terrain ground;
  ground.resolution = 0.5;
  ground.columns = ground.rows = size;
  ground.first_ground.push_back(0);
  for (int r = 0; r < size; ++r)
    for (int c = 0; c < size; ++c) {
      ground.heights.push_back(float(height(c, r)));
      for (int k = 0; k < points(c, r); ++k)
        ground.ground.push_back({float(0.5 * c + 0.1), float(0.5 * r + 0.1), float(height(c, r))});
      ground.first_ground.push_back(std::uint32_t(ground.ground.size()));
    }
  return ground;
}

const auto everywhere = [](int, int) { return 4; };
const auto rolling = [](int c, int r) { return std::sin(0.2 * c) + 0.3 * std::cos(0.3 * r); };

}  // namespace

TEST_CASE("ground everywhere is a surface up to the outermost nodes") {
  const ground_surface surface = find_ground_surface(with_ground(20, everywhere, rolling));
  CHECK(surface.blocks == 18 * 18);
  CHECK(surface.holds_node(1, 1));
  CHECK_FALSE(surface.holds_node(0, 1));
}

TEST_CASE("patches of the width of a crown are no surface, however many there are") {
  const auto patches = [](int c, int r) { return c % 8 < 6 && r % 8 < 6 ? 4 : 0; };  // 3 m wide
  CHECK(find_ground_surface(with_ground(80, patches, rolling)).blocks == 0);
  const auto wider = [](int c, int r) { return c % 9 < 8 && r % 9 < 8 ? 4 : 0; };
  CHECK(find_ground_surface(with_ground(90, wider, rolling)).blocks == 100 * 36);
}

TEST_CASE("ground of one point a node is too thin for a surface, but not in blocks of a metre") {
  const auto thin = [](int, int) { return 1; };
  CHECK(find_ground_surface(with_ground(40, thin, rolling), 1).blocks == 0);
  CHECK(find_ground_surface(with_ground(40, thin, rolling), 2).blocks == 18 * 18);
}

TEST_CASE("what ends at one height and is no surface was cut off, a surface at one height was not") {
  const auto stems = [](int c, int r) { return c % 6 == 0 && r % 6 == 0 ? 2 : 0; };
  const auto flat = [](int, int) { return 1.0; };
  const auto cut = with_ground(80, stems, flat);
  CHECK(is_cut_off(cut, find_ground_surface(cut)));
  const auto uneven = with_ground(80, stems, rolling);
  CHECK_FALSE(is_cut_off(uneven, find_ground_surface(uneven)));
  const auto floor = with_ground(80, everywhere, flat);
  CHECK_FALSE(is_cut_off(floor, find_ground_surface(floor)));
}

TEST_CASE("the status says what heights rest on") {
  terrain empty;
  determine_status(empty, 4);
  CHECK(empty.status == ground_status::none);
  auto seen = with_ground(40, everywhere, rolling);
  determine_status(seen, 4);
  CHECK(seen.status == ground_status::seen);
  CHECK(seen.in_surface.size() == seen.heights.size());
  auto normalised = with_ground(40, everywhere, [](int c, int) { return 0.01 * (c % 3); });
  determine_status(normalised, 4);
  CHECK(normalised.status == ground_status::normalised);
  auto none = with_ground(
      40, [](int c, int) { return c % 4 == 0 ? 4 : 0; }, rolling);
  determine_status(none, 4);
  CHECK(none.status == ground_status::none);
}

TEST_CASE("stems of a scan whose ground was cut off say that their heights are not known") {
  const stem_map map = map_stems(scenes::small_plot().stems);
  REQUIRE(!map.stems.empty());
  CHECK(map.terrain.status == ground_status::none);
  for (const stem& s : map.stems) {
    CHECK(s.height_sigma == unknown_height_sigma);
    CHECK_FALSE(s.ground_seen);
  }
  const stem_map whole = map_stems(scenes::small_plot().scan());
  REQUIRE(whole.stems.size() >= 14);
  for (const stem& s : whole.stems) {
    CHECK(s.height_sigma > 0);
    CHECK(s.height_sigma < 0.5);
  }
}

TEST_CASE("ground at height 0 of the scan is normalised, wherever the frame of the terrain lies") {
  for (const double origin : {-7.0, 0.0, 3.0})
    for (const double height : {0.0, 1.0}) {
      terrain ground = with_ground(
          20, [](int, int) { return 9; }, [&](int, int) { return height - origin; });
      ground.frame.origin = {100, 200, origin};
      determine_status(ground, 4);
      CHECK((ground.status == ground_status::normalised) == (height == 0));
    }
}

TEST_CASE("the uncertainty of heights falls with the ground that was seen, and is never 0") {
  CHECK(height_uncertainty(0, 0) > 1);
  for (std::uint32_t points = 0; points < 50; ++points) {
    CHECK(height_uncertainty(0, points) > height_uncertainty(0, points + 1));
    CHECK(height_uncertainty(0.3, points) > 0.3);
  }
  CHECK(height_uncertainty(0, 50) > 0.01);
}

}  // namespace globalmatch::test_ground_surface
