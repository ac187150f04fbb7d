#include "globalmatch/detail/survey/tree_adjustment.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include "catch.hpp"
#include "made_up_surveys.hpp"

namespace globalmatch {

using namespace detail;

using namespace scenes;

namespace {
const auto first_is_fixed = [](std::size_t m) { return m == 0; };
}  // namespace

TEST_CASE("trees without noise give the poses exactly") {
  random_source random(3);
  const nine_maps s(0, random);
  const tree_observations trees = find_trees(s.seen.maps, all_of(9), s.truth, tree_radii(9));
  const unknown_poses unknowns(9, first_is_fixed);
  tree_adjustment adjustment(s.seen.maps, trees, s.links, unknowns, std::vector<double>(9, 0.02));
  auto poses = s.disturbed(0.1, random);
  REQUIRE(adjustment.adjust(poses));
  CHECK(scenes::max_pose_error(poses, s.truth) < 1e-6);
  CHECK(adjustment.covariances()[0] == mat3{});
}

TEST_CASE("stems that are off lose their weight, and displace no map") {
  random_source random(4);
  nine_maps s(0.01, random);
  std::set<std::pair<std::uint32_t, std::uint32_t>> off;
  for (std::uint32_t m = 0; m < 9; ++m)
    for (std::uint32_t i = 0; i < s.seen.maps[m].stems.size(); ++i)
      if (random.uniform() < 0.1) {
        s.seen.maps[m].stems.at[i].x += 0.2;
        off.insert({m, i});
      }
  const tree_observations trees = find_trees(s.seen.maps, all_of(9), s.truth, tree_radii(9));
  const unknown_poses unknowns(9, first_is_fixed);
  tree_adjustment adjustment(s.seen.maps, trees, s.links, unknowns, std::vector<double>(9, 0.02));
  auto poses = s.disturbed(0.02, random);
  REQUIRE(adjustment.adjust(poses));
  CHECK(scenes::max_pose_error(poses, s.truth) < 0.03);
  const std::vector<double> weights = adjustment.weights();
  double weight_of_off = 0;
  std::size_t outvoted = 0;
  for (std::size_t t = 0; t < trees.size(); ++t) {
    const auto is_off = [&](const stem_of_map& o) { return off.count({o.map, o.stem}) > 0; };
    const auto seen = trees.of(t);
    if (2 * std::size_t(std::count_if(seen.begin(), seen.end(), is_off)) >= seen.size()) continue;
    for (std::size_t i = trees.first[t]; i < trees.first[t + 1]; ++i)
      if (is_off(trees.stems[i])) weight_of_off = std::max(weight_of_off, weights[i]), ++outvoted;
  }
  CHECK(outvoted > 4);
  CHECK(weight_of_off < 0.5);
}

TEST_CASE("covariances are calibrated also where two maps share few trees") {
  double squares = 0;
  constexpr int surveys = 300;
  for (int survey = 0; survey < surveys; ++survey) {
    random_source random(std::uint64_t(100 + survey));
    const std::vector<plan_pose> truth = {{{0, 0}, 0}, {{4, 3}, scenes::any_yaw(random)}};
    const positions forest = scenes::forest_around_grid(1, 12, random);
    const maps_in_plan seen = scenes::see_from(truth, forest, 100, 0.03, random);
    const tree_observations trees = find_trees(seen.maps, all_of(2), truth, tree_radii(2));
    const unknown_poses unknowns(2, first_is_fixed);
    tree_adjustment adjustment(seen.maps, trees, {}, unknowns, std::vector<double>(2, 0.03));
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

}  // namespace globalmatch
