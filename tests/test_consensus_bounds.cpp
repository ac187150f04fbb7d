#include "globalmatch/detail/global_matching/consensus_bounds.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "catch.hpp"
#include "consensus_scenes.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_consensus_bounds {

using namespace detail;

using scenes::any_pairs;
using scenes::consensus_size;
using scenes::four;
using scenes::local_pairs;

TEST_CASE("bounds of large maps hold, and most seeds are ruled out by votes alone") {
  random_source random(3);
  const auto views = scenes::half_overlapping_views(random, 120);
  const position_set source = scenes::set_in_order(views.source), target = scenes::set_in_order(views.target);
  const auto pairs = local_pairs(source, target, false, 0.1, 12);
  const matching_context maps(source, target, false, four);
  const consensus_finder finder(maps.source, maps.target, maps.horizontal, pairs, 0.1);
  REQUIRE(finder.correspondences().size() > agreements::room);
  const std::size_t best = largest_consensus(finder).best.size;
  const auto bounds = consensus_bounds(finder, 0);
  const auto by_votes = consensus_bounds(finder, std::numeric_limits<std::size_t>::max());
  std::size_t largest = 0, ruled_out = 0;
  for (std::size_t u = 0; u < finder.size(); ++u) {
    const std::size_t size = consensus_size(finder, u);
    largest = std::max(largest, size);
    REQUIRE(size <= bounds[u]);
    REQUIRE(bounds[u] <= by_votes[u]);
    ruled_out += by_votes[u] < best;
  }
  CHECK(largest == best);
  CHECK(2 * ruled_out > finder.size());
}

TEST_CASE("the pairs that agree with a correspondence bound the seeds with it, and count their sets") {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    INFO("seed " << seed);
    random_source random(seed);
    const position_set source = scenes::set_in_order(scenes::random_stems(random, 7, 6, 4));
    const position_set target = scenes::set_in_order(scenes::random_stems(random, 6, 6, 4));
    const bool horizontal = seed % 2 == 0;
    const auto pairs = any_pairs(source, target, horizontal, 1.2, random);
    const consensus_finder finder(source, target, horizontal, pairs, 1.2);
    agreements agreeing(finder);
    std::vector<std::uint32_t> all;
    for (std::uint32_t k = 0; k < finder.correspondences().size(); ++k) all.push_back(k);
    agreeing.prepare(all);
    for (std::size_t u = 0; u < finder.size(); ++u) {
      CHECK(agreeing.consensus_size(u) == finder.consensus(u).size());
      for (const std::uint32_t v : finder.vertices(u)) CHECK(agreeing.consensus_size(u) <= agreeing.bound(v));
    }
    std::vector<std::uint8_t> agrees;
    for (const std::uint32_t k : all) {
      std::size_t pairs_with = 0;
      for (std::size_t u = 0; u < pairs.size(); ++u) {
        bool all_agree = true;
        const auto [s, t] = finder.correspondences()[k];
        for (std::size_t i = 0; i < 3; ++i)
          all_agree = all_agree &&
                      std::abs(stem_distance(source.at[s], source.at[pairs[u].source[i]], horizontal) -
                               stem_distance(target.at[t], target.at[pairs[u].target[i]], horizontal)) < 1.2;
        pairs_with += all_agree;
      }
      CHECK(agreeing.bound(k) == 1 + pairs_with);
    }
  }
}

TEST_CASE("bounds below what is asked for are not made any better, and those of others are") {
  random_source random(82);
  const auto views = scenes::half_overlapping_views(random, 40);
  const position_set source = scenes::set_in_order(views.source), target = scenes::set_in_order(views.target);
  const auto pairs = local_pairs(source, target, false, 0.1, 10);
  const consensus_finder finder(source, target, false, pairs, 0.1);
  std::size_t best = 0;
  for (std::size_t u = 0; u < finder.size(); ++u) best = std::max(best, consensus_size(finder, u));
  const auto bounds = consensus_bounds(finder, best), all = consensus_bounds(finder, 0);
  auto lower = bounds;
  agreements agreeing(finder);
  lower_bounds_by_agreement(finder, best, lower, agreeing);
  std::size_t lowered = 0;
  for (std::size_t u = 0; u < finder.size(); ++u) {
    CHECK(lower[u] <= bounds[u]);
    CHECK(lower[u] >= consensus_size(finder, u));
    CHECK((bounds[u] < best || bounds[u] == all[u]));
    if (bounds[u] < best) CHECK(lower[u] == bounds[u]);
    lowered += lower[u] < bounds[u];
  }
  CHECK(lowered > 0);
}

TEST_CASE("without pairs there is nothing to bound") {
  const position_set none;
  const consensus_finder finder(none, none, false, {}, 0.1);
  CHECK(consensus_bounds(finder, 0).empty());
}

}  // namespace globalmatch::test_consensus_bounds
