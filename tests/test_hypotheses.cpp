#include "globalmatch/detail/matching/hypotheses.hpp"

#include <cstddef>
#include <vector>

#include "catch.hpp"
#include "stem_pairs.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_hypotheses {

using namespace detail;

using scenes::four;
using scenes::same_indices;

TEST_CASE("hypotheses differ when they place the stems further apart than the distance, on average") {
  const position_set source = scenes::set_in_order({{0, 0, 0}, {10, 0, 0}, {0, 10, 0}});
  const matching_context maps(source, source, false, four);
  local_hypothesis a, b;
  a.correspondences = b.correspondences = same_indices(3);
  CHECK_FALSE(differ(a, b, maps, 0.1));
  b.target_from_source = scenes::yaw_and_shift(0, {0.0999, 0, 0});
  CHECK_FALSE(differ(a, b, maps, 0.1));
  CHECK_FALSE(differ(b, a, maps, 0.1));
  b.target_from_source = scenes::yaw_and_shift(0, {0, 0.1001, 0});
  CHECK(differ(a, b, maps, 0.1));
  CHECK(differ(b, a, maps, 0.1));
  b.target_from_source = scenes::yaw_and_shift(1, {0, 0, 0});
  CHECK(differ(a, b, maps, 0.1));
}

TEST_CASE("ranks_before puts more pairs first, then nearer ones, then the larger consensus") {
  local_hypothesis best, fewer, farther, lonelier;
  best.correspondences = farther.correspondences = lonelier.correspondences = same_indices(5);
  fewer.correspondences = same_indices(4);
  best.rms = lonelier.rms = 0.02;
  farther.rms = 0.03;
  fewer.rms = 0.01;
  best.consensus = 7;
  lonelier.consensus = 6;
  farther.consensus = fewer.consensus = 100;
  const std::vector<local_hypothesis> ranked = {best, lonelier, farther, fewer};
  for (std::size_t i = 0; i < ranked.size(); ++i)
    for (std::size_t j = 0; j < ranked.size(); ++j) CHECK(ranks_before(ranked[i], ranked[j]) == (i < j));
}

TEST_CASE("rank puts the best first and leaves equal ones as they were") {
  std::vector<local_hypothesis> all(5);
  for (std::size_t i = 0; i < all.size(); ++i) {
    all[i].correspondences = same_indices(i % 2);
    all[i].target_from_source.translation.x = double(i);
  }
  rank(all);
  std::vector<double> order;
  for (const local_hypothesis& h : all) order.push_back(h.target_from_source.translation.x);
  CHECK(order == std::vector<double>{1, 3, 0, 2, 4});
  keep_best(all, 7);
  CHECK(all.size() == 5);
  keep_best(all, 2);
  REQUIRE(all.size() == 2);
  CHECK(all[1].target_from_source.translation.x == 3);
}

TEST_CASE("ranks_before is a strict weak order") {
  random_source random(60);
  std::vector<local_hypothesis> all(40);
  for (local_hypothesis& h : all) {
    h.correspondences = same_indices(random.below(3));
    h.rms = random.below(3) * 0.01;
    h.consensus = random.below(3);
  }
  const auto equivalent = [](const local_hypothesis& a, const local_hypothesis& b) {
    return !ranks_before(a, b) && !ranks_before(b, a);
  };
  bool transitive = true, equivalence_transitive = true;
  for (const local_hypothesis& a : all) {
    CHECK_FALSE(ranks_before(a, a));
    for (const local_hypothesis& b : all) {
      CHECK_FALSE((ranks_before(a, b) && ranks_before(b, a)));
      for (const local_hypothesis& c : all) {
        transitive = transitive && (!ranks_before(a, b) || !ranks_before(b, c) || ranks_before(a, c));
        equivalence_transitive =
            equivalence_transitive && (!equivalent(a, b) || !equivalent(b, c) || equivalent(a, c));
      }
    }
  }
  CHECK(transitive);
  CHECK(equivalence_transitive);
}

TEST_CASE("a smaller NFA ranks before any number of pairs") {
  local_hypothesis few, many;
  few.log10_nfa = -5, many.log10_nfa = -4;
  few.correspondences = same_indices(3), many.correspondences = same_indices(9);
  CHECK(ranks_before(few, many));
  CHECK_FALSE(ranks_before(many, few));
}

TEST_CASE("hypotheses without pairs differ, having no stem in common") {
  const position_set none;
  const matching_context maps(none, none, false, four);
  CHECK(differ({}, {}, maps, 0.1));
}

