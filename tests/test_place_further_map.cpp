#include "globalmatch/detail/verbs/place_further_map.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/verbs/solve_maps.hpp"
#include "made_up_surveys.hpp"

namespace globalmatch::test_place_further_map {

using namespace detail;

using namespace scenes;

namespace {

constexpr std::uint32_t last = 15;

/// A grid of maps that was solved without the last one, whose links follow those of the others.
struct grid_without_last {
  random_source random;
  surveyed_grid grid;
  std::vector<survey_link> before, now;
  local_survey solved;

  explicit grid_without_last(std::uint64_t seed) : random(seed), grid(4, 0.02, random) {
    std::vector<survey_link> links = links_within(35, grid.truth, {0.02, 0.001}, random), own;
    pair_stems(links, grid.seen);
    for (const survey_link& l : links) (l.target == last ? own : before).push_back(l);
    now = before;
    now.insert(now.end(), own.begin(), own.end());
    const std::span<const prepared_stems> maps = grid.maps;
    solved = solve_used_links(maps.first(last), std::vector<survey_link>(before), {}, {});
  }
  std::optional<local_survey> with_last() const {
    return with_last_map(solved, grid.maps, before, now, {}, {});
  }
};

}  // namespace

TEST_CASE("a further map is placed by its links, and the others are adjusted to it") {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const grid_without_last s(seed);
    const auto grown = s.with_last();
    REQUIRE(grown);
    REQUIRE(grown->members.size() == 1);
    const std::uint32_t reference = grown->placed.parts.reference[0];
    REQUIRE(grown->adjusted.poses.size() == 16);
    for (std::size_t m = 0; m < 16; ++m) {
      const plan_pose expected = s.grid.truth[reference].inverse() * s.grid.truth[m];
      CHECK((grown->adjusted.poses[m].shift - expected.shift).norm() < 0.06);
    }
    CHECK(grown->heights.known[last] != 0);
    CHECK(grown->adjusted.covariance[last](0, 0) > 0);
    CHECK(grown->adjusted.weights.size() == grown->adjusted.trees.stems.size());
  }
}

TEST_CASE("a further map without links is alone, and moves no other") {
  grid_without_last s(1);
  s.now = s.before;
  const auto grown = s.with_last();
  REQUIRE(grown);
  REQUIRE(grown->members.size() == 2);
  CHECK(grown->members[1] == std::vector<std::uint32_t>{last});
  for (std::size_t m = 0; m < last; ++m)
    CHECK(grown->adjusted.poses[m].shift == s.solved.adjusted.poses[m].shift);
}

TEST_CASE("links of a further map that contradict each other ask for all to be solved again") {
  grid_without_last s(2);
  make_wrong(s.now.back(), s.random);
  CHECK_FALSE(s.with_last());
}

TEST_CASE("a link of the survey that is not used any more asks for all to be solved again") {
  grid_without_last s(3);
  s.now.front().used = false;
  CHECK_FALSE(s.with_last());
}

}  // namespace globalmatch::test_place_further_map
