#include "globalmatch/detail/survey/decide_places.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "catch.hpp"
#include "made_up_surveys.hpp"

namespace globalmatch::test_decide_places {

using namespace detail;

using namespace scenes;

namespace {

constexpr std::uint32_t alone = 4;    // the map in the middle
constexpr double max_of_link = -4.5;  // of some tens of maps

/// Nine maps, of which that in the middle stands alone while the others are placed and adjusted.
struct grid_without_middle {
  random_source random;
  surveyed_grid grid;
  std::vector<survey_link> links;
  placed_maps placed;

  explicit grid_without_middle(std::uint64_t seed) : random(seed), grid(3, 0.02, random) {
    links = links_within(35, grid.truth, {0.02, 0.001}, random);
    placed.poses = grid.truth;
    placed.parts.of.assign(9, 0);
    placed.parts.of[alone] = 1;
    placed.parts.reference = {0, alone};
    placed.ambiguous.assign(9, 0);
    for (survey_link& l : links) l.used = !of_alone(l);
  }

  static bool of_alone(const survey_link& l) { return l.source == alone || l.target == alone; }

  std::vector<std::size_t> decided() const {
    std::vector<std::uint32_t> others = all_of(9);
    std::erase(others, alone);
    const adjusted_survey adjusted = adjust_to_trees(grid.maps, placed, links, {others, {alone}});
    return decide_places(grid.maps, links, placed, adjusted, 0, max_of_link);
  }
};

}  // namespace

TEST_CASE("of links to several places that one is decided for where the stems fit the trees of all others") {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    grid_without_middle s(seed);
    std::vector<std::size_t> right;
    for (std::size_t i = 0; i < s.links.size(); ++i)
      if (s.of_alone(s.links[i])) right.push_back(i);
    REQUIRE(right.size() == 8);
    const std::size_t last = right.back();
    right.pop_back();
    for (const std::size_t l : right) make_wrong(s.links[l], s.random);
    CHECK(s.decided() == std::vector<std::size_t>{last});
  }
}

TEST_CASE("links that are all wrong decide nothing, nor do those of a map from elsewhere") {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    grid_without_middle wrong(seed);
    for (survey_link& l : wrong.links)
      if (wrong.of_alone(l)) make_wrong(l, wrong.random);
    CHECK(wrong.decided().empty());

    grid_without_middle alien(seed);
    const surveyed_grid elsewhere(1, 0.02, alien.random);
    alien.grid.maps[alone] = elsewhere.maps[0];
    CHECK(alien.decided().empty());
  }
}

TEST_CASE("maps that hang together apart from the others are each decided by the trees of these") {
  constexpr std::uint32_t beside = 5;
  grid_without_middle s(11);
  s.placed.parts.of[beside] = 1;
  const auto is_apart = [&](std::uint32_t m) { return s.placed.parts.of[m] == 1; };
  std::vector<std::size_t> expected;
  for (std::size_t i = 0; i < s.links.size(); ++i) {
    survey_link& l = s.links[i];
    l.used = is_apart(l.source) == is_apart(l.target);
    if (!l.used) expected.push_back(i);
  }
  std::vector<std::uint32_t> others = all_of(9);
  std::erase_if(others, is_apart);
  const adjusted_survey adjusted = adjust_to_trees(s.grid.maps, s.placed, s.links, {others, {alone, beside}});
  std::vector<std::size_t> decided = decide_places(s.grid.maps, s.links, s.placed, adjusted, 0, max_of_link);
  std::sort(decided.begin(), decided.end());
  CHECK(decided == expected);
}

TEST_CASE("maps of one component that are decided for different places of it join nothing") {
  const auto at = [](std::uint32_t map, double x) {
    return decided_map{map, {{{x, 0}, 0}, {0, 0}, 0}, {map}};
  };
  components parts;
  parts.of = {0, 1, 1, 2, 2, 2, 3};
  parts.reference = {0, 1, 3, 6};
  std::vector<decided_map> decided = {at(1, 0), at(2, 30), at(3, 5), at(4, 5.1), at(5, 12), at(6, 8)};
  keep_agreeing(decided, parts);
  std::vector<std::uint32_t> kept;
  for (const decided_map& d : decided) kept.push_back(d.map);
  CHECK(kept == std::vector<std::uint32_t>{3, 4, 6});
}

TEST_CASE("maps without links, and all maps where none is apart, are left as they are") {
  grid_without_middle s(3);
  std::erase_if(s.links, grid_without_middle::of_alone);
  CHECK(s.decided().empty());

  grid_without_middle whole(3);
  whole.placed.parts.of[alone] = 0;
  CHECK(decide_places(whole.grid.maps, whole.links, whole.placed,
                      adjust_to_trees(whole.grid.maps, whole.placed, whole.links, {all_of(9)}), 0,
                      max_of_link)
            .empty());
}

TEST_CASE("a map that fits two places about as well stays undecided") {
  random_source random(7);
  const surveyed_grid forest(1, 0, random), other(1, 0, random);
  const auto with_share_of = [&](double share) {  // of the stems of the map at the second place
    position_set stems = other.maps[0].stems;
    const position_set& repeated = forest.maps[0].stems;
    const std::size_t count = std::min(stems.size(), std::size_t(share * double(repeated.size())));
    std::copy_n(repeated.at.begin(), count, stems.at.begin());
    return without_triangles(std::move(stems), true, {});
  };
  position_set seen_again = forest.maps[0].stems;
  for (vec3& p : seen_again.at) p += {0.02 * random.normal(), 0.02 * random.normal(), 0};
  const prepared_stems again = without_triangles(std::move(seen_again), true, {});
  for (const double share : {1.0, 0.8, 0.25}) {
    CAPTURE(share);
    const std::vector<prepared_stems> maps = {forest.maps[0], with_share_of(share), again};
    placed_maps placed;
    placed.poses = {{{0, 0}, 0}, {{100, 0}, 0}, {{0, 0}, 0}};
    placed.parts.of = {0, 0, 1};
    placed.parts.reference = {0, 2};
    placed.ambiguous = {0, 0, 1};
    std::vector<survey_link> links;
    for (const std::uint32_t target : {0u, 1u}) {
      survey_link l = link_between(2, target, placed.poses, {}, random);
      l.target_from_source = {{0, 0}, 0};
      l.center = {0, 0};
      links.push_back(l);
    }
    adjusted_survey adjusted;
    adjusted.poses = placed.poses;
    adjusted.trees = find_trees(maps, std::vector<std::uint32_t>{0, 1}, placed.poses, tree_radii(3));
    adjusted.weights.assign(adjusted.trees.stems.size(), 1);
    const auto decided = decide_places(maps, links, placed, adjusted, 0, max_of_link);
    CHECK(decided == (share < 0.5 ? std::vector<std::size_t>{0} : std::vector<std::size_t>{}));
  }
}

}  // namespace globalmatch::test_decide_places