TEST_CASE("a triangle leads to a hypothesis that transforms two of its stems, which are apart, onto theirs") {
  const position_set source = scenes::set_in_order({{0, 0, 0}, {6, 0, 0}, {0, 7, 0}, {1.5, 0, 0}});
  const rigid transform = scenes::yaw_and_shift(1.2, {20, -5, 3});
  position_set target = source;
  for (vec3& p : target.at) p = transform * p;
  const matching_context maps(source, target, false, four);
  local_hypothesis known;
  known.target_from_source = transform;
  known.inlier_threshold = 0.1;
  using triangle = std::array<correspondence, 3>;
  CHECK(leads_to(triangle{{{0, 0}, {1, 1}, {2, 2}}}, known, maps));
  CHECK(leads_to(triangle{{{0, 0}, {1, 1}, {2, 3}}}, known, maps));  // two are enough,
  CHECK(leads_to(triangle{{{1, 3}, {0, 0}, {2, 2}}}, known, maps));  // whichever they are
  CHECK(leads_to(triangle{{{2, 2}, {1, 3}, {0, 0}}}, known, maps));
  CHECK_FALSE(leads_to(triangle{{{0, 0}, {3, 3}, {2, 1}}}, known, maps));  // 1.5 m apart
  CHECK_FALSE(leads_to(triangle{{{0, 1}, {1, 2}, {2, 2}}}, known, maps));
  target.at[1].z += 1.2;  // heights have no say
  CHECK(leads_to(triangle{{{0, 0}, {1, 1}, {2, 3}}}, known, maps));
  target.at[1] += vec3{0.12, -0.15, 0};  // within twice the threshold, 0.19
  CHECK(leads_to(triangle{{{0, 0}, {1, 1}, {2, 3}}}, known, maps));
  target.at[1] += vec3{0.02, -0.03, 0};
  CHECK_FALSE(leads_to(triangle{{{0, 0}, {1, 1}, {2, 3}}}, known, maps));
}

TEST_CASE("of hypotheses that are views of one transform the best stays, whichever came first") {
  const position_set source = scenes::set_in_order({{0, 0, 0}, {10, 0, 0}, {0, 10, 0}});
  const matching_context maps(source, source, false, four);
  const auto at = [](double x, double log10_nfa, double inlier_threshold) {
    local_hypothesis h;
    h.correspondences = same_indices(3);
    h.target_from_source.translation.x = x;
    h.log10_nfa = log10_nfa;
    h.inlier_threshold = inlier_threshold;
    return h;
  };
  const auto added = [&](std::vector<local_hypothesis> all) {
    std::vector<local_hypothesis> distinct;
    for (local_hypothesis& h : all) add_distinct(std::move(h), distinct, maps);
    std::vector<double> at_x;
    for (const local_hypothesis& h : distinct) at_x.push_back(h.target_from_source.translation.x);
    std::sort(at_x.begin(), at_x.end());
    return at_x;
  };
  CHECK(added({at(0, -3, 0.1), at(0.15, -5, 0.1), at(7, -1, 0.1)}) == std::vector<double>{0.15, 7});
  CHECK(added({at(0.15, -5, 0.1), at(7, -1, 0.1), at(0, -3, 0.1)}) == std::vector<double>{0.15, 7});
  CHECK(added({at(0, -3, 0.1), at(0.25, -5, 0.1)}) == std::vector<double>{0, 0.25});
  CHECK(added({at(0, -3, 0.1), at(0.25, -5, 0.2)}) == std::vector<double>{0.25});  // the larger threshold's
  CHECK(added({at(0, -3, 0.1), at(0.3, -4, 0.1), at(0.15, -5, 0.1)}) == std::vector<double>{0.15});
}

TEST_CASE("a reversed hypothesis pairs the same stems the other way round, under the inverse") {
  local_hypothesis h;
  h.correspondences = {{0, 7}, {2, 3}, {5, 1}};
  h.target_from_source = scenes::yaw_and_shift(0.9, {4, -3, 2});
  h.log10_nfa = -6;
  h.rms = 0.03;
  const local_hypothesis back = reversed(h);
  CHECK(back.correspondences == std::vector<correspondence>{{1, 5}, {3, 2}, {7, 0}});
  const vec3 p{3, 8, -1};
  CHECK((back.target_from_source * (h.target_from_source * p) - p).norm() < 1e-12);
  CHECK(back.log10_nfa == -6);
  CHECK(back.rms == 0.03);
}

}  // namespace globalmatch::test_hypotheses
