#include "globalmatch/detail/survey/survey_trees.hpp"

#include <numeric>
#include <set>

#include "catch.hpp"
#include "globalmatch/detail/survey/adjust_to_trees.hpp"
#include "made_up_surveys.hpp"

namespace globalmatch {

using namespace detail;

using scenes::maps_in_plan;
using scenes::positions;
using scenes::uniform;

namespace {

constexpr double radius = 0.3;  // [m]
const auto first_is_fixed = [](std::size_t m) { return m == 0; };

std::vector<std::uint32_t> all_of(std::size_t count) {
  std::vector<std::uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0u);
  return order;
}

/// Nine maps of a forest, their poses, and links of those that are neighbors.
struct scene {
  std::vector<plan_pose> truth;
  maps_in_plan seen;
  std::vector<survey_link> links;

  scene(double noise, random_source& random) : truth(scenes::grid_of_maps(3, random)) {
    const positions forest = scenes::forest_around_grid(3, 250, random);
    seen = scenes::see_from(truth, forest, 20, noise, random);
    links = scenes::links_within(25, truth, {0.01, 0.001}, random);
    for (survey_link& l : links) l.rms = 2 * std::max(noise, 0.02);
    scenes::pair_stems(links, seen);
  }

  std::vector<plan_pose> disturbed(double shift, random_source& random) const {
    auto poses = truth;
    for (std::size_t m = 1; m < poses.size(); ++m) {
      poses[m].shift += {uniform(random, -shift, shift), uniform(random, -shift, shift)};
      poses[m].yaw += uniform(random, -shift, shift) / 20;
    }
    return poses;
  }

  placed_maps placed_at(const std::vector<plan_pose>& poses) const {
    placed_maps placed;
    placed.poses = poses;
    placed.parts.of.assign(poses.size(), 0);
    placed.parts.reference = {0};
    return placed;
  }
};

/// Every stem is in one tree, and no tree has two of a map.
void check_partition(const tree_observations& trees, const std::vector<prepared_stems>& maps) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> seen;
  std::size_t stems = 0;
  for (const prepared_stems& m : maps) stems += m.stems.size();
  for (std::size_t t = 0; t < trees.size(); ++t) {
    std::set<std::uint32_t> of_tree;
    REQUIRE_FALSE(trees.of(t).empty());
    for (const stem_of_map& o : trees.of(t)) {
      CHECK(of_tree.insert(o.map).second);
      CHECK(seen.insert({o.map, o.stem}).second);
    }
  }
  CHECK(seen.size() == stems);
}

}  // namespace

TEST_CASE("every stem is in one tree, and a tree has one stem a map, however dense they stand") {
  random_source random(1);
  for (const std::size_t stems : {0u, 1u, 30u, 400u}) {
    std::vector<prepared_stems> maps(5);
    for (prepared_stems& m : maps) m.stems = scenes::set_in_order(scenes::random_stems(random, stems, 6, 6));
    const std::vector<plan_pose> poses(5);
    check_partition(find_trees(maps, all_of(5), poses, radius), maps);
  }
}

TEST_CASE("trees are found as brute force finds them: the nearest first, one to one") {
  random_source random(2);
  for (int repeat = 0; repeat < 5; ++repeat) {
    std::vector<prepared_stems> maps(2);
    for (prepared_stems& m : maps) m.stems = scenes::set_in_order(scenes::random_stems(random, 120, 8, 8));
    const auto &a = maps[0].stems.at, &b = maps[1].stems.at;
    std::vector<std::pair<double, std::pair<std::uint32_t, std::uint32_t>>> pairs;
    for (std::uint32_t i = 0; i < a.size(); ++i)
      for (std::uint32_t k = 0; k < b.size(); ++k)
        if (const double d = (a[i] - b[k]).xy().norm(); d < radius) pairs.push_back({d, {i, k}});
    std::sort(pairs.begin(), pairs.end());
    std::set<std::pair<std::uint32_t, std::uint32_t>> expected, found;
    std::set<std::uint32_t> taken_a, taken_b;
    for (const auto& [distance, pair] : pairs)
      if (!taken_a.count(pair.first) && !taken_b.count(pair.second))
        expected.insert(pair), taken_a.insert(pair.first), taken_b.insert(pair.second);
    const tree_observations trees = find_trees(maps, all_of(2), std::vector<plan_pose>(2), radius);
    for (std::size_t t = 0; t < trees.size(); ++t)
      if (trees.of(t).size() == 2) found.insert({trees.of(t)[0].stem, trees.of(t)[1].stem});
    CHECK(found == expected);
    CHECK(expected.size() > 20);
  }
}

TEST_CASE("trees without noise are those of the forest, and give the poses exactly") {
  random_source random(3);
  const scene s(0, random);
  const tree_observations trees = find_trees(s.seen.maps, all_of(9), s.truth, radius);
  check_partition(trees, s.seen.maps);
  std::set<std::size_t> forest;
  for (std::size_t t = 0; t < trees.size(); ++t) {
    std::set<std::size_t> of_tree;
    for (const stem_of_map& o : trees.of(t)) of_tree.insert(s.seen.trees[o.map][o.stem]);
    CHECK(of_tree.size() == 1);
    CHECK(forest.insert(*of_tree.begin()).second);
  }
  const unknown_poses unknowns(9, first_is_fixed);
  tree_adjustment adjustment(s.seen.maps, trees, s.links, unknowns, 0.02);
  auto poses = s.disturbed(0.1, random);
  REQUIRE(adjustment.adjust(poses));
  CHECK(scenes::max_pose_error(poses, s.truth) < 1e-6);
  CHECK(adjustment.covariances()[0] == mat3{});
}

