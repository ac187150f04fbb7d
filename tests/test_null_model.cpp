#include "globalmatch/detail/matching/null_model.hpp"
#include "globalmatch/detail/matching/score_hypothesis.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "catch.hpp"
#include "stem_scenes.hpp"
#include "uneven_stems.hpp"

namespace globalmatch::test_null_model {

using namespace detail;

using scenes::four_dof;
using scenes::six_dof;
using scenes::transformed_stems;
using scenes::uneven_stems;

using scenes::positions;

namespace {

using scenes::four;

/// The hypothesis that both maps have one frame, at a threshold.
local_hypothesis scored_as_is(const null_model& null, double inlier_threshold) {
  local_hypothesis h;
  h.inlier_threshold = inlier_threshold;
  null.score(h, null.residuals_under({}, inlier_threshold));
  return h;
}

}  // namespace

TEST_CASE("the inlier probability is that of the target, or of rows that are known besides") {
  random_source random(1);
  const position_set source = scenes::set_in_order(scenes::random_stems(random, 300, 60, 60));
  const position_set target = scenes::set_in_order(scenes::random_stems(random, 300, 60, 60));
  const position_set rows = scenes::set_in_order(scenes::lattice(8, 8, 3));
  const matching_context maps(source, target, true, four);
  const background_density of_target(target, maps.target_index),
      of_rows(rows, std::make_shared<position_index>(rows));
  const std::vector<double> thresholds = {0.05, 0.2};
  null_model null(maps, thresholds);
  for (const double inlier_threshold : {0.05, 0.1, 0.2})
    CHECK(null.inlier_probability(inlier_threshold) == of_target.inlier_probability(inlier_threshold));
  null.include_lattice_of(of_rows, {});
  for (const double inlier_threshold : thresholds)
    CHECK(null.inlier_probability(inlier_threshold) == of_rows.lattice_inlier_probability(inlier_threshold));
  null.include_lattice_of(of_target, {});
  CHECK(null.inlier_probability(0.2) == of_rows.lattice_inlier_probability(0.2));
}

TEST_CASE("a map registered to itself pairs all its stems, or a sample, whatever its heights") {
  for (const std::size_t count : {50u, 20000u}) {
    CAPTURE(count);
    random_source random(2);
    const double side = std::sqrt(double(count)) * 3;
    const positions stems = scenes::random_stems(random, count, side, side);
    const position_set source = scenes::set_in_order(stems);
    const position_set target =
        scenes::set_in_order(scenes::moved(scenes::yaw_and_shift(0, {0, 0, 7}), stems));
    const matching_context maps(source, target, false, four);
    const auto residuals = null_model(maps).residuals_under(scenes::yaw_and_shift(0, {0.01, 0, 0}), 0.5);
    CHECK(residuals.expected <= 8192);
    CHECK(residuals.expected >= std::min(50.0, double(count) / 4));
    CHECK(residuals.matched(0.005) == 0);
    CHECK(residuals.matched(0.02) == residuals.expected);
  }
}

TEST_CASE(
    "the null model explains what a wrong transform pairs around a place, but not what a right one does") {
  random_source random(3);
  const position_set stems = scenes::set_in_order(scenes::random_stems(random, 900, 90, 90));
  const matching_context maps(stems, stems, true, four);
  const null_model null(maps);
  const vec3 middle{45, 45, 0};
  const scenes::transform_of_scene wrong = scenes::yaw_and_shift(0, {4.1, 2.3, 0});
  CHECK_FALSE(null.explains_around(rigid{}, middle, 40, 0.1));
  CHECK(null.explains_around(wrong, middle, 40, 0.1));
  CHECK_FALSE(null.explains_around(wrong, middle, 10, 0.1));  // of few stems nothing is known
  CHECK_FALSE(null.explains_around(scenes::yaw_and_shift(0, {1e4, 0, 0}), middle, 40, 0.1));
}

TEST_CASE("unrelated maps rarely pair as many stems as an NFA of a thousandth takes") {
  int alarms = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    random_source random(seed);
    const position_set source = scenes::set_in_order(scenes::random_stems(random, 60, 26, 26));
    const position_set target = scenes::set_in_order(scenes::random_stems(random, 60, 26, 26));
    const matching_context maps(source, target, true, four);
    const null_model null(maps);
    // the best of many transforms, those of one pair of stems onto another
    double best = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 300; ++i) {
      const std::vector<correspondence> start = {{random.below(60), random.below(60)},
                                                 {random.below(60), random.below(60)}};
      const auto transform = maps.fit(start);
      if (!transform) continue;
      local_hypothesis h;
      h.target_from_source = *transform;
      score_hypothesis(h, maps, null, std::vector{0.05, 0.1, 0.2, 0.4});
      best = std::min(best, h.log10_nfa);
    }
    REQUIRE(std::isfinite(best));
    alarms += best < -3;
  }
  CHECK(alarms == 0);
}

