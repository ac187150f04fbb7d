#include "globalmatch/detail/matching/robust_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "catch.hpp"
#include "stem_scenes.hpp"
#include "uneven_stems.hpp"

namespace globalmatch::test_robust_fit {

using namespace detail;

using scenes::four_dof;
using scenes::pairing_all;
using scenes::six_dof;
using scenes::some_transform;
using scenes::transformed_stems;
using scenes::uneven_stems;

using scenes::positions;

namespace {

/// Two maps of the same stems, stem i of one being stem i of the other, and what is known of them.
struct scene {
  position_set source, target;
  scenes::transform_of_scene truth;

  /// Fit of `pairs` as it comes out of matching: least squares, and all stems paired under it.
  local_hypothesis least_squares(const matching_context& maps, double inlier_threshold) const {
    local_hypothesis h;
    h.inlier_threshold = inlier_threshold;
    for (stem_index i = 0; i < source.size(); ++i) h.correspondences.push_back({i, i});
    h.target_from_source = *maps.fit(h.correspondences);
    h.correspondences = maps.pair_stems(h.target_from_source, inlier_threshold);
    return h;
  }

  double error(const local_hypothesis& h) const {
    double sum = 0;
    for (const vec3& p : source.at)
      sum += stem_distance(h.target_from_source * p, truth * p, true) / double(source.size());
    return sum;
  }
};

/// `sigma(i)` [m]: standard deviation of the horizontal coordinates of stem i.
scene noisy_scene(random_source& random, std::size_t stems, const auto& sigma) {
  scene s;
  const positions at = scenes::random_stems(random, stems, 40, 40);
  s.truth = scenes::random_levelled_transform(random);
  s.source = scenes::set_in_order(at);
  s.target = scenes::set_in_order(scenes::moved(s.truth, at));
  for (std::size_t i = 0; i < stems; ++i) {
    const Eigen::Vector2d off = sigma(i) * Eigen::Vector2d(random.normal(), random.normal());
    s.target.at[i] += vec3{off.x(), off.y(), 0};
  }
  return s;
}

using scenes::four;

}  // namespace

TEST_CASE("pairs that fit badly move a robust fit less than one of least squares") {
  random_source random(1);
  double robust = 0, least_squares = 0;
  for (int iteration = 0; iteration < 50; ++iteration) {
    const scene s = noisy_scene(random, 30, [](std::size_t i) { return i % 6 == 0 ? 0.2 : 0.01; });
    const matching_context maps(s.source, s.target, false, four);
    local_hypothesis h = s.least_squares(maps, 0.5);
    least_squares += s.error(h) / 50;
    fit_robustly(h, maps);
    robust += s.error(h) / 50;
  }
  CHECK(robust < least_squares / 4);
  CHECK(robust < 0.006);
}

TEST_CASE("a robust fit of Gaussian noise is nearly as good as one of least squares") {
  random_source random(2);
  double robust = 0, least_squares = 0;
  for (int iteration = 0; iteration < 200; ++iteration) {
    const scene s = noisy_scene(random, 12, [](std::size_t) { return 0.05; });
    const matching_context maps(s.source, s.target, false, four);
    local_hypothesis h = s.least_squares(maps, 0.5);
    least_squares += s.error(h) / 200;
    fit_robustly(h, maps);
    robust += s.error(h) / 200;
  }
  CHECK(robust < 1.1 * least_squares);
}

TEST_CASE("stems that are known to be uncertain move the fit less, whichever map knows it") {
  const auto sigma = [](std::size_t i) { return i % 3 == 0 ? 0.01 : 0.1; };
  for (const bool source_knows : {true, false}) {
    CAPTURE(source_knows);
    random_source random(3);
    double told = 0, not_told = 0;
    for (int iteration = 0; iteration < 100; ++iteration) {
      scene s = noisy_scene(random, 18, sigma);
      const matching_context maps(s.source, s.target, false, four);
      const local_hypothesis h = s.least_squares(maps, 1);
      local_hypothesis fitted = h;
      fit_robustly(fitted, maps);
      not_told += s.error(fitted) / 100;
      for (std::size_t i = 0; i < s.source.size(); ++i)
        (source_knows ? s.source : s.target).sigma.push_back(sigma(i));
      fitted = h;
      fit_robustly(fitted, maps);
      told += s.error(fitted) / 100;
    }
    CHECK(told < 0.5 * not_told);
  }
}

TEST_CASE("a robust fit is consistent: its pairs are those of its transform, and its rms theirs") {
  random_source random(4);
  for (int iteration = 0; iteration < 20; ++iteration) {
    const scene s = noisy_scene(random, 25, [](std::size_t i) { return i % 5 == 0 ? 0.15 : 0.02; });
    const matching_context maps(s.source, s.target, false, four);
    local_hypothesis h = s.least_squares(maps, 0.2);
    fit_robustly(h, maps);
    CHECK(h.correspondences == maps.pair_stems(h.target_from_source, h.inlier_threshold));
    CHECK(h.rms == maps.rms(h.target_from_source, h.correspondences));
    local_hypothesis again = h;
    fit_robustly(again, maps);
    for (const vec3& p : s.source.at)
      CHECK((h.target_from_source * p - again.target_from_source * p).norm() < 0.02);
  }
}

TEST_CASE("maps without any noise are fitted exactly, in 4-DoF and in 6-DoF") {
  random_source random(5);
  for (const auto dof : {four, degrees_of_freedom::six}) {
    const scene s = noisy_scene(random, 10, [](std::size_t) { return 0.0; });
    const matching_context maps(s.source, s.target, false, dof);
    local_hypothesis h = s.least_squares(maps, 0.1);
    fit_robustly(h, maps);
    CHECK(h.correspondences.size() == 10);
    CHECK(s.error(h) < 1e-9);
  }
}

TEST_CASE("wrong pairs among noisy ones do not move a robust fit, in 4-DoF and in 6-DoF") {
  for (const auto dof : {four, degrees_of_freedom::six}) {
    random_source random(7);
    double robust = 0, least_squares = 0;
    for (int iteration = 0; iteration < 20; ++iteration) {
      scene s = noisy_scene(random, 40, [](std::size_t) { return 0.02; });
      for (vec3& p : s.target.at) p.z += 0.02 * random.normal();
      for (std::size_t i = 0; i < 40; i += 8) s.target.at[i] += vec3{0.6, 0.3, 0};
      const matching_context maps(s.source, s.target, false, dof);
      local_hypothesis h = s.least_squares(maps, 1);
      least_squares += s.error(h) / 20;
      fit_robustly(h, maps);
      robust += s.error(h) / 20;
    }
    CAPTURE(int(dof));
    CHECK(robust < 0.02);
    CHECK(least_squares > 2 * robust);
  }
}

TEST_CASE("a robust fit of too few pairs to estimate their noise leaves them as they are") {
  random_source random(6);
  const scene s = noisy_scene(random, 5, [](std::size_t) { return 0.05; });
  const matching_context maps(s.source, s.target, false, four);
  const local_hypothesis given = s.least_squares(maps, 1);
  REQUIRE(given.correspondences.size() == 5);
  local_hypothesis h = given;
  fit_robustly(h, maps);
  CHECK(to_eigen(h.target_from_source).matrix() == to_eigen(given.target_from_source).matrix());
  CHECK(h.correspondences == given.correspondences);
}

TEST_CASE("pairs are completed as far as their noise goes, and no farther") {
  random_source random(9);
  const scene s = noisy_scene(random, 200, [](std::size_t) { return 0.02; });
  const matching_context maps(s.source, s.target, false, four);
  local_hypothesis h = s.least_squares(maps, 0.04);  // two standard deviations
  h.log10_nfa = -12.5;
  const std::size_t before = h.correspondences.size();
  REQUIRE(before < 185);
  SECTION("where a longer reach may be had") {
    const std::array thresholds = {0.02, 0.04, 0.057, 0.08, 0.113, 0.16};
    complete_pairs(h, maps, thresholds);
    CHECK(h.correspondences.size() >= 194);
    CHECK(h.inlier_threshold > 0.04);
    CHECK(h.inlier_threshold <= 0.08);
    CHECK(h.log10_nfa == -12.5);
    CHECK(s.error(h) < 0.006);
  }
  SECTION("not where the caller set the tolerance") {
    const std::array thresholds = {0.04};
    complete_pairs(h, maps, thresholds);
    CHECK(h.inlier_threshold == 0.04);
    CHECK(std::abs(double(h.correspondences.size()) - double(before)) <= 4);
  }
  SECTION("not where few pairs tell no scatter") {
    h.correspondences.resize(5);
    const local_hypothesis few = h;
    complete_pairs(h, maps, std::array{0.04, 0.08});
    CHECK(h.inlier_threshold == few.inlier_threshold);
    CHECK(h.correspondences == few.correspondences);
  }
}

TEST_CASE("the variance of a pair is the sum of the squares of both sigmas") {
  random_source random(104);
  position_set source = uneven_stems(8, random), target = source;
  source.sigma = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8};
  const matching_context one(source, target, false, four_dof);
  CHECK(known_variance(one, {2, 5}) == Approx(0.09));
  target.sigma = {0.01, 0.02, 0.03, 0.04, 0.05, 0.5, 0.07, 0.08};
  const matching_context both(source, target, false, four_dof);
  CHECK(known_variance(both, {2, 5}) == Approx(0.09 + 0.25));
}

