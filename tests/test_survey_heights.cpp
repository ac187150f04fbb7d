#include "globalmatch/detail/survey/survey_heights.hpp"

#include <numeric>

#include "catch.hpp"
#include "made_up_surveys.hpp"

namespace globalmatch::test_survey_heights {

using namespace detail;

using scenes::maps_in_plan;
using scenes::positions;

namespace {

/// Maps of a forest, linked to their neighbors, with the trees that they have in common.
struct scene {
  std::vector<plan_pose> poses;
  maps_in_plan seen;
  std::vector<survey_link> links;
  std::vector<std::uint32_t> order;
  tree_observations trees;

  scene(std::size_t side, double noise, random_source& random)
      : poses(scenes::grid_of_maps(side, random)), order(side * side) {
    const positions forest = scenes::forest_around_grid(side, 30 * side * side, random);
    seen = scenes::see_from(poses, forest, 20, noise, random);
    links = scenes::links_within(25, poses, {}, random);
    scenes::pair_stems(links, seen);
    std::iota(order.begin(), order.end(), 0u);
    trees = find_trees(seen.maps, order, poses, std::vector<double>(poses.size(), 0.4));
  }

  survey_heights find(const target_observations& targets = {}) const {
    const link_graph graph(seen.maps.size(), links, [](const survey_link& l) { return l.used; });
    return find_heights(seen.maps, trees, graph, {order}, {}, targets);
  }

