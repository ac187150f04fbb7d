#include "globalmatch/detail/mapping/single_station.hpp"

#include <algorithm>
#include <cstdint>
#include <vector>

#include "catch.hpp"
#include "seen_forest.hpp"

namespace globalmatch::test_single_station {

using namespace detail;

using scenes::station;

namespace {

stem_map map_of_station(std::uint64_t seed) {
  random_source random(seed);
  return station(scenes::random_trunks(random, 220, 60), {-6, 1}, 0.4, random).map;
}

}  // namespace

TEST_CASE("from where it stood a scanner does not see past its own stems") {
  for (const std::uint64_t seed : {1u, 2u, 3u}) CHECK(is_seen_from_scanner(map_of_station(seed)));
}

TEST_CASE("a scan whose points lie behind its stems was not taken from one place") {
  stem_map merged = map_of_station(4);
  for (std::uint16_t& range : merged.visible.ranges) range = 4000;
  CHECK_FALSE(is_seen_from_scanner(merged));
  stem_map elsewhere = map_of_station(4);  // its stems are those of another place
  elsewhere.stems = map_of_station(5).stems;
  CHECK_FALSE(is_seen_from_scanner(elsewhere));
}

TEST_CASE("few stems do not show from where a scan was taken, nor does a scan without returns") {
  stem_map few = map_of_station(6);
  few.stems.resize(7);
  CHECK_FALSE(is_seen_from_scanner(few));
  stem_map unseen = map_of_station(6);
  unseen.visible = {};
  CHECK_FALSE(is_seen_from_scanner(unseen));
  CHECK_FALSE(is_seen_from_scanner(stem_map()));
}

}  // namespace globalmatch::test_single_station
