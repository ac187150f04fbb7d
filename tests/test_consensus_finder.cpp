#include "globalmatch/detail/global_matching/consensus_finder.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numeric>
#include <set>
#include <vector>

#include "catch.hpp"
#include "consensus_scenes.hpp"
#include "oracles/algorithm_1.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_consensus_finder {

using namespace detail;

using scenes::agree;
using scenes::any_pairs;
using scenes::first_pair;
using scenes::four;
using scenes::local_pairs;
using scenes::positions;
using scenes::require_algorithm_1;
using scenes::second_pair;
using scenes::two_triangles;

TEST_CASE("two pairs of one transform agree, Fig. 6 a") {
  const position_set source = two_triangles(0.3);
  const position_set target =
      scenes::set_in_order(scenes::moved(scenes::yaw_and_shift(2, {7, -3, 1}), source.at));
  CHECK(agree(source, target, first_pair, second_pair));
  CHECK(oracles::centroids_agree(source, target, first_pair, second_pair, 0.05));
}

TEST_CASE(
    "a pair that is turned about its centroid is rejected, though the urban method accepts it, Fig. 6 b") {
  const position_set source = two_triangles(0);
  for (const double turn : {0.2, 1.0, 2.0, 3.0, -1.5}) {
    const position_set target = two_triangles(turn);
    CHECK(oracles::centroids_agree(source, target, first_pair, second_pair, 1e-9));
    CHECK_FALSE(agree(source, target, first_pair, second_pair));
    CHECK(oracles::global_dissimilarity(source, target, first_pair, second_pair, false) > 0.05);
  }
}

TEST_CASE("global consistency wants every difference strictly below the tolerance") {
  const position_set source =
      scenes::set_in_order({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {8, 0, 0}, {9, 0, 0}, {10, 0, 0}});
  position_set target = source;
  for (std::size_t i = 3; i < 6; ++i) target.at[i].x += 0.5;
  CHECK_FALSE(agree(source, target, first_pair, second_pair, 0.5));
  CHECK(agree(source, target, first_pair, second_pair, std::nextafter(0.5, 1)));
}

TEST_CASE("consensus sets, their bounds and the largest equal Algorithm 1 on random maps") {
  for (std::uint64_t seed = 0; seed < 400; ++seed) {
    INFO("seed " << seed);
    random_source random(seed);
    const positions stems = scenes::random_stems(random, 6 + random.below(6), 10, 10);
    const position_set source = scenes::set_in_order(stems);
    const position_set target = scenes::set_in_order(
        scenes::noisy(scenes::moved(scenes::random_levelled_transform(random), stems), 0.05, random));
    const bool horizontal = seed % 2 == 0;
    require_algorithm_1(source, target, local_pairs(source, target, horizontal, 0.2, 4), horizontal, 0.2);
  }
}

TEST_CASE("consensus sets equal Algorithm 1 for pairs of any stems") {
  for (std::uint64_t seed = 0; seed < 2000; ++seed) {
    INFO("seed " << seed);
    random_source random(seed);
    const position_set source = scenes::set_in_order(scenes::random_stems(random, 3 + random.below(5), 5, 5));
    const position_set target = scenes::set_in_order(scenes::random_stems(random, 3 + random.below(5), 5, 5));
    const bool horizontal = seed % 2 == 0;
    const double epsilon = scenes::uniform(random, 0.3, 3);
    const auto pairs = any_pairs(source, target, horizontal, epsilon, random);
    require_algorithm_1(source, target, pairs, horizontal, epsilon);
  }
}

TEST_CASE(
    "consensus sets equal Algorithm 1 on lattices, where everything ties and triangles share vertices") {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    random_source random(seed);
    const auto part = [&] {
      const positions whole = scenes::lattice(4, 4, 2);
      auto order = scenes::random_order(whole.size(), random);
      order.resize(10);
      return scenes::set_in_order(scenes::reordered(whole, order));
    };
    const position_set source = part(), target = part();
    for (const double epsilon : {0.05, 1.0, 2.0})  // 2: a difference of just the tolerance is none
      require_algorithm_1(source, target, local_pairs(source, target, false, epsilon, 5), false, epsilon);
  }
}

