#include "globalmatch/detail/survey/proposed_places.hpp"

#include <algorithm>
#include <cstdint>
#include <numbers>
#include <vector>

#include "catch.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_proposed_places {

using namespace detail;

TEST_CASE("the place that most proposals agree with is the one that brute force finds") {
  random_source random(1);
  for (int repeat = 0; repeat < 50; ++repeat) {
    std::vector<proposed_place> places;
    for (std::uint32_t i = 0; i < 30; ++i)
      places.push_back({{{scenes::uniform(random, 0, 5), scenes::uniform(random, 0, 2)}, 0}, {3, 4}, i});
    std::size_t most = 0;
    for (const proposed_place& a : places) {
      std::size_t count = 0;
      for (const proposed_place& b : places) count += (a.pose.shift - b.pose.shift).norm() < 1;
      most = std::max(most, count);
    }
    const agreeing_places found = max_agreement(places);
    CHECK(found.count == most);
    const auto only_even = [](std::size_t, const proposed_place& p) { return p.link % 2 == 0; };
    CHECK(max_agreement(places, only_even).count <= most);
  }
  CHECK(max_agreement(std::vector<proposed_place>()).count == 0);
}

TEST_CASE("proposals agree across a half turn, and not where only the center is the same") {
  const vec2 center = {0, 0};
  const proposed_place a{{{0, 0}, std::numbers::pi - 0.01}, center, 0},
      b{{{0.5, 0}, -std::numbers::pi + 0.01}, center, 1}, turned{{{0, 0}, 1}, center, 2};
  CHECK(agree(a, b));
  CHECK_FALSE(agree(a, turned));
}

}  // namespace globalmatch::test_proposed_places
