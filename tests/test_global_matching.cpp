#include "globalmatch/global_matching.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <vector>

#include "catch.hpp"
#include "consensus_scenes.hpp"
#include "oracles/algorithm_1.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_global_matching {

using namespace detail;

using scenes::local_pairs;

TEST_CASE("global matching options that make no sense are named") {
  CHECK_NOTHROW(require_valid(global_matching_options{}));
  CHECK_THROWS_AS(require_valid(global_matching_options{.max_hypotheses = 1}), std::invalid_argument);
  CHECK_THROWS_WITH(require_valid(global_matching_options{.max_hypotheses = 1}),
                    Catch::Contains("max_hypotheses must"));
  CHECK_THROWS_WITH(require_valid(global_matching_options{.max_hypotheses = 5, .max_seeds = 4}),
                    Catch::Contains("max_seeds must"));
}

TEST_CASE("match_globally gives the correspondences of Algorithm 1's largest consensus set, and its size") {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    INFO("seed " << seed);
    random_source random(seed);
    const auto views = scenes::half_overlapping_views(random, 24);
    const position_set source = scenes::set_in_order(views.source);
    const position_set target = scenes::set_in_order(views.target);
    const auto pairs = local_pairs(source, target, false, 0.08);
    const consensus_set found = match_globally(source, target, false, pairs, 0.08);
    const auto sets = oracles::consensus_sets(source, target, pairs, false, 0.08);
    std::size_t largest = 0;
    for (const auto& set : sets) largest = std::max(largest, set.size());
    CHECK(found.size == largest);
    CHECK(found.correspondences == oracles::largest_consensus(source, target, pairs, false, 0.08));
    CHECK(std::is_sorted(found.correspondences.begin(), found.correspondences.end()));
  }
}

TEST_CASE("match_globally of no pairs is empty, and refuses a tolerance that is not positive") {
  const position_set none;
  CHECK(match_globally(none, none, false, {}, 0.1).correspondences.empty());
  CHECK(match_globally(none, none, false, {}, 0.1).size == 0);
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()})
    CHECK_THROWS_AS(match_globally(none, none, false, {}, bad), std::invalid_argument);
  CHECK_THROWS_WITH(match_globally(none, none, false, {}, 0.1, {.max_hypotheses = 1}),
                    Catch::Contains("max_hypotheses must"));
}

}  // namespace globalmatch::test_global_matching
