#include "globalmatch/detail/global_matching/consensus_search.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

#include "catch.hpp"
#include "consensus_scenes.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_consensus_search {

using namespace detail;

using scenes::consensus_size;
using scenes::four;
using scenes::local_pairs;
using scenes::require_algorithm_1;

TEST_CASE("the largest consensus set is that of Algorithm 1 on larger maps, where bounds rule seeds out") {
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    INFO("seed " << seed);
    random_source random(seed);
    const auto views = scenes::half_overlapping_views(random, 30);
    const position_set source = scenes::set_in_order(views.source),
                       target = scenes::set_in_order(views.target);
    require_algorithm_1(source, target, local_pairs(source, target, false, 0.1, 8), false, 0.1);
  }
}

TEST_CASE("a sufficient consensus set ends the search") {
  random_source random(7);
  const auto views = scenes::half_overlapping_views(random, 40);
  const position_set source = scenes::set_in_order(views.source), target = scenes::set_in_order(views.target);
  const auto pairs = local_pairs(source, target, false, 0.1, 12);
  const matching_context maps(source, target, false, four);
  const consensus_finder finder(maps.source, maps.target, maps.horizontal, pairs, 0.1);
  const std::size_t largest = largest_consensus(finder).best.size;
  const std::size_t enough = largest_consensus(finder, 4).best.size;
  CHECK(enough >= 4);
  CHECK(enough <= largest);
  CHECK(largest_consensus(finder, largest + 1).best.size == largest);
}

TEST_CASE("of equally large sets that of the first seed wins") {
  const seed_consensus large{7, 5}, small{2, 4}, first{3, 5};
  CHECK(large.beats(small));
  CHECK_FALSE(small.beats(large));
  CHECK(first.beats(large));
  CHECK_FALSE(large.beats(first));
  CHECK_FALSE(large.beats(large));
}

TEST_CASE("seeds are sorted by what they promise, decreasing, equal ones as they were") {
  std::vector<std::uint32_t> seeds(40);
  for (std::uint32_t i = 0; i < 40; ++i) seeds[i] = i * 17 % 40;
  std::vector<std::uint32_t> expected = seeds;
  const auto of = [](std::uint32_t u) { return std::size_t(u % 7); };
  std::stable_sort(expected.begin(), expected.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return of(a) > of(b); });
  sort_decreasing(seeds, of);
  CHECK(seeds == expected);
  std::vector<std::uint32_t> none;
  sort_decreasing(none, of);
  CHECK(none.empty());
}

TEST_CASE("the search orders all seeds by what they promise, and leaves out some that cannot win") {
  random_source random(83);
  const auto views = scenes::half_overlapping_views(random, 100);
  const position_set source = scenes::set_in_order(views.source), target = scenes::set_in_order(views.target);
  const auto pairs = local_pairs(source, target, false, 0.1, 12);
  const consensus_finder finder(source, target, false, pairs, 0.1);
  const consensus_search search = largest_consensus(finder);
  REQUIRE(finder.size() > 1000);
  CHECK(search.visited >= 256);
  CHECK(search.visited < finder.size());
  std::size_t largest = 0;
  for (std::size_t u = 0; u < finder.size(); ++u) largest = std::max(largest, consensus_size(finder, u));
  CHECK(search.best.size == largest);
  CHECK(search.best.size == consensus_size(finder, search.best.seed));
  std::vector<std::uint32_t> sorted = search.order, all(finder.size());
  std::sort(sorted.begin(), sorted.end());
  std::iota(all.begin(), all.end(), 0u);
  CHECK(sorted == all);
}

}  // namespace globalmatch::test_consensus_search
