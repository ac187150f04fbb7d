#include "globalmatch/detail/survey/map_links.hpp"

#include <stdexcept>
#include <string>
#include <vector>

#include "catch.hpp"
#include "made_up_surveys.hpp"

namespace globalmatch::test_map_links {

using namespace detail;

using namespace scenes;

namespace {

struct linked_maps {
  surveyed_grid grid;
  map_links found;

  explicit linked_maps(random_source& random) : grid(2, 0.01, random) {
    found.map = 1;
    found.tried = 17;
    for (const std::uint32_t target : {2u, 3u}) {
      found.links.push_back(link_between(1, target, grid.truth, {0.01, 0.001}, random));
      survey_link& l = found.links.back();
      l.inlier_threshold = random.uniform();
      l.rms = random.uniform();
      l.correspondences = {{0, 1}, {2, 0}};
    }
  }
};

}  // namespace

TEST_CASE("links of a map are the same bits after they were bytes") {
  random_source random(1);
  const linked_maps made(random);
  const std::string bytes = bytes_of(made.found);
  const map_links back = map_links_of(1, bytes, made.grid.maps);
  CHECK(back.tried == 17);
  REQUIRE(back.links.size() == 2);
  for (std::size_t i = 0; i < 2; ++i) {
    const survey_link &a = made.found.links[i], &b = back.links[i];
    CHECK((a.source == b.source && a.target == b.target));
    CHECK(a.target_from_source.shift == b.target_from_source.shift);
    CHECK(a.target_from_source.yaw == b.target_from_source.yaw);
    CHECK(a.center == b.center);
    CHECK(a.covariance == b.covariance);
    CHECK(a.log10_nfa == b.log10_nfa);
    CHECK((a.inlier_threshold == b.inlier_threshold && a.rms == b.rms));
    CHECK(a.correspondences == b.correspondences);
    CHECK((b.supporting_cycles == 0 && b.used));
  }
  CHECK(bytes_of(back) == bytes);
}

TEST_CASE("links of other maps or stems, and bytes that are no links, are refused") {
  random_source random(2);
  const linked_maps made(random);
  const std::string bytes = bytes_of(made.found);
  CHECK_THROWS_AS(map_links_of(0, bytes, made.grid.maps), std::invalid_argument);
  CHECK_THROWS_AS(map_links_of(1, bytes.substr(0, bytes.size() - 1), made.grid.maps), std::invalid_argument);
  CHECK_THROWS_AS(map_links_of(1, bytes + 'x', made.grid.maps), std::invalid_argument);
  CHECK_THROWS_AS(map_links_of(1, bytes, std::span(made.grid.maps).first(3)), std::invalid_argument);
  map_links other = made.found;
  other.links[0].correspondences[1].source = std::uint32_t(made.grid.maps[1].stems.size());
  CHECK_THROWS_AS(map_links_of(1, bytes_of(other), made.grid.maps), std::invalid_argument);
  other = made.found;
  other.links[0].target = 1;
  CHECK_THROWS_AS(map_links_of(1, bytes_of(other), made.grid.maps), std::invalid_argument);
}

TEST_CASE("a fingerprint differs where one position, the order of the maps or the question does") {
  random_source random(3);
  surveyed_grid grid(2, 0.01, random);
  const std::uint64_t known = fingerprint_of(grid.maps, -6);
  CHECK(fingerprint_of(grid.maps, -6) == known);
  CHECK(fingerprint_of(grid.maps, -7) != known);
  CHECK(fingerprint_of(std::span(grid.maps).first(3), -6) != known);
  std::swap(grid.maps[0], grid.maps[1]);
  CHECK(fingerprint_of(grid.maps, -6) != known);
  std::swap(grid.maps[0], grid.maps[1]);
  grid.maps[3].stems.at.back().x += 1e-12;
  CHECK(fingerprint_of(grid.maps, -6) != known);
}

}  // namespace globalmatch::test_map_links
