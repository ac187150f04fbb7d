#include "globalmatch/detail/survey/refined_adjustment.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "catch.hpp"
#include "made_up_surveys.hpp"

namespace globalmatch::test_refined_adjustment {

using namespace detail;

namespace {

constexpr scenes::link_noise noise = {0.005, 0.0005};

/// Nine maps whose frames have the axes of the survey, trees that they see, and pairs between neighbors.
struct scene {
  std::vector<plan_pose> truth;
  seen_trees trees;
  std::vector<survey_link> pairs;
  unknown_poses unknowns{9, [](std::size_t m) { return m == 0; }};

  explicit scene(random_source& random) {
    for (std::size_t m = 0; m < 9; ++m) truth.push_back({{22.0 * double(m % 3), 22.0 * double(m / 3)}, 0});
    pairs = scenes::links_within(35, truth, noise, random);
    for (int t = 0; t < 60; ++t) {
      const vec2 place = {scenes::uniform(random, -10, 54), scenes::uniform(random, -10, 54)};
      std::vector<stem_of_map> seen;
      for (std::uint32_t m = 0; m < 9; ++m)
        if ((truth[m].shift - place).norm() < 25) seen.push_back({m, stem_index(t)});
      if (seen.size() < 2) continue;
      trees.observations.stems.insert(trees.observations.stems.end(), seen.begin(), seen.end());
      trees.observations.first.push_back(trees.observations.stems.size());
      trees.places.push_back(place);
    }
  }