TEST_CASE("residuals of zero are improbable, not impossible, so that copies of a map can be compared") {
  const position_set stems = scenes::set_in_order(positions{{0, 0, 0}, {7, 1, 0}, {2, 9, 0}, {13, 4, 0}});
  for (const bool horizontal : {true, false}) {
    const matching_context maps(stems, stems, horizontal, four);
    const null_model null(maps, std::vector{0.05});
    const auto residuals = null.residuals_under(rigid{}, 0.05);
    CHECK(residuals.residuals == std::vector<double>(4, 0.0));
    const double alarms = null.log10_nfa(residuals, 0.05);
    CHECK(std::isfinite(alarms));
    CHECK(alarms < 0);
  }
}

TEST_CASE("nothing is significant in maps of fewer than three stems") {
  random_source random(1);
  for (const std::size_t count : {0u, 1u, 2u}) {
    const position_set few = scenes::set_in_order(scenes::random_stems(random, count, 10, 10));
    const matching_context maps(few, few, false, four);
    CHECK(null_model(maps).inlier_probability(0.05) == 1);
    const null_model null(maps, std::vector{0.05});
    const auto residuals = null.residuals_under(rigid{}, 0.05);
    CHECK(null.log10_nfa(residuals, 0.05) >= 0);
  }
}

TEST_CASE("the tests of the NFA are two source stems and target stems as far apart, at each threshold") {
  random_source random(101);
  const position_set source = uneven_stems(50, random), target = uneven_stems(300, random);
  for (const auto dof : {four_dof, six_dof}) {
    const matching_context maps(source, target, dof == four_dof, dof);
    const background_density density(target, maps.target_index);
    const std::vector<double> thresholds = {0.05, 0.1, 0.2};
    const null_model null(maps, thresholds);
    const double apart = std::min(extent(source), density.extent()) / 2, radius = density.stem_radius();
    const double as_far = 4 * apart * 0.1 / (radius * radius);
    REQUIRE(as_far < 300);
    const double by_two = 300 * as_far * 50.0 * 50.0 / 2;
    const double tests = 3 * (dof == four_dof ? by_two : by_two * 50 * as_far);
    CHECK(null.log10_nfa({}, 0.1) == Approx(std::log10(tests)));
  }
}

TEST_CASE("the probability of being as near grows with the area between two thresholds") {
  random_source random(102);
  const position_set target = uneven_stems(200, random);
  const position_set source = transformed_stems({mat3::identity(), {0.22, 0, 3}}, target);
  const matching_context maps(source, target, true, four_dof);
  const std::vector<double> thresholds = {0.1, 0.3};
  const null_model null(maps, thresholds);
  const auto set = null.residuals_under(rigid::identity(), 0.3);
  REQUIRE(set.residuals.size() > 150);
  const double low = null.inlier_probability(0.1), high = null.inlier_probability(0.3);
  double sum = 0;
  for (std::size_t i = 0; i < set.residuals.size(); ++i) {
    const double squared = set.residuals[i] * set.residuals[i];
    sum += squared < 0.01 ? low * squared / 0.01 : low + (high - low) * (squared - 0.01) / 0.08;
    CHECK(set.cumulative_probability[i] == Approx(sum));
  }
}

TEST_CASE("places of two maps in steps coincide as often as cells are wide, and those of one map do not") {
  random_source random(21);
  position_set source = scenes::set_in_order(scenes::random_stems(random, 100, 60, 60));
  position_set target = scenes::set_in_order(scenes::random_stems(random, 100, 60, 60));
  const std::vector<double> thresholds = {0.02, 0.1, 0.4};
  const double radius = std::sqrt(0.25 / std::numbers::pi);  // [m] of a circle as large as a cell
  const auto model = [&](double of_source, double of_target) {
    source.cell_area = of_source;
    target.cell_area = of_target;
    return matching_context(source, target, true, four);
  };
  const matching_context measured = model(0, 0);
  const null_model plain(measured, thresholds);
  const matching_context half = model(0, 0.25);
  const null_model one(half, thresholds);
  const matching_context both = model(1, 0.25);
  const null_model stepped(both, thresholds);
  for (const double inlier_threshold : thresholds) {
    CHECK(one.inlier_probability(inlier_threshold) == plain.inlier_probability(inlier_threshold));
    CHECK(stepped.inlier_probability(inlier_threshold) ==
          Approx(plain.inlier_probability(inlier_threshold + radius)));
  }
}

TEST_CASE("equal coordinates are no evidence where both maps are in wide steps") {
  random_source random(22);
  positions stems = scenes::random_stems(random, 60, 30, 30);
  const auto score = [&](double cell_area) {
    position_set source = scenes::set_in_order(stems), target = source;
    source.cell_area = target.cell_area = cell_area;
    const matching_context maps(source, target, true, four);
    const null_model null(maps, std::vector<double>{0.02});
    null_model::residual_set six = null.residuals_under({}, 0.02);
    six.residuals.resize(6);
    six.cumulative_probability.resize(6);
    return null.log10_nfa(six, 0.02);
  };
  CHECK(score(0) < -3);
  CHECK(score(0.25) > 1);
}

