#include "globalmatch/detail/matching/consensus_proposal.hpp"
#include "globalmatch/global_matching.hpp"

#include <limits>
#include <map>
#include <numeric>
#include <set>

#include "catch.hpp"
#include "oracles/algorithm_1.hpp"
#include "stem_scenes.hpp"

namespace globalmatch {

using namespace detail;

using scenes::positions;

namespace {

using scenes::four;

std::vector<triangle_pair> local_pairs(const position_set& source, const position_set& target,
                                       bool horizontal, double epsilon, int neighbors = 6) {
  return match_locally(build_triangles(source, horizontal, {.neighbors = neighbors}),
                       build_triangles(target, horizontal, {.neighbors = neighbors}), epsilon);
}

std::size_t consensus_size(const consensus_finder& finder, std::size_t seed) {
  agreements agreeing(finder);
  agreeing.prepare(finder.vertices(seed));
  return agreeing.consensus_size(seed);
}

void require_algorithm_1(const position_set& source, const position_set& target,
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
std::vector<triangle_pair> any_pairs(const position_set& source, const position_set& target, bool horizontal,
                                     double epsilon, random_source& random) {
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

void require_same(const local_hypothesis& a, const local_hypothesis& b) {
  CHECK(a.correspondences == b.correspondences);
  CHECK(to_eigen(a.target_from_source).matrix() == to_eigen(b.target_from_source).matrix());
  CHECK(a.rms == b.rms);
  CHECK(a.consensus == b.consensus);
}

/// Whether two triangle pairs agree.
bool agree(const position_set& source, const position_set& target, const triangle_pair& a,
           const triangle_pair& b, double epsilon = 0.05) {
  const matching_context maps(source, target, false, four);
  const consensus_finder finder(maps.source, maps.target, maps.horizontal, std::vector{a, b}, epsilon);
  CHECK(consensus_size(finder, 0) == consensus_size(finder, 1));
  return consensus_size(finder, 0) == 2;
}

/// A triangle at the origin and one 10 m away, turned by `turn` about its own centroid.
position_set two_triangles(double turn) {
  const positions first = {{0, 0, 0}, {3, 0, 0}, {1, 2, 0}};
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : first) centroid += p / 3;
  positions second = first;
  for (Eigen::Vector3d& p : second)
    p = scenes::yaw_and_shift(turn, centroid) * Eigen::Vector3d(p - centroid) + Eigen::Vector3d(10, 1, 0);
  positions both = first;
  both.insert(both.end(), second.begin(), second.end());
  return scenes::set_in_order(both);
}

const triangle_pair first_pair = {{0, 1, 2}, {0, 1, 2}, 0}, second_pair = {{3, 4, 5}, {3, 4, 5}, 0};

}  // namespace

TEST_CASE("two pairs of one motion agree, Fig. 6 a") {
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

TEST_CASE(
    "propose_by_consensus ranks the correspondences of Algorithm 1 first, but for those that it disproves") {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    INFO("seed " << seed);
    random_source random(seed);
    const auto views = scenes::half_overlapping_views(random, 30);
    const position_set source = scenes::set_in_order(views.source);
    const position_set target = scenes::set_in_order(views.target);
    const auto pairs = local_pairs(source, target, false, 0.05);
    const auto expected = oracles::largest_consensus(source, target, pairs, false, 0.05);
    const auto hypotheses = propose_by_consensus(matching_context(source, target, false, four), pairs, 0.05);
    REQUIRE_FALSE(hypotheses.empty());
    const local_hypothesis& best = hypotheses.front();
    CHECK(scenes::max_error(best.target_from_source, views.target_from_source, views.source) < 0.05);
    for (const correspondence& c : expected) {
      const double distance = (best.target_from_source * source.at[c.source] - target.at[c.target]).norm();
      const bool found = std::binary_search(best.correspondences.begin(), best.correspondences.end(), c);
      CHECK(found == (distance < 0.05));
    }
  }
}

TEST_CASE("propose_by_consensus gives ranked and distinct hypotheses that stand") {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    INFO("seed " << seed);
    random_source random(seed);
    const position_set source = scenes::set_in_order(scenes::random_stems(random, 15, 12, 12));
    const position_set target = scenes::set_in_order(scenes::random_stems(random, 15, 12, 12));
    const matching_context maps(source, target, false, four);
    const auto hypotheses = propose_by_consensus(maps, local_pairs(source, target, false, 0.3), 0.3);
    CHECK(std::is_sorted(hypotheses.begin(), hypotheses.end(), ranks_before));
    for (const local_hypothesis& a : hypotheses) {
      CHECK(a.inlier_threshold == 0.3);
      CHECK(maps.pair_stems(a.target_from_source, 0.3) == a.correspondences);
      for (const local_hypothesis& b : hypotheses)
        if (&a != &b) CHECK(differ(a, b, maps, 2 * 0.3));
    }
  }
}

TEST_CASE("propose_by_consensus finds at least two hypotheses on a lattice") {
  random_source random(1);
  const position_set stems = scenes::set_in_order(scenes::lattice(5, 5, 2.5));
  const position_set target =
      scenes::set_in_order(scenes::jittered(scenes::to_positions(stems.at), 0.02, random));
  const matching_context maps(stems, target, false, four);
  for (const global_matching_options options :
       {global_matching_options{}, {.max_hypotheses = 2, .max_seeds = 2}}) {
    const auto hypotheses =
        propose_by_consensus(maps, local_pairs(stems, target, false, 0.05), 0.05, options);
    CHECK(hypotheses.size() >= 2);
    CHECK(hypotheses.size() <= std::size_t(options.max_hypotheses));
  }
}

TEST_CASE("propose_by_consensus gives the same bits for any number of threads") {
  random_source random(2);
  const auto views = scenes::half_overlapping_views(random, 40);
  const position_set source = scenes::set_in_order(views.source), target = scenes::set_in_order(views.target);
  const matching_context maps(source, target, false, four);
  const auto pairs = local_pairs(source, target, false, 0.2, 12);
  REQUIRE(pairs.size() > 128);
  const auto with_threads = [&](int threads) {
    const execution exec{.threads = threads};
    const matching_context both(source, target, maps.source_index, maps.target_index, false, four, 1, exec);
    return propose_by_consensus(both, pairs, 0.2);
  };
  const auto expected = with_threads(1);
  for (const int threads : {2, 8}) {
    const auto hypotheses = with_threads(threads);
    REQUIRE(hypotheses.size() == expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i) require_same(hypotheses[i], expected[i]);
  }
}

TEST_CASE("propose_by_consensus of no pairs is no hypothesis") {
  const position_set none;
  CHECK(propose_by_consensus(matching_context(none, none, false, four), {}, 0.05).empty());
}

TEST_CASE("global matching options that make no sense are named") {
  CHECK_NOTHROW(require_valid(global_matching_options{}));
  CHECK_THROWS_AS(require_valid(global_matching_options{.max_hypotheses = 1}), std::invalid_argument);
  CHECK_THROWS_WITH(require_valid(global_matching_options{.max_hypotheses = 1}),
                    Catch::Contains("max_hypotheses must"));
  CHECK_THROWS_WITH(require_valid(global_matching_options{.max_hypotheses = 5, .max_seeds = 4}),
                    Catch::Contains("max_seeds must"));
}

}  // namespace globalmatch