TEST_CASE("robust weights are Tukey's over the variance of each pair") {
  random_source random(105);
  position_set source = uneven_stems(30, random);
  position_set target = transformed_stems(some_transform(), source);
  for (std::size_t i = 0; i < 30; ++i) {
    source.sigma.push_back(0.02 + 0.005 * double(i));
    target.at[i] += {0.3 * random.normal(), 0.1 * random.normal(), 0};
  }
  const matching_context maps(source, target, false, four_dof);
  const local_hypothesis h = pairing_all(30, some_transform());
  const double unknown = 0.0004;
  const auto weights = robust_weights(maps, h, unknown);
  std::size_t zeros = 0;
  for (std::size_t i = 0; i < 30; ++i) {
    const double variance = source.sigma[i] * source.sigma[i] + unknown;
    const double distance = (some_transform() * source.at[i] - target.at[i]).xy().norm();
    const double share = distance / (4.685 * std::sqrt(variance));
    const double expected = share < 1 ? std::pow(1 - share * share, 2) / variance : 0;
    zeros += expected == 0;
    CHECK(weights[i] == Approx(expected));
  }
  CHECK(zeros > 3);
  CHECK(zeros < 27);
}

TEST_CASE("the observed variance is that of the noise of a coordinate, from many pairs or few") {
  random_source random(106);
  for (const auto dof : {four_dof, six_dof})
    for (const std::size_t count : {8u, 60u}) {
      CAPTURE(int(dof), count);
      constexpr int trials = 400;
      double mean = 0;
      const position_set source = uneven_stems(count, random);
      for (int trial = 0; trial < trials; ++trial) {
        position_set target = transformed_stems(some_transform(), source);
        for (vec3& p : target.at) p += 0.05 * vec3{random.normal(), random.normal(), random.normal()};
        const matching_context maps(source, target, false, dof);
        local_hypothesis h = pairing_all(count, some_transform());
        h.target_from_source = *maps.fit(h.correspondences);
        mean += observed_variance(maps, h) / trials;
      }
      CHECK(mean == Approx(0.05 * 0.05).epsilon(count == 8 ? 0.3 : 0.08));
    }
}

TEST_CASE("what the known variances leave of the observed one is unknown") {
  random_source random(107);
  position_set source = uneven_stems(400, random);
  position_set target = transformed_stems(some_transform(), source);
  for (vec3& p : target.at) p += 0.1 * vec3{random.normal(), random.normal(), random.normal()};
  source.sigma.assign(400, 0.06);
  const matching_context maps(source, target, false, four_dof);
  const local_hypothesis h = pairing_all(400, some_transform());
  CHECK(unknown_variance(maps, h) == Approx(0.1 * 0.1 - 0.06 * 0.06).epsilon(0.15));
  source.sigma.assign(400, 0.2);
  CHECK(unknown_variance(maps, h) == Approx(0.1 * observed_variance(maps, h)));
}

}  // namespace globalmatch::test_robust_fit
