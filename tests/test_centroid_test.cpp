#include "baselines/centroid_test.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "baseline_scenes.hpp"
#include "catch.hpp"
#include "consensus_scenes.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_centroid_test {

using namespace benchmarks;
using scenes::inlier_threshold;

const auto run = [](const two_maps& maps, const run_limits& limits) {
  return run_centroid_test(maps, limits, inlier_threshold);
};

Eigen::Vector3d centroid(const position_set& stems, const std::array<stem_index, 3>& t) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const stem_index i : t) sum += to_eigen(stems.at[i]) / 3;
  return sum;
}

/// Most triangle pairs, the seed included, whose centroids are as far from the seed's in both maps.
std::size_t most_by_centroids(const position_set& source, const position_set& target,
                              const std::vector<triangle_pair>& pairs) {
  std::size_t most = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    std::size_t size = 1;
    for (std::size_t j = 0; j < pairs.size(); ++j) {
      const auto &u = pairs[i], &v = pairs[j];
      const double in_source = (centroid(source, u.source) - centroid(source, v.source)).norm(),
                   in_target = (centroid(target, u.target) - centroid(target, v.target)).norm();
      size += i != j && std::abs(in_source - in_target) < inlier_threshold;
    }
    most = std::max(most, size);
  }
  return most;
}

TEST_CASE("the largest consensus set of the centroid test is that of brute force") {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    INFO("seed " << seed);
    random_source random(seed);
    const auto views = scenes::half_overlapping_views(random, 20);
    const position_set source = scenes::set_in_order(views.source);
    const position_set target = scenes::set_in_order(views.target);
    const auto pairs = scenes::local_pairs(source, target, false, inlier_threshold);
    REQUIRE(!pairs.empty());
    const auto sets = oracles::consensus_sets(pairs, consistent_centroids(source, target, inlier_threshold));
    std::size_t most = 0;
    for (const auto& set : sets) most = std::max(most, set.size());
    CHECK(most == most_by_centroids(source, target, pairs));
  }
}

TEST_CASE(
    "the centroid test takes a turned triangle into the consensus set, Algorithm 1 does not, Fig. 6 b") {
  const position_set source = scenes::two_triangles(0), target = scenes::two_triangles(1);
  const std::vector<triangle_pair> pairs = {scenes::first_pair, scenes::second_pair};
  const auto by_centroids =
      oracles::consensus_sets(pairs, consistent_centroids(source, target, inlier_threshold));
  const auto by_edges = oracles::consensus_sets(source, target, pairs, false, inlier_threshold);
  CHECK(by_centroids == std::vector<std::vector<std::size_t>>{{0, 1}, {1, 0}});
  CHECK(by_edges == std::vector<std::vector<std::size_t>>{{0}, {1}});
}

TEST_CASE("the centroid test registers maps as Algorithm 1 does where enough stems are common") {
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    INFO("seed " << seed);
    const auto maps = scenes::small_maps(seed, 30, 0.7);
    CHECK(scenes::is_right(run(maps, {}), maps));
    CHECK(scenes::is_right(run_literal_algorithm_1(maps, {}, inlier_threshold), maps));
  }
}

TEST_CASE("the centroid test registers equal maps, in any order of their stems, and bears degenerate ones") {
  scenes::require_equal_maps_register(run);
  scenes::require_order_does_not_count(run);
  scenes::require_degenerate_maps_return(run);
}

TEST_CASE("the centroid test is stopped by its limits") {
  scenes::require_limits_stop(run, 200);
}

}  // namespace globalmatch::test_centroid_test
