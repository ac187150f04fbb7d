#include "baselines/fast_match_pruning.hpp"

#include <algorithm>
#include <cstddef>
#include <numbers>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "oracles/exhaustive_consensus.hpp"
#include "planted_matches.hpp"

namespace globalmatch::test_fast_match_pruning {

using namespace benchmarks;
using detail::random_source;

namespace {

constexpr double threshold = 0.2;

bool holds(const std::vector<point_match>& matches, const point_match& wanted) {
  return std::any_of(matches.begin(), matches.end(), [&](const point_match& m) {
    return m.source == wanted.source && m.target == wanted.target;
  });
}

}  // namespace

TEST_CASE("the bound of a match is no less than any consensus that holds it") {
  random_source random(1);
  std::vector<angle_interval> intervals;
  for (int trial = 0; trial < 50; ++trial) {
    const planted_matches planted(10, 20, 0.15, random);
    const rigid turned = planted.target_from_source * rigid::turn_about({}, 0.02 * random.normal());
    const std::size_t consensus = count_inliers(planted.matches, turned, threshold);
    for (std::size_t k = 0; k < planted.matches.size(); ++k)
      if (count_inliers({planted.matches[k]}, turned, threshold) == 1)
        CHECK(bound_with(planted.matches, k, threshold, intervals).count >= consensus);
  }
}

TEST_CASE("pruning removes no match of the largest consensus, and most others") {
  random_source random(2);
  for (int trial = 0; trial < 20; ++trial) {
    const planted_matches planted(15, 85, 0.1, random);
    const pruned_matches pruned = prune_matches(planted.matches, threshold);
    for (std::size_t i = 0; i < 15; ++i) CHECK(holds(pruned.matches, planted.matches[i]));
    CHECK(pruned.matches.size() < 40);
    CHECK(pruned.consensus <= 16);
    CHECK(pruned.consensus == count_inliers(planted.matches, pruned.target_from_source, threshold));
    CHECK_FALSE(pruned.stopped);
  }
}

TEST_CASE("the largest consensus of few matches is as large after pruning, by a search of all angles") {
  random_source random(3);
  for (int trial = 0; trial < 8; ++trial) {
    const planted_matches planted(2 + std::size_t(trial) / 2, 4, 0.1, random);
    const pruned_matches pruned = prune_matches(planted.matches, threshold);
    constexpr double step = 0.01;
    CHECK(exhaustive_consensus(pruned.matches, threshold, step) ==
          exhaustive_consensus(planted.matches, threshold, step));
    CHECK(pruned.consensus <= exhaustive_consensus(planted.matches, threshold + 15 * step / 2, step));
  }
}

TEST_CASE("pruning that is stopped keeps what it did not bound") {
  random_source random(4);
  const planted_matches planted(15, 85, 0.1, random);
  const pruned_matches pruned = prune_matches(planted.matches, threshold, search_deadline::clock::now());
  CHECK(pruned.stopped);
  CHECK(pruned.matches.size() >= 99);
}

TEST_CASE("no matches leave none") {
  const pruned_matches pruned = prune_matches({}, threshold);
  CHECK(pruned.matches.empty());
  CHECK(pruned.consensus == 0);
}

}  // namespace globalmatch::test_fast_match_pruning
