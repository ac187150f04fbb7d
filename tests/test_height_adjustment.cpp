#include "globalmatch/detail/survey/height_adjustment.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/survey/adjust_links.hpp"
#include "made_up_surveys.hpp"

namespace globalmatch::test_height_adjustment {

using namespace detail;

namespace {

/// Maps that all show the same trees, at heights that differ by the height of each map.
struct maps_of_trees {
  std::vector<double> truth = {0, 1.5, -2.25, 0.75};  // [m] by which each is raised
  std::vector<prepared_stems> maps{4};
  tree_observations trees;
  survey_heights heights;
  unknown_poses unknowns{4, [](std::size_t m) { return m == 0; }};

  explicit maps_of_trees(std::size_t count) {
    for (std::uint32_t t = 0; t < count; ++t) {
      const double height = 0.3 * t * t;
      for (std::uint32_t m = 0; m < 4; ++m) {
        maps[m].stems.at.push_back({double(t), double(m), height - truth[m]});
        trees.stems.push_back({m, stem_index(t)});
      }
      trees.first.push_back(trees.stems.size());
    }
    heights.of_map.assign(4, 0);
    heights.sigma.assign(4, 0);
    heights.known.assign(4, true);
  }
  bool adjust(const target_observations& targets = {}) {
    return height_adjustment(maps, trees, targets, unknowns, heights).adjust(20);
  }
};

}  // namespace

TEST_CASE("heights of maps of the same trees are those that make these coincide, and fixed ones stay") {
  maps_of_trees s(6);
  REQUIRE(s.adjust());
  for (std::size_t m = 0; m < 4; ++m) CHECK(s.heights.of_map[m] == Approx(s.truth[m]).margin(1e-9));
  CHECK(s.heights.weights == std::vector<double>(24, 1));
  CHECK(s.heights.sigma[0] == 0);
  for (std::size_t m = 1; m < 4; ++m) CHECK(s.heights.sigma[m] > 0);
}

TEST_CASE("a stem at a wrong height loses its weight in the adjustment, and moves no map") {
  maps_of_trees s(6);
  s.maps[2].stems.at[3].z += 1;
  REQUIRE(s.adjust());
  for (std::size_t m = 0; m < 4; ++m) CHECK(s.heights.of_map[m] == Approx(s.truth[m]).margin(1e-6));
  for (std::size_t i = 0; i < s.heights.weights.size(); ++i)
    CHECK((s.heights.weights[i] == 0) == (i == 3 * 4 + 2));
}

TEST_CASE("a map without trees in common has no height, and the adjustment says so") {
  maps_of_trees s(6);
  tree_observations of_three;
  for (const stem_of_map& o : s.trees.stems) {
    if (o.map != 3) of_three.stems.push_back(o);
    if (o.map == 3) of_three.first.push_back(of_three.stems.size());
  }
  s.trees = of_three;
  CHECK_FALSE(s.adjust());
  CHECK(s.heights.known == std::vector<std::uint8_t>{1, 1, 1, 0});
}

TEST_CASE("targets alone give heights, weighted by their standard deviations") {
  maps_of_trees s(0);
  target_observations targets;
  const auto add = [&](std::uint32_t map, double height, double sigma) {
    targets.seen.push_back({map, {0, 0, height - s.truth[map]}, sigma, std::uint32_t(targets.seen.size())});
  };
  for (const double off : {0.0, 0.002}) {  // of map 1, the second time known half as well
    for (std::uint32_t m = 0; m < 4; ++m) add(m, 5 + (m == 1 ? off : 0), off > 0 ? 0.004 : 0.002);
    targets.first.push_back(targets.seen.size());
  }
  for (std::size_t m = 1; m < 4; ++m) s.heights.of_map[m] = s.truth[m] + 0.05;  // as links place it
  REQUIRE(s.adjust(targets));
  for (const std::size_t m : {2u, 3u}) CHECK(s.heights.of_map[m] == Approx(s.truth[m]).margin(1e-4));
  CHECK(s.heights.of_map[1] < s.truth[1] - 0.0002);
  CHECK(s.heights.of_map[1] > s.truth[1] - 0.0007);  // a fifth of 2 mm, but for Tukey weights
}

}  // namespace globalmatch::test_height_adjustment
