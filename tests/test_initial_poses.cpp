#include "globalmatch/detail/survey/initial_poses.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include "catch.hpp"
#include "made_up_surveys.hpp"

namespace globalmatch::test_initial_poses {

using namespace detail;

using namespace scenes;

namespace {
constexpr double sufficient = -10;
constexpr std::size_t none = ~std::size_t(0);
}  // namespace

TEST_CASE("initial poses follow from links without noise") {
  random_source random(6);
  const auto truth = grid_of_maps(6, random);
  auto links = links_within(35, truth, {}, random);
  use_supported_links(links, truth.size(), sufficient);
  const link_graph graph(truth.size(), links, [](const survey_link&) { return true; });
  CHECK(max_pose_error(initial_poses(links, find_components(graph, 0)), truth) < 1e-9);
  std::erase_if(links, [](const survey_link& l) { return l.target != l.source + 1; });  // six rows, no cycle
  for (survey_link& l : links) l.supporting_cycles = 0;
  const link_graph rows(truth.size(), links, [](const survey_link&) { return true; });
  const components parts = find_components(rows, none);
  CHECK(parts.count() == 6);
  const auto poses = initial_poses(links, parts);
  for (std::size_t m = 0; m < truth.size(); ++m) {
    const plan_pose expected = truth[parts.reference[parts.of[m]]].inverse() * truth[m];
    CHECK((poses[m].shift - expected.shift).norm() < 1e-9);
    CHECK(std::abs(wrapped(poses[m].yaw - expected.yaw)) < 1e-9);
  }
}

}  // namespace globalmatch::test_initial_poses
