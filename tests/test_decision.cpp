#include "globalmatch/detail/matching/decision.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "catch.hpp"
#include "stem_scenes.hpp"
#include "uneven_stems.hpp"

namespace globalmatch::test_decision {

using namespace detail;

using scenes::four_dof;
using scenes::pairing_all;
using scenes::some_transform;
using scenes::transformed_stems;
using scenes::uneven_stems;

using scenes::positions;

namespace {

/// One that is significant, unless its NFA is given.
local_hypothesis pairing(std::size_t stems, double log10_nfa = -20) {
  local_hypothesis h;
  h.log10_nfa = log10_nfa;
  for (stem_index i = 0; i < stems; ++i) h.correspondences.push_back({i, i});
  return h;
}

position_set scattered(std::size_t count) {
  random_source random(1);
  return scenes::set_in_order(scenes::random_stems(random, count, 30, 30));
}

position_set in_a_row(std::size_t count, double offset) {
  positions stems;
  for (std::size_t i = 0; i < count; ++i)
    stems.push_back({2.0 * double(i), 3.0 * double(i) + (i % 2 == 0 ? offset : -offset), 0});
  return scenes::set_in_order(stems);
}

decision decision_on(const std::vector<local_hypothesis>& hypotheses, const position_set& source,
                     const position_set& target, const decision_options& options = {}) {
  return decide(hypotheses, matching_context(source, target, true, degrees_of_freedom::four), options);
}

/// The decision on hypotheses that pair so many stems of two maps of 40.
decision score_counts(const std::vector<std::size_t>& counts) {
  std::vector<local_hypothesis> hypotheses;
  for (const std::size_t count : counts) hypotheses.push_back(pairing(count));
  const position_set stems = scattered(40);
  return decision_on(hypotheses, stems, stems);
}

}  // namespace

TEST_CASE("four paired stems are enough without an alternative, three are not") {
  CHECK(score_counts({4}).outcome == outcome::registered);
  CHECK(score_counts({3}).outcome == outcome::not_registered);
  CHECK(score_counts({}).outcome == outcome::not_registered);
}

TEST_CASE("a registered decision has no reason, any other one names the step, the counts and the remedy") {
  CHECK(score_counts({10}).reason.empty());
  CHECK_THAT(score_counts({3}).reason, Catch::StartsWith("matching: ") && Catch::Contains("pairs 3 stems") &&
                                           Catch::Contains("at least 4") && Catch::Contains("tolerance"));
  CHECK_THAT(score_counts({10, 9}).reason,
             Catch::StartsWith("matching: ") && Catch::Contains("pairs 10 stems") &&
                 Catch::Contains("another one 9") && Catch::Contains("overlap"));
}

TEST_CASE("a map of fewer stems than needed is named") {
  const std::vector<local_hypothesis> hypotheses = {pairing(3)};
  const decision few_source = decision_on(hypotheses, scattered(3), scattered(20));
  CHECK(few_source.outcome == outcome::not_registered);
  CHECK_THAT(few_source.reason,
             Catch::StartsWith("source: 3 stems") && Catch::Contains("scan a larger part"));
  const decision few_target = decision_on(hypotheses, scattered(20), scattered(0));
  CHECK(few_target.outcome == outcome::not_registered);
  CHECK_THAT(few_target.reason, Catch::StartsWith("target: 0 stems"));
}

TEST_CASE("what is not significant is not registered, and the reason says so") {
  const position_set stems = scattered(40);
  const auto decided = [&](double log10_nfa, const decision_options& options = {}) {
    return decision_on(std::vector{pairing(10, log10_nfa)}, stems, stems, options);
  };
  CHECK(decided(-3.01).outcome == outcome::registered);
  CHECK(decided(-2.99).outcome == outcome::not_registered);
  CHECK_THAT(decided(5).reason, Catch::StartsWith("matching: ") && Catch::Contains("10 stems") &&
                                    Catch::Contains("not significant") && Catch::Contains("overlap"));
  CHECK(decided(-2.99, {.max_nfa = 0.01}).outcome == outcome::registered);
  CHECK(decided(-4.99, {.comparisons = 100}).outcome == outcome::not_registered);
  CHECK(decided(-5.01, {.comparisons = 100}).outcome == outcome::registered);
}

TEST_CASE("an alternative that explains the stems half as well or better makes the best ambiguous") {
  const position_set stems = scattered(40);
  const auto decided = [&](double best, double alternative) {
    return decision_on(std::vector{pairing(20, best), pairing(15, alternative), pairing(15, alternative)},
                       stems, stems)
        .outcome;
  };
  CHECK(decided(-20, -10) == outcome::ambiguous);
  CHECK(decided(-20, -20) == outcome::ambiguous);
  CHECK(decided(-20, -9.9) == outcome::registered);
  CHECK(decided(-20, 3) == outcome::registered);
}

TEST_CASE("what only rows explain is ambiguous, for their shifts explain it as well") {
  const position_set stems = scattered(40);
  const auto decided = [&](double alarms, double at_random) {
    local_hypothesis best = pairing(20, alarms);
    best.log10_nfa_poisson = at_random;
    return decision_on({best, pairing(15, 0)}, stems, stems);
  };
  CHECK(decided(0, -20).outcome == outcome::ambiguous);
  CHECK(decided(0, -2.9).outcome == outcome::not_registered);
  CHECK(decided(-4, -20).outcome == outcome::registered);
  CHECK_THAT(decided(0, -20).reason, Catch::Contains("pairs 20 stems"));
}

TEST_CASE("stems in a line do not make a registration, however many") {
  for (const double offset : {0.0, 0.2}) {
    const position_set row = in_a_row(40, offset);
    const decision v = decision_on(std::vector<local_hypothesis>{pairing(40)}, row, row);
    CHECK(v.outcome == outcome::not_registered);
    CHECK_THAT(v.reason, Catch::StartsWith("matching: the 40 paired stems lie in a line"));
  }
  const position_set double_row = in_a_row(40, 2);
  CHECK(decision_on(std::vector<local_hypothesis>{pairing(40)}, double_row, double_row).outcome ==
        outcome::registered);
}

TEST_CASE("the minor axis sigma is the horizontal standard deviation across the line") {
  const position_set stems = scenes::set_in_order({{0, 1, 9}, {50, -1, 0}, {0, -1, -9}, {50, 1, 0}});
  CHECK(detail::minor_axis_sigma(pairing(4), stems) == Approx(1));
  const auto outcome_at = [&](double min_minor_axis_sigma) {
    return decision_on(std::vector<local_hypothesis>{pairing(4)}, stems, stems,
                       {.min_minor_axis_sigma = min_minor_axis_sigma})
        .outcome;
  };
  CHECK(outcome_at(0.99) == outcome::registered);
  CHECK(outcome_at(1.01) == outcome::not_registered);
}

TEST_CASE("all stems at one place do not make a registration") {
  const position_set pile = scenes::set_in_order(positions(10, Eigen::Vector3d(1, 2, 3)));
  CHECK(decision_on(std::vector<local_hypothesis>{pairing(10)}, pile, pile).outcome ==
        outcome::not_registered);
}

TEST_CASE("heights have no say in the decision") {
  random_source random(6);
  const positions level = scenes::random_stems(random, 20, 30, 30);
  positions raised = level;
  for (Eigen::Vector3d& p : raised) p.z() += 0.05 * p.x() + scenes::uniform(random, 0, 9);
  const position_set source = scenes::set_in_order(level), target = scenes::set_in_order(raised);
  const matching_context maps(source, target, false, degrees_of_freedom::four);
  local_hypothesis h = pairing(20);
  h.target_from_source = *maps.fit(h.correspondences);
  CHECK(decide(std::vector{h}, maps).outcome == outcome::registered);
}

TEST_CASE("a hypothesis is the more probable, the smaller its NFA, and 0.9 at most where not significant") {
  const auto of = [](std::size_t pairs, double log10_nfa) {
    return probability_of(std::vector{pairing(pairs, log10_nfa), pairing(3, 5)});
  };
  double before = 0;
  for (const double log10_nfa : {3., 1., 0., -1., -1.8, -3., -5., -6.}) {
    const double probability = of(10, log10_nfa);
    CHECK(probability > before);
    before = probability;
  }
  CHECK(of(10, -20) == of(10, -6));
  CHECK(of(10, 0) == Approx(0.2).margin(0.1));
  CHECK(of(10, -2.9) == 0.9);
  CHECK(of(10, -3.1) > 0.9);
  CHECK(of(4, -8) == of(40, -8));
  CHECK(of(3, -8) == 0);
  CHECK(probability_of({}) == 0);
  CHECK(probability_of(std::vector{pairing(20, -20)}) > 0.99);
}

TEST_CASE("outcomes have the names of the JSON output") {
  CHECK(to_string(outcome::registered) == "registered");
  CHECK(to_string(outcome::ambiguous) == "ambiguous");
  CHECK(to_string(outcome::not_registered) == "not_registered");
  CHECK(to_string(outcome::cancelled) == "cancelled");
}

TEST_CASE("decision options that make no sense are named") {
  CHECK(decision_options{}.min_correspondences == 4);
  CHECK_THROWS_AS(require_valid(decision_options{.min_correspondences = 2}), std::invalid_argument);
  CHECK_THROWS_WITH(require_valid(decision_options{.min_correspondences = 2}),
                    Catch::Contains("decision.min_correspondences"));
  for (const double bad : {-0.1, std::numeric_limits<double>::quiet_NaN()})
    CHECK_THROWS_WITH(require_valid(decision_options{.min_minor_axis_sigma = bad}),
                      Catch::Contains("decision.min_minor_axis_sigma"));
  for (const double bad : {0.9, -1.0, HUGE_VAL, std::numeric_limits<double>::quiet_NaN()})
    CHECK_THROWS_WITH(require_valid(decision_options{.comparisons = bad}),
                      Catch::Contains("decision.comparisons"));
  for (const double bad : {0.0, -0.1, std::numeric_limits<double>::quiet_NaN()}) {
    CHECK_THROWS_WITH(require_valid(decision_options{.max_nfa = bad}), Catch::Contains("decision.max_nfa"));
    CHECK_THROWS_WITH(require_valid(decision_options{.alternative_share = bad}),
                      Catch::Contains("decision.alternative_share"));
  }
}

TEST_CASE("the standard deviation across a line of stems is the smallest in any direction") {
  random_source random(115);
  position_set source = uneven_stems(40, random);
  for (vec3& p : source.at) p.y += 0.7 * p.x;
  const double sigma = minor_axis_sigma(pairing_all(40, rigid::identity()), source);
  double smallest = 1e9;
  for (int k = 0; k < 3600; ++k) {
    const double angle = k * std::numbers::pi / 3600, x = std::cos(angle), y = std::sin(angle);
    double sum = 0, squares = 0;
    for (const vec3& p : source.at) {
      const double across = (p.x - 300) * x + (p.y + 80) * y;
      sum += across / 40;
      squares += across * across / 40;
    }
    smallest = std::min(smallest, std::sqrt(squares - sum * sum));
  }
  CHECK(sigma == Approx(smallest).epsilon(1e-4));
}

}  // namespace globalmatch::test_decision
