#include "globalmatch/detail/survey/guess_places.hpp"

#include <vector>

#include "catch.hpp"
#include "made_up_surveys.hpp"

namespace globalmatch::test_guess_places {

using namespace detail;

TEST_CASE("guesses are one a place, first that of most links, then the more significant ones") {
  random_source random(1);
  const auto truth = scenes::grid_of_maps(3, random);
  auto links = scenes::links_within(35, truth, {}, random);
  std::vector<std::uint32_t> of_middle;
  for (std::uint32_t l = 0; l < links.size(); ++l)
    if (links[l].source == 4 || links[l].target == 4) of_middle.push_back(l);
  REQUIRE(of_middle.size() == 8);
  const auto displace = [&](std::uint32_t l, double shift) {  // where the link places map 4 in its neighbor
    plan_pose& pose = links[l].target_from_source;
    plan_pose placed = links[l].source == 4 ? pose : pose.inverse();
    placed.shift += {shift, 0};
    const vec2 in_source = links[l].center_in_source();
    pose = links[l].source == 4 ? placed : placed.inverse();
    links[l].center = pose * in_source;
  };
  displace(of_middle[0], 20);
  displace(of_middle[1], -30);
  links[of_middle[0]].log10_nfa = -5;
  links[of_middle[1]].log10_nfa = -9;
  const link_graph graph(truth.size(), links, [](const survey_link&) { return true; });
  const auto all = [](const link_graph::edge&) { return true; };
  const auto guesses = guess_places(4, graph, truth, all);
  REQUIRE(guesses.size() == 3);
  const plan_pose best = truth[guesses[0].neighbor] * graph.neighbor_from(4, guesses[0]);
  CHECK((best.shift - truth[4].shift).norm() < 1e-9);
  CHECK(guesses[1].link == of_middle[1]);
  CHECK(guesses[2].link == of_middle[0]);
  CHECK(guess_places(4, graph, truth, [](const link_graph::edge&) { return false; }).empty());
}

}  // namespace globalmatch::test_guess_places