TEST_CASE("stems that are off lose their weight, and displace no map") {
  random_source random(4);
  scene s(0.01, random);
  std::set<std::pair<std::uint32_t, std::uint32_t>> off;
  for (std::uint32_t m = 0; m < 9; ++m)
    for (std::uint32_t i = 0; i < s.seen.maps[m].stems.size(); ++i)
      if (random.uniform() < 0.1) {
        s.seen.maps[m].stems.at[i].x += 0.2;
        off.insert({m, i});
      }
  const tree_observations trees = find_trees(s.seen.maps, all_of(9), s.truth, radius);
  const unknown_poses unknowns(9, first_is_fixed);
  tree_adjustment adjustment(s.seen.maps, trees, s.links, unknowns, 0.02);
  auto poses = s.disturbed(0.02, random);
  REQUIRE(adjustment.adjust(poses));
  CHECK(scenes::max_pose_error(poses, s.truth) < 0.03);
  CHECK(adjustment.sigma() == Approx(0.01).epsilon(0.25));
  double weight_of_off = 0;
  for (std::size_t t = 0; t < trees.size(); ++t)
    for (std::size_t i = trees.first[t]; i < trees.first[t + 1]; ++i)
      if (trees.of(t).size() > 2 && off.count({trees.stems[i].map, trees.stems[i].stem}))
        weight_of_off = std::max(weight_of_off, adjustment.weights()[i]);
  CHECK(weight_of_off < 0.5);
}

TEST_CASE("a map that is too far off for any tree is held by its links, as well as these know it") {
  random_source random(5);
  const scene s(0.01, random);
  auto poses = s.disturbed(0.01, random);
  poses[4].shift += {0.45, 0};
  const adjusted_survey adjusted = adjust_to_trees(s.seen.maps, s.placed_at(poses), s.links, {all_of(9)});
  CHECK(scenes::max_pose_error(adjusted.poses, s.truth) < 0.1);
  CHECK(adjusted.weights.size() == adjusted.trees.stems.size());

  auto links = s.links;  // which say where it is, and are wrong by as much
  for (survey_link& l : links)
    if (l.source == 4 || l.target == 4) {
      const plan_pose there = s.truth[l.source == 4 ? l.target : l.source].inverse();
      plan_pose off = s.truth[4];
      off.shift += {0.45, 0};
      const plan_pose placed = there * off;
      const vec2 in_source = l.center_in_source();
      l.target_from_source = l.source == 4 ? placed : placed.inverse();
      l.center = l.target_from_source * in_source;
    }
  const adjusted_survey held = adjust_to_trees(s.seen.maps, s.placed_at(poses), links, {all_of(9)});
  REQUIRE(held.weights.size() == held.trees.stems.size());
  for (std::size_t m = 0; m < 9; ++m) {
    const double error = (held.poses[m].shift - s.truth[m].shift).norm();
    CHECK(error < (m == 4 ? 0.6 : 0.05));
    if (m > 0) CHECK(held.covariance[m](0, 0) > 0);
  }
  CHECK(held.covariance[4](0, 0) > 2 * held.covariance[3](0, 0));
}

TEST_CASE("covariances are calibrated also where two maps share few trees") {
  double squares = 0;
  constexpr int surveys = 300;
  for (int survey = 0; survey < surveys; ++survey) {
    random_source random(std::uint64_t(100 + survey));
    const std::vector<plan_pose> truth = {{{0, 0}, 0}, {{4, 3}, scenes::any_yaw(random)}};
    const positions forest = scenes::forest_around_grid(1, 12, random);
    const maps_in_plan seen = scenes::see_from(truth, forest, 100, 0.03, random);
    const tree_observations trees = find_trees(seen.maps, all_of(2), truth, radius);
    const unknown_poses unknowns(2, first_is_fixed);
    tree_adjustment adjustment(seen.maps, trees, {}, unknowns, 0.03);
    auto poses = truth;
    REQUIRE(adjustment.adjust(poses));
    const mat3 covariance = adjustment.covariances()[1];
    const vec3 error = {poses[1].shift.x - truth[1].shift.x, poses[1].shift.y - truth[1].shift.y,
                        wrapped(poses[1].yaw - truth[1].yaw)};
    squares += error.dot(covariance.inverse() * error) / 3;
  }
  CHECK(std::sqrt(squares / surveys) > 0.8);
  CHECK(std::sqrt(squares / surveys) < 1.4);  // as of Student's t
}

TEST_CASE("maps that stand alone have no trees, and their poses stay") {
  random_source random(6);
  const scene s(0.01, random);
  placed_maps placed = s.placed_at(std::vector<plan_pose>(9));
  placed.parts.reference = all_of(9);
  placed.parts.of = all_of(9);
  std::vector<std::vector<std::uint32_t>> members;
  for (const std::uint32_t m : all_of(9)) members.push_back({m});
  const adjusted_survey adjusted = adjust_to_trees(s.seen.maps, placed, {}, members);
  CHECK(adjusted.trees.size() == 0);
  for (const plan_pose& p : adjusted.poses) CHECK(p.shift == vec2{0, 0});
}

}  // namespace globalmatch
