#include "globalmatch/indexed_matching.hpp"

#include "catch.hpp"
#include "stem_scenes.hpp"

namespace globalmatch {

using scenes::positions;

namespace {

using scenes::four;
const std::vector<double> tolerances = {0.02, 0.04, 0.08, 0.16, 0.32};

std::vector<hypothesis> propose(const position_set& source, const position_set& target,
                                const indexed_matching_options& options = {}, const execution& how = {},
                                double tolerance = 0.05) {
  const auto plan = std::make_shared<plan_index>(target);
  const map_pair maps(source, target, std::make_shared<plan_index>(source), plan, false, four);
  const std::size_t neighbors = target.size() <= 100 ? 20 : 5;
  matching_funnel funnel;
  return match_by_index(maps, triangle_index(target, *plan, false, neighbors), tolerance, chance(maps),
                        tolerances, options, target.size() <= 100, funnel, how);
}

}  // namespace

TEST_CASE("the index proposes the right motion first, on maps of some ten to some thousand stems") {
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
      const Eigen::Isometry3d motion = target.frame.local_from_scan().inverse() *
                                       hypotheses.front().target_from_source * source.frame.local_from_scan();
      CHECK(scenes::largest_error(motion, views.target_from_source, views.source) < 0.05);
    }
}

TEST_CASE("hypotheses of the index are distinct, and their pairs stand") {
  random_source random(6);
  const position_set stems = scenes::set_in_order(scenes::jittered(scenes::lattice(7, 7, 3), 0.1, random));
  const position_set target = scenes::set_in_order(scenes::noisy(stems.at, 0.02, random));
  const map_pair maps(stems, target, false, four);
  const auto hypotheses = propose(stems, target, {}, {}, 0.2);
  CHECK(hypotheses.size() > 1);
  for (const hypothesis& a : hypotheses) {
    CHECK(maps.pair_stems(a.target_from_source, a.tolerance) == a.correspondences);
    for (const hypothesis& b : hypotheses)
      if (&a != &b) CHECK(differ(a, b, maps, 2 * std::max(a.tolerance, b.tolerance)));
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

TEST_CASE("the search ends at the number of queries or of candidates that it is given") {
  random_source random(8);
  const position_set a = scenes::set_in_order(scenes::random_stems(random, 60, 25, 25));
  const position_set b = scenes::set_in_order(scenes::random_stems(random, 60, 25, 25));
  const map_pair maps(a, b, false, four);
  const auto counted = [&](const indexed_matching_options& options) {
    matching_funnel funnel;
    match_by_index(maps, triangle_index(b, plan_index(b), false, 20), 0.1, chance(maps), tolerances, options,
                   true, funnel);
    return funnel;
  };
  const matching_funnel all = counted({});
  CHECK(all.source_triangles > 5000);
  CHECK(counted({.most_queries = 100}).source_triangles < 400);  // the queries of a stem belong together
  CHECK(counted({.most_candidates = 100}).local_pairs < all.local_pairs / 2);
  CHECK(all.tested > 10 * a.size());
  CHECK(counted({.most_tried = 3}).tested <= 3 * a.size());
}

TEST_CASE("motions that most triangles vote for are tried first, each once") {
  random_source random(9);
  const position_set stems = scenes::set_in_order(scenes::random_stems(random, 30, 20, 20));
  const map_pair maps(stems, stems, true, four);
  detail::ballot votes(maps);
  const auto cast = [&](const std::array<stem_index, 3>& asked, const std::array<stem_index, 3>& like) {
    votes.ask(triangle{asked, {}}, 0);
    votes.vote(like);
  };
  votes.reset(0.01);
  cast({0, 3, 4}, {9, 7, 8});
  for (stem_index k = 1; k < 5; ++k) cast({0, k, k + 1}, {0, k, k + 1});  // in place, of any shape
  const auto elected = votes.elect(10);
  REQUIRE(elected.size() == 2);
  CHECK(elected[0] == std::array<correspondence, 3>{{{0, 0}, {4, 4}, {5, 5}}});
  CHECK(elected[1] == std::array<correspondence, 3>{{{0, 9}, {3, 7}, {4, 8}}});
  CHECK(votes.elect(1).size() == 1);
  votes.reset(0.01);
  CHECK(votes.elect(10).empty());
}

TEST_CASE("indexed matching options that make no sense are named") {
  CHECK_NOTHROW(require_valid(indexed_matching_options{}));
  CHECK_THROWS_WITH(require_valid(indexed_matching_options{.target_neighbors = 1}),
                    Catch::Contains("indexed.target_neighbors"));
  CHECK_THROWS_WITH(require_valid(indexed_matching_options{.source_neighbors = 1}),
                    Catch::Contains("indexed.source_neighbors"));
  CHECK_THROWS_WITH(require_valid(indexed_matching_options{.neighbors_of_few = 1}),
                    Catch::Contains("indexed.neighbors_of_few"));
  CHECK_THROWS_WITH(require_valid(indexed_matching_options{.enough_stems = 0}),
                    Catch::Contains("indexed.enough_stems"));
  CHECK_THROWS_WITH(require_valid(indexed_matching_options{.most_tried = 0}),
                    Catch::Contains("indexed.most_tried"));
  CHECK_THROWS_WITH(require_valid(indexed_matching_options{.most_hypotheses = 1}),
                    Catch::Contains("indexed.most_hypotheses"));
  CHECK_THROWS_WITH(require_valid(indexed_matching_options{.tried_neighbors = 4}),
                    Catch::Contains("indexed.tried_neighbors"));
}

}  // namespace globalmatch
