#include "globalmatch/detail/survey/survey_trees.hpp"

#include <set>

#include "catch.hpp"
#include "made_up_surveys.hpp"

namespace globalmatch::test_survey_trees {

using namespace detail;

namespace {

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
    check_partition(find_trees(maps, scenes::all_of(5), poses, scenes::tree_radii(5)), maps);
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
        if (const double d = (a[i] - b[k]).xy().norm(); d < scenes::tree_radius) pairs.push_back({d, {i, k}});
    std::sort(pairs.begin(), pairs.end());
    std::set<std::pair<std::uint32_t, std::uint32_t>> expected, found;
    std::set<std::uint32_t> taken_a, taken_b;
    for (const auto& [distance, pair] : pairs)
      if (!taken_a.count(pair.first) && !taken_b.count(pair.second))
        expected.insert(pair), taken_a.insert(pair.first), taken_b.insert(pair.second);
    const tree_observations trees =
        find_trees(maps, scenes::all_of(2), std::vector<plan_pose>(2), scenes::tree_radii(2));
    for (std::size_t t = 0; t < trees.size(); ++t)
      if (trees.of(t).size() == 2) found.insert({trees.of(t)[0].stem, trees.of(t)[1].stem});
    CHECK(found == expected);
    CHECK(expected.size() > 20);
  }
}

TEST_CASE("trees without noise are those of the forest") {
  random_source random(3);
  const scenes::nine_maps s(0, random);
  const tree_observations trees = find_trees(s.seen.maps, scenes::all_of(9), s.truth, scenes::tree_radii(9));
  check_partition(trees, s.seen.maps);
  std::set<std::size_t> forest;
  for (std::size_t t = 0; t < trees.size(); ++t) {
    std::set<std::size_t> of_tree;
    for (const stem_of_map& o : trees.of(t)) of_tree.insert(s.seen.trees[o.map][o.stem]);
    CHECK(of_tree.size() == 1);
    CHECK(forest.insert(*of_tree.begin()).second);
  }
}

}  // namespace globalmatch::test_survey_trees