TEST_CASE("residuals of zero are certain on an exact lattice, and no evidence") {
  const position_set source = scenes::set_in_order(scenes::lattice(9, 9, 3)), target = source;
  const matching_context maps(source, target, true, four);
  const null_model null(maps, std::vector<double>{0.02, 0.1});
  const null_model::residual_set set = null.residuals_under({}, 0.1);
  REQUIRE(set.residuals.size() == 81);
  CHECK(set.cumulative_probability.back() > 75);
  local_hypothesis h;
  h.inlier_threshold = 0.1;
  null.score(h, set);
  CHECK(h.log10_nfa > 0);
  CHECK(h.log10_nfa_poisson < -100);
}

TEST_CASE("a dense clump on the stems of a sparse map is near several of them, and no evidence") {
  random_source random(5);
  const position_set sparse = scenes::set_in_order(scenes::random_stems(random, 200, 100, 100));
  // Several stems of the clump around each of the sparse ones in a corner of 20 m.
  positions clump;
  for (const vec3& p : sparse.at)
    if (p.x < 20 && p.y < 20)
      for (int i = 0; i < 4; ++i)
        clump.push_back({p.x + 0.4 * random.normal(), p.y + 0.4 * random.normal(), 0});
  const position_set dense = scenes::set_in_order(clump);
  REQUIRE(dense.size() >= 16);
  const matching_context maps(dense, sparse, true, four);
  null_model null(maps, std::vector<double>{0.9});
  const local_hypothesis one_way = scored_as_is(null, 0.9);
  null.include_reversed();
  const local_hypothesis both_ways = scored_as_is(null, 0.9);
  CHECK(one_way.log10_nfa < -6);
  CHECK(both_ways.log10_nfa > -1);
  CHECK(both_ways.log10_nfa_poisson > -1);
  CHECK(null.log10_nfa(null.residuals_under({}, 0.9), 0.9) == both_ways.log10_nfa);
}

TEST_CASE("clumps far apart are as little evidence, however the maps are turned") {
  for (const double yaw : {0.0, 0.4, 0.8}) {
    CAPTURE(yaw);
    random_source random(7);
    const rigid turned = rigid::turn_about({}, yaw);
    position_set sparse = scenes::set_in_order(scenes::random_stems(random, 200, 100, 100)), dense;
    for (vec3& p : sparse.at) {
      if ((p.x < 20 && p.y < 20) || (p.x > 80 && p.y > 80))
        for (int i = 0; i < 4; ++i)
          dense.at.push_back(turned * vec3{p.x + 0.4 * random.normal(), p.y + 0.4 * random.normal(), 0});
      p = turned * p;
    }
    dense = scenes::set_in_order(scenes::to_positions(dense.at));
    sparse = scenes::set_in_order(scenes::to_positions(sparse.at));
    const matching_context maps(dense, sparse, true, four);
    null_model null(maps, std::vector<double>{0.9});
    null.include_reversed();
    CHECK(scored_as_is(null, 0.9).log10_nfa > -1);
  }
}

TEST_CASE("of a large map those stems are looked at that may be near, and they are found as all would be") {
  random_source random(8);
  const position_set large = scenes::set_in_order(scenes::random_stems(random, 500, 60, 60));
  for (const std::size_t count : {2u, 60u}) {
    CAPTURE(count);
    const double side = count == 2 ? 0.5 : 1.2;
    positions few = scenes::random_stems(random, count, side, side);
    for (Eigen::Vector3d& p : few) p += Eigen::Vector3d(30, 30, 0);
    const position_set small = scenes::set_in_order(few);
    const matching_context maps(large, small, true, four);
    std::size_t near = 0;
    for (const vec3& p : large.at) {
      double nearest = 0.9;
      for (const vec3& q : small.at) nearest = std::min(nearest, (p - q).xy().norm());
      near += nearest < 0.9;
    }
    REQUIRE(near > 0);
    CHECK(null_model(maps).residuals_under({}, 0.9).residuals.size() == near);
  }
}

TEST_CASE("maps as dense as each other are scored one way, and a clump that is the same one both ways") {
  random_source random(6);
  const positions stems = scenes::random_stems(random, 200, 100, 100);
  const position_set target = scenes::set_in_order(stems),
                     alike = scenes::set_in_order(scenes::noisy(stems, 0.02, random));
  positions corner = scenes::random_stems(random, 30, 15, 15);
  positions with_corner = stems;
  with_corner.insert(with_corner.end(), corner.begin(), corner.end());
  const position_set dense = scenes::set_in_order(scenes::noisy(corner, 0.02, random)),
                     holds_dense = scenes::set_in_order(with_corner);
  const auto scores = [&](const position_set& source, const position_set& map) {
    const matching_context maps(source, map, true, four);
    null_model null(maps, std::vector<double>{0.1});
    const local_hypothesis before = scored_as_is(null, 0.1);
    null.include_reversed();
    const local_hypothesis after = scored_as_is(null, 0.1);
    return std::pair(before.log10_nfa, after.log10_nfa);
  };
  const auto [alike_before, alike_after] = scores(alike, target);
  CHECK(alike_after == alike_before);
  const auto [dense_before, dense_after] = scores(dense, holds_dense);
  CHECK(dense_after >= dense_before);
  CHECK(dense_after < -20);
}

}  // namespace globalmatch::test_null_model
