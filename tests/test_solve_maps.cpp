#include "globalmatch/detail/verbs/solve_maps.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "catch.hpp"
#include "made_up_surveys.hpp"

namespace globalmatch::test_solve_maps {

using namespace detail;

using namespace scenes;

TEST_CASE("the NFA of a link is divided by the pairs of maps") {
  survey_options options;
  options.max_nfa = 1e-3;
  CHECK(max_log10_nfa_of_survey(options, 2) == Approx(-3));
  CHECK(max_log10_nfa_of_survey(options, 5) == Approx(-4));
  CHECK(max_log10_nfa_of_survey(options, 1) == Approx(-3));
}

TEST_CASE("links solved place all maps of a grid, and one of many wrong links places none elsewhere") {
  random_source random(2);
  const surveyed_grid grid(3, 0.02, random);
  std::vector<survey_link> links = links_within(35, grid.truth, {0.02, 0.001}, random);
  pair_stems(links, grid.seen);
  make_wrong(links[3], random);
  const local_survey s = solve_links(grid.maps, std::vector<survey_link>(links), {}, {}, -4.5);
  REQUIRE(s.members.size() == 1);
  CHECK_FALSE(s.links[3].used);
  const std::uint32_t reference = s.placed.parts.reference[0];
  for (std::size_t m = 0; m < 9; ++m) {
    const plan_pose expected = grid.truth[reference].inverse() * grid.truth[m];
    CHECK((s.adjusted.poses[m].shift - expected.shift).norm() < 0.05);
  }
}

TEST_CASE("a map that several places claim is placed by the trees, and no other map moves") {
  random_source random(4);
  const surveyed_grid grid(3, 0.02, random);
  constexpr std::uint32_t middle = 4;
  std::vector<survey_link> links = links_within(35, grid.truth, {0.02, 0.001}, random);
  pair_stems(links, grid.seen);
  std::size_t right = 0;
  for (survey_link& l : links)
    if ((l.source == middle || l.target == middle) && ++right > 1) make_wrong(l, random);
  const local_survey by_links = solve_used_links(grid.maps, std::vector<survey_link>(links), {}, {}),
                     by_trees = solve_links(grid.maps, std::vector<survey_link>(links), {}, {}, -4.5);
  CHECK(by_links.members.size() == 2);
  CHECK(by_trees.members.size() == 1);
  const std::uint32_t reference = by_trees.placed.parts.reference[0];
  for (std::size_t m = 0; m < 9; ++m) {
    const plan_pose expected = grid.truth[reference].inverse() * grid.truth[m];
    CHECK((by_trees.adjusted.poses[m].shift - expected.shift).norm() < 0.05);
  }
}

TEST_CASE("surveys do not fall apart by three wrong links of ten, and no map is placed wrongly") {
  constexpr std::size_t surveys = 10, maps = 16;
  std::size_t placed = 0;
  for (std::uint64_t seed = 0; seed < surveys; ++seed) {
    CAPTURE(seed);
    random_source random(seed);
    const surveyed_grid grid(4, 0.02, random);
    std::vector<survey_link> links = links_within(35, grid.truth, {0.02, 0.001}, random);
    pair_stems(links, grid.seen);
    for (survey_link& l : links)
      if (random.uniform() < 0.3) {
        make_wrong(l, random);
        for (correspondence& c : l.correspondences)
          c.source = random.below(stem_index(grid.maps[l.source].stems.size()));
      }
    use_supported_links(links, grid.maps.size(), -4.5);
    const local_survey s = solve_links(grid.maps, std::move(links), {}, {}, -4.5);
    for (const auto& of : s.members) {
      if (of.size() > maps / 2) placed += of.size();
      for (const std::uint32_t m : of) {
        const plan_pose expected = grid.truth[of[0]].inverse() * grid.truth[m];
        CHECK((s.adjusted.poses[m].shift - expected.shift).norm() < 0.05);
      }
    }
  }
  CHECK(double(placed) >= 0.97 * double(surveys * maps));
}

TEST_CASE("a map is turned upright by as much as it leans, and forgets heights that slope") {
  random_source random(3);
  const surveyed_grid grid(1, 0, random);
  prepared_stems map = grid.maps[0];
  CHECK_FALSE(level_map(map, {0, 0}, false, {}));
  CHECK(level_map(map, {0, 0}, true, {}));
  CHECK_FALSE(map.stems.has_heights);
  CHECK_FALSE(level_map(map, {0, 0}, true, {}));

  prepared_stems leaning = grid.maps[0];
  CHECK(level_map(leaning, {0.03, 0}, false, {}));
  const mat3 upright = rotation_about({1, 0, 0}, 0.03);
  REQUIRE(leaning.stems.size() == grid.maps[0].stems.size());
  for (std::size_t i = 0; i < leaning.stems.size(); ++i)
    CHECK((leaning.stems.at[i] - upright * grid.maps[0].stems.at[i]).norm() < 1e-9);
}

}  // namespace globalmatch::test_solve_maps