TEST_CASE("the consensus set of a single pair is itself") {
  const position_set stems = two_triangles(0);
  const matching_context maps(stems, stems, false, four);
  const consensus_finder finder(maps.source, maps.target, maps.horizontal, std::vector{first_pair}, 0.05);
  CHECK(finder.consensus(0) == std::vector<std::uint32_t>{0});
}

TEST_CASE("vote_correspondences pairs one to one, by votes, whatever the consensus set") {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    random_source random(seed);
    const position_set stems = scenes::set_in_order(scenes::random_stems(random, 8, 5, 5));
    std::vector<triangle_pair> consensus(1 + random.below(20));
    for (triangle_pair& pair : consensus)
      for (std::size_t i = 0; i < 3; ++i) {
        pair.source[i] = random.below(8);
        pair.target[i] = random.below(8);
      }
    std::map<correspondence, int> votes;
    for (const triangle_pair& pair : consensus)
      for (std::size_t i = 0; i < 3; ++i) ++votes[{pair.source[i], pair.target[i]}];

    std::vector<std::uint32_t> all(consensus.size());
    std::iota(all.begin(), all.end(), 0u);
    const matching_context maps(stems, stems, false, four);
    const auto chosen = vote_correspondences(
        consensus_finder(maps.source, maps.target, maps.horizontal, consensus, 0.05), all);
    CHECK(std::is_sorted(chosen.begin(), chosen.end()));
    std::set<stem_index> sources, targets;
    for (const correspondence& c : chosen) {
      CHECK(votes[c] > 0);
      CHECK(sources.insert(c.source).second);
      CHECK(targets.insert(c.target).second);
    }
    for (const auto& entry : votes) {
      const correspondence& c = entry.first;
      CHECK(std::any_of(chosen.begin(), chosen.end(), [&](const correspondence& winner) {
        return (winner.source == c.source || winner.target == c.target) && votes[winner] >= entry.second;
      }));
    }
  }
}

TEST_CASE("correspondences are numbered in their order, with the pairs that they are part of as votes") {
  random_source random(81);
  const position_set source = scenes::set_in_order(scenes::random_stems(random, 9, 8, 5));
  const position_set target = scenes::set_in_order(scenes::random_stems(random, 7, 8, 5));
  const auto pairs = any_pairs(source, target, false, 2, random);
  REQUIRE(pairs.size() > 10);
  const matching_context maps(source, target, false, four);
  const consensus_finder finder(maps.source, maps.target, maps.horizontal, pairs, 2);
  std::map<correspondence, std::uint32_t> votes;
  for (const triangle_pair& pair : pairs)
    for (std::size_t i = 0; i < 3; ++i) ++votes[{pair.source[i], pair.target[i]}];
  REQUIRE(finder.correspondences().size() == votes.size());
  std::size_t number = 0;
  for (const auto& [c, count] : votes) {
    CHECK(finder.correspondences()[number] == c);
    CHECK(finder.votes()[number] == count);
    ++number;
  }
  REQUIRE(finder.size() == pairs.size());
  for (std::size_t u = 0; u < pairs.size(); ++u) {
    std::multiset<correspondence> expected, found;
    std::size_t sum = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      expected.insert({pairs[u].source[i], pairs[u].target[i]});
      found.insert(finder.correspondences()[finder.vertices(u)[i]]);
      sum += votes[{pairs[u].source[i], pairs[u].target[i]}];
      if (i > 0) CHECK(finder.votes()[finder.vertices(u)[i]] <= finder.votes()[finder.vertices(u)[i - 1]]);
    }
    CHECK(found == expected);
    CHECK(finder.votes_for(u) == sum);
  }
}

TEST_CASE("no consensus set exceeds the bound of any of its correspondences") {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    random_source random(seed);
    const position_set source = scenes::set_in_order(scenes::random_stems(random, 8, 6, 5));
    const position_set target = scenes::set_in_order(scenes::random_stems(random, 8, 6, 5));
    const auto pairs = any_pairs(source, target, false, 1.5, random);
    const consensus_finder finder(source, target, false, pairs, 1.5);
    for (std::size_t u = 0; u < finder.size(); ++u)
      for (const std::uint32_t v : finder.vertices(u)) CHECK(finder.consensus(u).size() <= finder.bound(v));
  }
}

}  // namespace globalmatch::test_consensus_finder
