// Triangle pairs, and their consensus sets compared with those of Algorithm 1.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/global_matching/consensus_bounds.hpp"
#include "globalmatch/detail/global_matching/consensus_finder.hpp"
#include "globalmatch/detail/global_matching/consensus_search.hpp"
#include "globalmatch/detail/matching/matching_context.hpp"
#include "globalmatch/local_matching.hpp"
#include "globalmatch/triangles.hpp"
#include "oracles/algorithm_1.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::scenes {

inline std::vector<triangle_pair> local_pairs(const position_set& source, const position_set& target,
                                              bool horizontal, double epsilon, int neighbors = 6) {
  return match_locally(build_triangles(source, horizontal, {.neighbors = neighbors}),
                       build_triangles(target, horizontal, {.neighbors = neighbors}), epsilon);
}

inline std::size_t consensus_size(const consensus_finder& finder, std::size_t seed) {
  agreements agreeing(finder);
  agreeing.prepare(finder.vertices(seed));
  return agreeing.consensus_size(seed);
}

inline void require_algorithm_1(const position_set& source, const position_set& target,
                                const std::vector<triangle_pair>& pairs, bool horizontal, double epsilon) {
  const auto sets = oracles::consensus_sets(source, target, pairs, horizontal, epsilon);
  const matching_context maps(source, target, horizontal, four);
  const consensus_finder finder(maps.source, maps.target, maps.horizontal, pairs, epsilon);
  const auto bounds = consensus_bounds(finder, 0);
  const auto by_votes_alone = consensus_bounds(finder, std::numeric_limits<std::size_t>::max());
  auto by_agreement = bounds;
  agreements agreeing(finder);
  lower_bounds_by_agreement(finder, 0, by_agreement, agreeing);
  for (std::size_t u = 0; u < pairs.size(); ++u) {
    std::vector<std::size_t> set = sets[u];
    std::sort(set.begin(), set.end());
    const auto found = finder.consensus(u);
    REQUIRE(std::equal(found.begin(), found.end(), set.begin(), set.end()));
    REQUIRE(consensus_size(finder, u) == set.size());
    REQUIRE(bounds[u] >= set.size());
    REQUIRE(by_votes_alone[u] >= set.size());
    REQUIRE(by_agreement[u] >= set.size());
  }
  if (pairs.empty()) return;
  const auto largest = std::max_element(sets.begin(), sets.end(),
                                        [](const auto& a, const auto& b) { return a.size() < b.size(); });
  const seed_consensus best = largest_consensus(finder).best;
  REQUIRE(best.size == largest->size());
  REQUIRE(best.seed == std::size_t(largest - sets.begin()));
}

/// Congruent pairs that no local matching made: any three stems, also the same one twice, in any order.
inline std::vector<triangle_pair> any_pairs(const position_set& source, const position_set& target,
                                            bool horizontal, double epsilon, random_source& random) {
  std::vector<triangle_pair> pairs;
  for (int tries = 0; tries < 400 && pairs.size() < 30; ++tries) {
    triangle_pair pair;
    for (std::size_t i = 0; i < 3; ++i) {
      pair.source[i] = random.below(static_cast<std::uint32_t>(source.size()));
      pair.target[i] = random.below(static_cast<std::uint32_t>(target.size()));
    }
    if (oracles::global_dissimilarity(source, target, pair, pair, horizontal) < epsilon)
      pairs.push_back(pair);
  }
  return pairs;
}

/// Whether two triangle pairs agree.
inline bool agree(const position_set& source, const position_set& target, const triangle_pair& a,
                  const triangle_pair& b, double epsilon = 0.05) {
  const matching_context maps(source, target, false, four);
  const consensus_finder finder(maps.source, maps.target, maps.horizontal, std::vector{a, b}, epsilon);
  CHECK(consensus_size(finder, 0) == consensus_size(finder, 1));
  return consensus_size(finder, 0) == 2;
}

/// A triangle at the origin and one 10 m away, turned by `turn` about its own centroid.
inline position_set two_triangles(double turn) {
  const positions first = {{0, 0, 0}, {3, 0, 0}, {1, 2, 0}};
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : first) centroid += p / 3;
  positions second = first;
  for (Eigen::Vector3d& p : second)
    p = yaw_and_shift(turn, centroid) * Eigen::Vector3d(p - centroid) + Eigen::Vector3d(10, 1, 0);
  positions both = first;
  both.insert(both.end(), second.begin(), second.end());
  return set_in_order(both);
}

inline const triangle_pair first_pair = {{0, 1, 2}, {0, 1, 2}, 0}, second_pair = {{3, 4, 5}, {3, 4, 5}, 0};

}  // namespace globalmatch::scenes
