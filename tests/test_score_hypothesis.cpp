#include "globalmatch/detail/matching/score_hypothesis.hpp"

#include <cmath>
#include <cstddef>
#include <vector>

#include "catch.hpp"
#include "stem_scenes.hpp"
#include "uneven_stems.hpp"

namespace globalmatch::test_score_hypothesis {

using namespace detail;

using scenes::four;
using scenes::pairing_all;
using scenes::positions;
using scenes::some_transform;
using scenes::transformed_stems;
using scenes::uneven_stems;

namespace {

const std::vector<double> thresholds = {0.02, 0.04, 0.08, 0.16, 0.32, 0.64};

}  // namespace

TEST_CASE("scoring finds the threshold of the noise") {
  for (const double sigma : {0.01, 0.03, 0.1}) {
    random_source random(5);
    const positions stems = scenes::random_stems(random, 150, 40, 40);
    const position_set source = scenes::set_in_order(stems);
    const position_set target = scenes::set_in_order(scenes::noisy(stems, sigma, random));
    const matching_context maps(source, target, true, four);
    local_hypothesis h;
    const std::vector<double> fine = {0.02, 0.028, 0.04, 0.057, 0.08, 0.113, 0.16, 0.226, 0.32, 0.45};
    score_hypothesis(h, maps, null_model(maps), fine);
    CAPTURE(sigma);
    CHECK(h.inlier_threshold > 1.5 * sigma);
    CHECK(h.inlier_threshold < 6 * sigma);
    CHECK(h.log10_nfa < -50);
    CHECK(h.correspondences == maps.pair_stems(h.target_from_source, h.inlier_threshold));
    CHECK(h.rms < h.inlier_threshold);
  }
}

TEST_CASE("the mean displacement is that of the paired source stems, horizontally in 4-DoF") {
  random_source random(93);
  const position_set source = uneven_stems(12, random);
  const rigid a = some_transform(), b{rotation_about_z(0.83), {-39, 71, 9}};
  const std::vector<correspondence> pairs = {{1, 0}, {4, 7}, {11, 2}};
  for (const auto dof : {four, degrees_of_freedom::six}) {
    const matching_context maps(source, source, false, dof);
    double mean = 0;
    for (const stem_index s : {1u, 4u, 11u}) {
      const vec3 d = a * source.at[s] - b * source.at[s];
      mean += (dof == four ? d.xy().norm() : d.norm()) / 3;
    }
    CHECK(mean_displacement(a, b, pairs, maps) == Approx(mean));
    CHECK(mean_displacement(a, b, {}, maps) == 0);
  }
}

TEST_CASE("a hypothesis that is off in height, yaw and place is refitted to the stems that it nearly pairs") {
  random_source random(94);
  const position_set source = uneven_stems(120, random);
  position_set target = transformed_stems(some_transform(), source);
  for (vec3& p : target.at) p += 0.02 * vec3{random.normal(), random.normal(), random.normal()};
  const matching_context maps(source, target, false, four);
  local_hypothesis h = pairing_all(
      3, shifted_after(some_transform(), {0.08, -0.06, 7}) * rigid::turn_about(source.at[60], 0.002));
  h.inlier_threshold = 0.3;
  score_hypothesis(h, maps, null_model(maps), thresholds);
  CHECK(h.correspondences.size() > 110);
  CHECK(h.log10_nfa < -50);
  CHECK(scenes::max_error(h.target_from_source, scenes::transform_of_scene(some_transform()), source.at) <
        0.05);
  CHECK(h.rms == Approx(maps.rms(h.target_from_source, h.correspondences)));
}

TEST_CASE("the threshold is the one of the smallest NFA, and scoring it again changes nothing") {
  random_source random(95);
  const position_set source = uneven_stems(150, random);
  position_set target = transformed_stems(some_transform(), source);
  for (vec3& p : target.at) p += 0.03 * vec3{random.normal(), random.normal(), 0};
  const matching_context maps(source, target, false, four);
  const null_model null(maps, thresholds);
  local_hypothesis h = pairing_all(150, some_transform());
  score_hypothesis(h, maps, null, thresholds);
  const auto set = null.residuals_under(h.target_from_source, thresholds.back());
  for (const double threshold : thresholds)
    CHECK(null.log10_nfa(set, h.inlier_threshold) <= null.log10_nfa(set, threshold));
  local_hypothesis again = h;
  score_hypothesis(again, maps, null, thresholds);
  CHECK(again.inlier_threshold == h.inlier_threshold);
  CHECK(again.correspondences == h.correspondences);
  CHECK(again.log10_nfa == Approx(h.log10_nfa).epsilon(0.01));
}

TEST_CASE("a hypothesis that pairs nothing stays where it is, without evidence") {
  random_source random(96);
  const position_set source = uneven_stems(40, random);
  const position_set target = transformed_stems({mat3::identity(), {1e4, 0, 0}}, source);
  const matching_context maps(source, target, false, four);
  local_hypothesis h;
  score_hypothesis(h, maps, null_model(maps, thresholds), thresholds);
  CHECK(h.correspondences.empty());
  CHECK(h.target_from_source.translation == vec3{});
  CHECK(h.rms == 0);
  CHECK(h.log10_nfa >= 0);
}

}  // namespace globalmatch::test_score_hypothesis
