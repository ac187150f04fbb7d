#include "baselines/branch_and_bound.hpp"

#include <chrono>
#include <cstddef>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "oracles/exhaustive_consensus.hpp"
#include "planted_matches.hpp"

namespace globalmatch::test_branch_and_bound {

using namespace benchmarks;
using detail::random_source;

namespace {

constexpr double threshold = 0.2;

}  // namespace

TEST_CASE("no consensus of few matches is larger than the one found, by a search of all angles") {
  random_source random(1);
  for (int trial = 0; trial < 10; ++trial) {
    const planted_matches planted(1 + std::size_t(trial) / 2, 3, 0.2, random);
    const max_consensus found = find_largest_consensus(planted.matches, {.threshold = threshold});
    constexpr double step = 0.01, farthest = 15;
    CHECK(found.inliers >= exhaustive_consensus(planted.matches, threshold, step));
    CHECK(found.inliers <= exhaustive_consensus(planted.matches, threshold + farthest * step / 2, step));
    CHECK(found.inliers == count_inliers(planted.matches, found.target_from_source, threshold));
    CHECK(found.bound >= found.inliers);
  }
}

TEST_CASE("the transform that a few of many matches agree on is found") {
  random_source random(2);
  for (int trial = 0; trial < 5; ++trial) {
    const planted_matches planted(12, 48, 0.05, random);
    const max_consensus found = find_largest_consensus(planted.matches, {.threshold = threshold});
    CHECK(found.inliers >= 12);
    CHECK(found.bound == found.inliers);
    CHECK_FALSE(found.stopped);
    for (std::size_t i = 0; i < 12; ++i) {
      const vec3& p = planted.matches[i].source;
      CHECK((found.target_from_source * p - planted.target_from_source * p).norm() < 2 * threshold);
    }
  }
}

TEST_CASE("the largest consensus is as large with pruning as without") {
  random_source random(3);
  for (int trial = 0; trial < 5; ++trial) {
    const planted_matches planted(8, 32, 0.1, random);
    const max_consensus all = find_largest_consensus(planted.matches, {.threshold = threshold});
    const pruned_matches pruned = prune_matches(planted.matches, threshold);
    const max_consensus rest =
        find_largest_consensus(pruned.matches, {.threshold = threshold}, pruned.target_from_source);
    CHECK(pruned.matches.size() < planted.matches.size());
    CHECK(rest.inliers == all.inliers);
    CHECK(rest.cubes <= all.cubes);
  }
}

TEST_CASE("a search that is stopped says so, and what it may have missed") {
  random_source random(4);
  const planted_matches planted(8, 32, 0.1, random);
  const max_consensus found = find_largest_consensus(
      planted.matches, {.threshold = threshold, .deadline = std::chrono::steady_clock::now()});
  CHECK(found.stopped);
  CHECK(found.bound >= 8);
  CHECK(found.cubes < 20);
}

TEST_CASE("a known transform that nothing beats is returned") {
  random_source random(5);
  const planted_matches planted(10, 0, 0.02, random);
  const max_consensus found =
      find_largest_consensus(planted.matches, {.threshold = threshold}, planted.target_from_source);
  CHECK(found.inliers == 10);
  CHECK(found.target_from_source.translation == planted.target_from_source.translation);
  CHECK(find_largest_consensus({}, {}).inliers == 0);
}

}  // namespace globalmatch::test_branch_and_bound
