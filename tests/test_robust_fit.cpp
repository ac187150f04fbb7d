#include "globalmatch/detail/matching/robust_fit.hpp"

#include <array>
#include <numeric>

#include "catch.hpp"
#include "stem_scenes.hpp"

namespace globalmatch {

using namespace detail;

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

/// `sigma(i)` [m]: standard deviation of the coordinates of stem i in plan.
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

TEST_CASE("a robust fit stands: its pairs are those of its motion, and its rms theirs") {
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
      const matching_context maps(s.source, s.target, false, dof, 5);
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

TEST_CASE("a robust fit of too few pairs to tell their scatter leaves them as they are") {
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

TEST_CASE("pairs are completed as far as their scatter reaches, and no farther") {
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

}  // namespace globalmatch
