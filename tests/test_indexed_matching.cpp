#include "globalmatch/detail/matching/indexed_matching.hpp"

#include "catch.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_indexed_matching {

using namespace detail;

using scenes::positions;

namespace {

using scenes::four;
const std::vector<double> thresholds = {0.02, 0.04, 0.08, 0.16, 0.32};

std::vector<local_hypothesis> propose(const position_set& source, const position_set& target,
                                      double inlier_threshold = 0.05) {
  const auto index = std::make_shared<position_index>(target);
  const matching_context maps(source, target, std::make_shared<position_index>(source), index, false, four);
  const std::size_t neighbors = target.size() <= 100 ? 20 : 5;
  matching_funnel funnel;
  return match_by_index(maps, triangle_index(target, *index, false, neighbors), inlier_threshold,
                        null_model(maps), thresholds, target.size() <= 100, funnel);
}

}  // namespace

TEST_CASE("the index proposes the right transform first, on maps of some ten to some thousand stems") {
  for (const std::size_t stems : {20u, 60u, 150u, 1500u})
    for (std::uint64_t seed = 0; seed < 5; ++seed) {
      CAPTURE(stems, seed);
      random_source random(seed);
      const auto views = scenes::half_overlapping_views(random, stems);
      const position_set source = scenes::set_in_order(views.source),
                         target = scenes::set_in_order(views.target);
      const auto hypotheses = propose(source, target);
      REQUIRE_FALSE(hypotheses.empty());
      CHECK(std::is_sorted(hypotheses.begin(), hypotheses.end(), ranks_before));
      const scenes::transform_of_scene transform = target.frame.local_from_scan().inverse() *
                                                   hypotheses.front().target_from_source *
                                                   source.frame.local_from_scan();
      CHECK(scenes::max_error(transform, views.target_from_source, views.source) < 0.05);
    }
}

TEST_CASE("hypotheses of the index are distinct, and pair what they say") {
  random_source random(6);
  const position_set stems = scenes::set_in_order(scenes::jittered(scenes::lattice(7, 7, 3), 0.1, random));
  const position_set target = scenes::set_in_order(scenes::noisy(stems.at, 0.02, random));
  const matching_context maps(stems, target, false, four);
  const auto hypotheses = propose(stems, target, 0.2);
  CHECK(hypotheses.size() > 1);
  for (const local_hypothesis& a : hypotheses) {
    CHECK(maps.pair_stems(a.target_from_source, a.inlier_threshold) == a.correspondences);
    for (const local_hypothesis& b : hypotheses)
      if (&a != &b) CHECK(differ(a, b, maps, 2 * std::max(a.inlier_threshold, b.inlier_threshold)));
  }
}

TEST_CASE("maps too small for a triangle have no hypothesis") {
  random_source random(7);
  const position_set plenty = scenes::set_in_order(scenes::random_stems(random, 30, 20, 20));
  for (const std::size_t count : {0u, 1u, 2u}) {
    const position_set few = scenes::set_in_order(scenes::random_stems(random, count, 20, 20));
    CHECK(propose(few, plenty).empty());
    CHECK(propose(plenty, few).empty());
    CHECK(propose(few, few).empty());
  }
}

TEST_CASE("the search ends at the number of candidates that it is given") {
  random_source random(8);
  const position_set a = scenes::set_in_order(scenes::random_stems(random, 60, 25, 25));
  const position_set b = scenes::set_in_order(scenes::random_stems(random, 60, 25, 25));
  const matching_context maps(a, b, false, four);
  const triangle_index index(b, position_index(b), false, 20);
  const auto counted = [&](std::size_t max_candidates) {
    triangle_search search(maps, index, 0.1, true, max_candidates);
    for (stem_index i = 0; i < a.size() && !search.is_exhausted(); ++i) search.transforms_around(i, {});
    return search.candidates();
  };
  const std::size_t all = counted(5'000'000);
  CHECK(all > 1000);
  CHECK(counted(100) >= 100);
  CHECK(counted(100) < all / 2);
}

}  // namespace globalmatch::test_indexed_matching
