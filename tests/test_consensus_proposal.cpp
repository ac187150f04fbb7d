#include "globalmatch/detail/matching/consensus_proposal.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "catch.hpp"
#include "consensus_scenes.hpp"
#include "oracles/algorithm_1.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_consensus_proposal {

using namespace detail;

using scenes::four;
using scenes::local_pairs;

namespace {

void require_same(const local_hypothesis& a, const local_hypothesis& b) {
  CHECK(a.correspondences == b.correspondences);
  CHECK(to_eigen(a.target_from_source).matrix() == to_eigen(b.target_from_source).matrix());
  CHECK(a.rms == b.rms);
  CHECK(a.consensus == b.consensus);
}

}  // namespace

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

TEST_CASE("propose_by_consensus gives ranked and distinct hypotheses that pair what they say") {
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
    const matching_context both(source, target, maps.source_index, maps.target_index, false, four, exec);
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

}  // namespace globalmatch::test_consensus_proposal
