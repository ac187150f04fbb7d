#include "globalmatch/detail/matching/position_evidence.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <memory>
#include <span>

#include "catch.hpp"
#include "evidence_scene.hpp"

namespace globalmatch::test_position_evidence {

using namespace detail;

using scenes::four;
using scenes::positions;

namespace {

scenes::two_views views_of(std::uint64_t seed, std::size_t stems) {
  random_source random(seed);
  return scenes::half_overlapping_views(random, stems);
}

}  // namespace

TEST_CASE("stems are paired at increasing thresholds, or at the one that was asked for") {
  const auto views = views_of(1, 20);
  const scenes::evidence_scene free(views.source, views.target);
  CHECK(std::equal(free.positions_of.pairing().begin(), free.positions_of.pairing().end(),
                   std::begin(pairing_thresholds), std::end(pairing_thresholds)));
  CHECK(std::is_sorted(std::begin(pairing_thresholds), std::end(pairing_thresholds)));
  CHECK(std::is_sorted(std::begin(proposal_thresholds), std::end(proposal_thresholds)));
  const scenes::evidence_scene fixed(views.source, views.target, {.inlier_threshold = 0.13});
  REQUIRE(fixed.positions_of.pairing().size() == 1);
  CHECK(fixed.positions_of.pairing().front() == 0.13);
}

TEST_CASE(
    "both ways to propose find the transform of half overlapping views first, and count what they did") {
  for (const std::size_t stems : {40u, 160u})
    for (const proposal way : {proposal::triangle_index, proposal::algorithm_1}) {
      if (stems > 100 && way == proposal::algorithm_1) continue;  // takes long
      CAPTURE(stems, int(way));
      const auto views = views_of(2, stems);
      scenes::evidence_scene s(views.source, views.target, {.proposal = way});
      const auto hypotheses = s.positions_of.propose(6);
      REQUIRE_FALSE(hypotheses.empty());
      if (way == proposal::triangle_index) CHECK(hypotheses.size() <= 6);
      CHECK(std::is_sorted(hypotheses.begin(), hypotheses.end(), ranks_before));
      const local_hypothesis& best = hypotheses.front();
      CHECK(scenes::max_error(best.target_from_source, views.target_from_source, views.source) < 0.05);
      CHECK(best.log10_nfa < sufficient_log10_nfa);
      CHECK(s.funnel.local_pairs > 0);
      CHECK(s.funnel.tested > 0);
      CHECK((s.funnel.source_triangles > 0) ==
            (way == proposal::algorithm_1 || s.funnel.source_triangles > 0));
      for (const local_hypothesis& a : hypotheses)
        for (const local_hypothesis& b : hypotheses)
          if (&a != &b) CHECK(differ(a, b, s.maps, 2 * std::max(a.inlier_threshold, b.inlier_threshold)));
    }
}

TEST_CASE("the score of a transform is that of the null model, at the threshold of its hypothesis") {
  const auto views = views_of(3, 60);
  const scenes::evidence_scene s(views.source, views.target);
  const null_model null(s.maps, s.target.background, pairing_thresholds, proposal_thresholds);
  for (const double threshold : {0.04, 0.16})
    for (const double off : {0.0, 3.0}) {
      local_hypothesis h, expected;
      h.target_from_source = shifted_after(rigid(views.target_from_source), {off, 0, 0});
      h.inlier_threshold = expected.inlier_threshold = threshold;
      null.score(expected, null.residuals_under(h.target_from_source, threshold));
      const evidence_score score = s.positions_of.score(h);
      CHECK(score.source == evidence_source::positions);
      CHECK(score.log10_nfa == expected.log10_nfa);
      CHECK(score.log10_nfa_poisson == expected.log10_nfa_poisson);
      CHECK((score.log10_nfa < -10) == (off == 0));
    }
}

TEST_CASE("refitting takes the best of the thresholds that it is given") {
  const auto views = views_of(4, 60);
  const scenes::evidence_scene s(views.source, views.target);
  for (const double only : {0.057, 0.32}) {
    local_hypothesis h;
    h.target_from_source = rigid(views.target_from_source);
    h.inlier_threshold = 0.1;
    s.positions_of.refit(h, std::span(&only, 1));
    CHECK(h.inlier_threshold == only);
    CHECK(h.correspondences == s.maps.pair_stems(h.target_from_source, only));
  }
}

TEST_CASE("what a lattice explains is no evidence once the null model knows of it") {
  random_source random(5);
  positions planted = scenes::noisy(scenes::lattice(9, 8, 3), 0.02, random);
  const std::size_t rows = planted.size();
  for (const Eigen::Vector3d& p : scenes::random_stems(random, 500, 90, 90))
    planted.push_back(p + Eigen::Vector3d(40, 0, 0));
  scenes::evidence_scene s(scenes::noisy(scenes::lattice(9, 8, 3), 0.01, random), planted);
  local_hypothesis h;
  h.inlier_threshold = 0.08;
  for (stem_index i = 0; i < rows; ++i) h.correspondences.push_back({i, i});
  const evidence_score before = s.positions_of.score(h);
  s.positions_of.include_lattice_of(h);
  const evidence_score after = s.positions_of.score(h);
  CHECK(before.log10_nfa < -20);
  CHECK(after.log10_nfa > before.log10_nfa + 10);
  CHECK(after.log10_nfa_poisson == before.log10_nfa_poisson);
}

TEST_CASE("the background of paired stems is theirs, and knows no lattice of fewer than twenty") {
  const positions rows = scenes::lattice(8, 8, 3);
  const scenes::evidence_scene s(rows, rows);
  local_hypothesis h;
  for (stem_index i = 0; i < 64; ++i) h.correspondences.push_back({i, i});
  const position_set stems = scenes::set_in_order(rows);
  const background_density all(stems, std::make_shared<position_index>(stems));
  CHECK(paired_background(h, s.maps).lattice_inlier_probability(0.1) == all.lattice_inlier_probability(0.1));
  REQUIRE(all.lattice_inlier_probability(0.1) > 0.5);
  h.correspondences.resize(19);
  const position_set none;
  const background_density nothing(none, std::make_shared<position_index>(none));
  CHECK(paired_background(h, s.maps).lattice_inlier_probability(0.1) ==
        nothing.lattice_inlier_probability(0.1));
}

TEST_CASE("maps without stems propose nothing") {
  for (const proposal way : {proposal::triangle_index, proposal::algorithm_1}) {
    const scenes::evidence_scene s({}, {}, {.proposal = way});
    CHECK(s.positions_of.propose(5).empty());
  }
}

}  // namespace globalmatch::test_position_evidence
