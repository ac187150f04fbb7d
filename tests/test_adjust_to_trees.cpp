#include "globalmatch/detail/survey/adjust_to_trees.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include "catch.hpp"
#include "made_up_surveys.hpp"

namespace globalmatch::test_adjust_to_trees {

using namespace detail;

using namespace scenes;

TEST_CASE("a map that is too far off for any tree is held by its links, as well as these know it") {
  random_source random(5);
  const nine_maps s(0.01, random);
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
  CHECK(held.covariance[4](0, 0) > 1.5 * held.covariance[3](0, 0));
}

TEST_CASE("maps that stand alone have no trees, and their poses stay") {
  random_source random(6);
  const nine_maps s(0.01, random);
  placed_maps placed = s.placed_at(std::vector<plan_pose>(9));
  placed.parts.reference = all_of(9);
  placed.parts.of = all_of(9);
  std::vector<std::vector<std::uint32_t>> members;
  for (const std::uint32_t m : all_of(9)) members.push_back({m});
  const adjusted_survey adjusted = adjust_to_trees(s.seen.maps, placed, {}, members);
  CHECK(adjusted.trees.size() == 0);
  for (const plan_pose& p : adjusted.poses) CHECK(p.shift == vec2{0, 0});
}

}  // namespace globalmatch::test_adjust_to_trees