  /// A target that some maps show, at a height [m] of the survey.
  void add_target(target_observations& targets, double height, const std::vector<std::uint32_t>& maps,
                  double noise, random_source& random) const {
    for (const std::uint32_t m : maps) {
      const double z = height - seen.heights[m] + noise * random.normal();
      targets.seen.push_back({m, {0, 0, z}, std::max(1e-3, noise), std::uint32_t(targets.seen.size())});
    }
    targets.first.push_back(targets.seen.size());
  }
};

}  // namespace

TEST_CASE("heights without noise are exact") {
  random_source random(1);
  const scene s(3, 0, random);
  const survey_heights heights = s.find();
  for (std::size_t m = 0; m < 9; ++m) {
    CHECK(heights.known[m]);
    CHECK(heights.of_map[m] == Approx(s.seen.heights[m]).margin(1e-9));
    CHECK(heights.sigma[m] < 0.001);
  }
  CHECK(heights.sigma[0] == 0);
}

TEST_CASE("the sigmas of heights are calibrated") {
  double squares = 0;
  constexpr int surveys = 200;  // in each of which errors are much alike: those of the datum's stems
  for (int survey = 0; survey < surveys; ++survey) {
    random_source random(std::uint64_t(100 + survey));
    const scene s(2, 0.05, random);
    const survey_heights heights = s.find();
    for (std::size_t m = 1; m < 4; ++m)
      squares += std::pow((heights.of_map[m] - s.seen.heights[m]) / heights.sigma[m], 2);
  }
  const double normalised = std::sqrt(squares / (3 * surveys));
  CHECK(normalised > 0.8);
  CHECK(normalised < 1.25);
}

TEST_CASE("stems of wrong heights displace no map") {
  random_source random(6);
  scene s(3, 0.02, random);
  for (prepared_stems& m : s.seen.maps)
    for (vec3& p : m.stems.at)
      if (random.uniform() < 0.15) p.z += scenes::uniform(random, 0.5, 3);
  const survey_heights heights = s.find();
  for (std::size_t m = 0; m < 9; ++m) {
    CHECK(heights.known[m]);
    CHECK(std::abs(heights.of_map[m] - s.seen.heights[m]) < 0.03);
  }
}

TEST_CASE("maps without heights have none, and the others keep theirs, be it the reference") {
  for (const std::uint32_t without : {4u, 0u}) {
    random_source random(7);
    scene s(3, 0.02, random);
    s.seen.maps[without].stems.has_heights = false;
    for (vec3& p : s.seen.maps[without].stems.at) p.z = 0;
    const survey_heights heights = s.find();
    const std::uint32_t datum = without == 0 ? 1 : 0;
    CHECK(heights.sigma[datum] == 0);
    for (std::size_t m = 0; m < 9; ++m) {
      CHECK(bool(heights.known[m]) == (m != without));
      if (m != without)
        CHECK(heights.of_map[m] == Approx(s.seen.heights[m] - s.seen.heights[datum]).margin(0.03));
    }
    for (std::size_t i = 0; i < s.trees.stems.size(); ++i)
      if (s.trees.stems[i].map == without) CHECK(heights.weights[i] == 0);
  }
}

TEST_CASE("targets give heights also where maps show no ground") {
  random_source random(10);
  scene s(3, 0.02, random);
  for (const std::size_t m : {4u, 5u, 8u}) {
    s.seen.maps[m].stems.has_heights = false;
    for (vec3& p : s.seen.maps[m].stems.at) p.z = 0;
  }
  target_observations targets;
  s.add_target(targets, 2, {1, 4}, 0.002, random);
  s.add_target(targets, 3, {4, 5, 7}, 0.002, random);
  const survey_heights heights = s.find(targets);
  for (std::size_t m = 0; m < 9; ++m) {
    CHECK(bool(heights.known[m]) == (m != 8));  // which shows no target
    if (m != 8) CHECK(heights.of_map[m] == Approx(s.seen.heights[m]).margin(0.02));
  }
  CHECK(heights.sigma[4] > heights.sigma[1]);
  REQUIRE(heights.target_weights.size() == 5);
  for (const double w : heights.target_weights) CHECK(w > 0.3);
  for (std::size_t i = 0; i < s.trees.stems.size(); ++i)
    if (s.trees.stems[i].map == 4) CHECK(heights.weights[i] == 0);
}

TEST_CASE("heights by targets alone are those of dense least squares") {
  random_source random(11);
  scene s(2, 0, random);
  for (prepared_stems& m : s.seen.maps) m.stems.has_heights = false;
  target_observations targets;
  for (const double height : {0.0, 1.0, 2.0, 5.0}) s.add_target(targets, height, {0, 1, 2, 3}, 0.003, random);
  const survey_heights heights = s.find(targets);
  for (std::uint32_t m = 1; m < 4; ++m) {  // of one weight, so that means of differences are the answer
    double mean = 0;
    for (std::size_t t = 0; t < 4; ++t) mean += (targets.of(t)[0].at.z - targets.of(t)[m].at.z) / 4;
    CHECK(heights.known[m]);
    CHECK(heights.of_map[m] == Approx(mean).margin(0.002));
    CHECK(heights.sigma[m] == Approx(0.003 * std::sqrt(2.0 / 4)).epsilon(0.3));
  }
}

TEST_CASE("a target at a wrong height loses its weight, and displaces no map") {
  random_source random(12);
  const scene s(3, 0.02, random);
  target_observations targets;
  for (const double height : {1.0, 2.0, 3.0}) s.add_target(targets, height, {0, 1, 3, 4}, 0.002, random);
  targets.seen[5].at.z += 0.35;
  const survey_heights heights = s.find(targets);
  for (const std::size_t m : {1u, 3u, 4u}) {
    CHECK(heights.of_map[m] == Approx(s.seen.heights[m]).margin(0.006));
    CHECK(heights.sigma[m] < 0.003);
  }
  for (std::size_t i = 0; i < 12; ++i) CHECK((heights.target_weights[i] == 0) == (i == 5));
}

TEST_CASE("where a map has no tree in common its height is unknown, and that of the others is not") {
  random_source random(8);
  scene s(3, 0.02, random);
  auto poses = s.poses;
  poses[5].shift.x += 500;
  s.trees = find_trees(s.seen.maps, s.order, poses, std::vector<double>(poses.size(), 0.4));
  const survey_heights heights = s.find();
  for (std::size_t m = 0; m < 9; ++m) {
    CHECK(bool(heights.known[m]) == (m != 5));
    CHECK(heights.of_map[m] == Approx(s.seen.heights[m]).margin(0.06));  // else that of links: a guess
  }
}

TEST_CASE("maps that stand alone need no heights") {
  const std::vector<prepared_stems> maps(3);
  const link_graph graph(3, {}, [](const survey_link&) { return true; });
  const survey_heights heights = find_heights(maps, {}, graph, {{0}, {1}, {2}});
  CHECK(heights.of_map == std::vector<double>(3, 0));
}

}  // namespace globalmatch::test_survey_heights