  std::vector<plan_pose> adjusted(const std::vector<plan_pose>& start, double stem_sigma) {
    refined_plan_adjustment adjustment(start, trees, stem_sigma, pairs, unknowns);
    auto poses = start;
    REQUIRE(adjustment.adjust(poses));
    return poses;
  }
};

}  // namespace

TEST_CASE("poses follow refined pairs, and covariances are calibrated, where trees say little") {
  constexpr int surveys = 100;
  double shift = 0, yaw = 0;
  for (int survey = 0; survey < surveys; ++survey) {
    random_source random(std::uint64_t(survey + 1));
    scene s(random);
    auto start = s.truth;
    for (std::size_t m = 1; m < 9; ++m) start[m].shift += {0.02, -0.01};
    refined_plan_adjustment adjustment(start, s.trees, 100, s.pairs, s.unknowns);
    auto poses = start;
    REQUIRE(adjustment.adjust(poses));
    const auto covariances = adjustment.covariances();
    for (std::size_t m = 1; m < 9; ++m) {
      const vec2 off = poses[m].shift - s.truth[m].shift;
      CHECK(off.norm() < 0.06);
      shift += off.x * off.x / covariances[m - 1](0, 0) + off.y * off.y / covariances[m - 1](1, 1);
      yaw += poses[m].yaw * poses[m].yaw / covariances[m - 1](2, 2);
    }
  }
  CHECK(std::sqrt(shift / (16 * surveys)) == Approx(1).margin(0.25));
  CHECK(std::sqrt(yaw / (8 * surveys)) == Approx(1).margin(0.25));
}

TEST_CASE("poses stay at the start where the trees are precise") {
  random_source random(3);
  scene s(random);
  const auto poses = s.adjusted(s.truth, 1e-5);
  CHECK(scenes::max_pose_error(poses, s.truth) < 1e-4);
  CHECK(scenes::max_pose_error(s.adjusted(s.truth, 0.1), s.truth) > 1e-4);
}

TEST_CASE("a target counts as the stems whose precision it has") {
  constexpr double stem_sigma = 0.02, pair_sigma = 0.01, offset = 1e-4;  // [m]
  const std::vector<plan_pose> start(2);
  const unknown_poses unknowns(2, [](std::size_t m) { return m == 0; });
  seen_trees landmarks;
  for (const vec2& place : {vec2{10, 0}, vec2{-10, 0}}) {
    for (const std::uint32_t m : {0u, 1u}) landmarks.observations.stems.push_back({m, 0});
    landmarks.observations.first.push_back(landmarks.observations.stems.size());
    landmarks.places.push_back(place);
  }
  survey_link pair;
  pair.source = 1;
  pair.target = 0;
  pair.target_from_source.shift = pair.center = {offset, 0};
  pair.covariance = mat3::diagonal_of({pair_sigma * pair_sigma, pair_sigma * pair_sigma, 1e-4});
  for (const double weight : {0.0, 1.0, 4.0, 100.0}) {
    landmarks.weights = {weight, weight, 1, 1};
    const std::vector<survey_link> pairs = {pair};
    refined_plan_adjustment adjustment(start, landmarks, stem_sigma, pairs, unknowns);
    auto poses = start;
    REQUIRE(adjustment.adjust(poses));
    const double of_landmarks = (weight + 1) / 2 / (stem_sigma * stem_sigma),
                 of_pair = 1 / (pair_sigma * pair_sigma);
    CHECK(poses[1].shift.x == Approx(offset * of_pair / (of_pair + of_landmarks)).epsilon(1e-3));
    CHECK(adjustment.covariances()[0](0, 0) == Approx(1 / (of_pair + of_landmarks)).epsilon(1e-3));
  }
}

TEST_CASE("pairs that disagree with others lose their weight, however far the start is off") {
  random_source random(4);
  scene s(random);
  auto start = s.truth;
  start[4].shift += {0.1, 0.1};  // which all pairs of the map contradict
  const auto good = s.adjusted(start, 100);
  CHECK(scenes::max_pose_error(good, s.truth) < 0.03);
  for (const std::size_t wrong : {1u, 7u, 12u}) {
    s.pairs[wrong].target_from_source.shift += {0.3, -0.2};
    s.pairs[wrong].target_from_source.yaw += 0.02;
  }
  CHECK(scenes::max_pose_error(s.adjusted(start, 100), s.truth) < 0.03);
}

TEST_CASE("maps that nothing determines are not adjusted") {
  random_source random(5);
  scene s(random);
  s.trees = {};
  std::erase_if(s.pairs, [](const survey_link& p) { return p.source == 8 || p.target == 8; });
  refined_plan_adjustment adjustment(s.truth, s.trees, 0.01, s.pairs, s.unknowns);
  auto poses = s.truth;
  CHECK_FALSE(adjustment.adjust(poses));
}

TEST_CASE("heights follow differences between maps, but wrong ones, with calibrated variances") {
  constexpr int surveys = 100;
  constexpr double sigma = 0.002;
  double squares = 0;
  for (int survey = 0; survey < surveys; ++survey) {
    random_source random(std::uint64_t(survey + 1));
    std::vector<double> truth(9);
    for (std::size_t m = 1; m < 9; ++m) truth[m] = scenes::uniform(random, -0.5, 0.5);
    std::vector<measured_difference> differences;
    for (std::uint32_t a = 0; a < 9; ++a)
      for (std::uint32_t b = a + 1; b < std::min(a + 5, 9u); ++b)
        differences.push_back({a, b, truth[a] - truth[b] + sigma * random.normal(), sigma * sigma});
    for (const std::size_t wrong : {3u, 11u}) differences[wrong].change += 0.4;
    const unknown_poses unknowns(9, [](std::size_t m) { return m == 0; });
    std::vector<double> heights(9, 0);
    const auto variances = adjust_differences(differences, unknowns, heights);
    REQUIRE(variances.size() == 8);
    CHECK(heights[0] == 0);
    for (std::size_t m = 1; m < 9; ++m) {
      CHECK(std::abs(heights[m] - truth[m]) < 0.01);
      squares += std::pow(heights[m] - truth[m], 2) / variances[m - 1];
    }
  }
  CHECK(std::sqrt(squares / (8 * surveys)) == Approx(1).margin(0.25));
}

TEST_CASE("weights are 1 for what agrees and next to 0 for what does not, in the end") {
  graduated_weights weights(1.386, true);
  const std::vector<double> squares = {1, 2, 0.5, 1.5, 1e6, 1};
  weights.update(squares);
  CHECK(weights.factor(4) > 0.5 * weights.factor(0));
  CHECK_FALSE(weights.is_last());
  for (int i = 0; i < 20; ++i) weights.update(squares);
  CHECK(weights.is_last());
  CHECK(weights.factor(4) < 1e-5);
  CHECK(weights.factor(2) > 0.9 / (weights.sigma() * weights.sigma()));
}

}  // namespace globalmatch::test_refined_adjustment
