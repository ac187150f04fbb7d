#include "globalmatch/detail/survey/place_maps.hpp"

#include "catch.hpp"
#include "made_up_surveys.hpp"

namespace globalmatch::test_place_maps {

using namespace detail;

using scenes::uniform;

namespace {

constexpr std::size_t none = ~std::size_t(0);
constexpr double sufficient = -10;  // all links of these scenes pass it

placed_maps place(std::vector<survey_link>& links, std::size_t maps, std::size_t preferred = none) {
  use_supported_links(links, maps, sufficient);
  return place_maps(links, maps, preferred);
}

/// The truth in the frame of the reference of each map's component.
std::vector<plan_pose> in_components(std::vector<plan_pose> truth, const components& parts) {
  const std::vector<plan_pose> given = truth;
  for (std::size_t m = 0; m < truth.size(); ++m)
    truth[m] = given[parts.reference[parts.of[m]]].inverse() * given[m];
  return truth;
}

/// Has some links of a map place it `elsewhere`, all at the same place.
void displace(std::vector<survey_link>& links, std::uint32_t map, const plan_pose& elsewhere) {
  for (survey_link& l : links) {
    if (l.source == map)
      l.target_from_source = l.target_from_source * elsewhere;
    else if (l.target == map)
      l.target_from_source = elsewhere.inverse() * l.target_from_source,
      l.center = elsewhere.inverse() * l.center;
  }
}

std::vector<survey_link*> links_of(std::vector<survey_link>& links, std::uint32_t map) {
  std::vector<survey_link*> found;
  for (survey_link& l : links)
    if (l.source == map || l.target == map) found.push_back(&l);
  return found;
}

}  // namespace

TEST_CASE("maps with links that agree are one component in the frame of its reference") {
  random_source random(1);
  const auto truth = scenes::grid_of_maps(5, random);
  auto links = scenes::links_within(35, truth, {}, random);
  const placed_maps placed = place(links, truth.size());
  REQUIRE(placed.parts.count() == 1);
  CHECK(placed.parts.reference[0] == 6);  // the first of those with eight links
  CHECK(scenes::max_pose_error(placed.poses, in_components(truth, placed.parts)) < 1e-6);

  const placed_maps preferred = place(links, truth.size(), 24);
  CHECK(preferred.parts.reference[0] == 24);
  CHECK(preferred.poses[24].shift == vec2{0, 0});
  CHECK(preferred.poses[24].yaw == 0);
  CHECK(scenes::max_pose_error(preferred.poses, in_components(truth, preferred.parts)) < 1e-6);
}

TEST_CASE("with 30 % of the links wrong no map is placed wrongly, and 98 % are placed") {
  std::size_t placed_count = 0, all = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    random_source random(seed);
    const auto truth = scenes::grid_of_maps(9, random);
    auto links = scenes::links_within(45, truth, {0.01, 0.0003}, random);
    for (survey_link& l : links)
      if (random.uniform() < 0.3) scenes::make_wrong(l, random);
    const placed_maps placed = place(links, truth.size());
    const auto expected = in_components(truth, placed.parts);
    INFO("seed " << seed);
    CHECK(scenes::max_pose_error(placed.poses, expected,
                                 [&](std::size_t m) { return !placed.ambiguous[m]; }) < 0.2);
    const std::uint32_t main = placed.parts.of[placed.parts.reference[placed.parts.of[40]]];
    for (const std::uint32_t part : placed.parts.of) placed_count += part == main, ++all;
  }
  CHECK(double(placed_count) >= 0.98 * double(all));
}

TEST_CASE("maps of which half the links agree on a wrong place are ambiguous, and displace no other") {
  for (const std::uint64_t seed : {4u, 5u, 6u, 7u}) {
    random_source random(seed);
    const auto truth = scenes::grid_of_maps(10, random);
    auto links = scenes::links_within(35, truth, {0.01, 0.0003}, random);
    std::vector<std::uint8_t> is_wrong(truth.size());
    for (std::size_t i = 0; i < truth.size() / 10; ++i) {
      const auto m = std::uint32_t(11 + 22 * (i / 5) + 2 * (i % 5));
      is_wrong[m] = true;
      const plan_pose elsewhere = {{uniform(random, 3, 9), uniform(random, -9, 9)}, scenes::any_yaw(random)};
      const auto of_map = links_of(links, m);
      std::vector<survey_link> half;
      for (std::size_t k = 0; k < of_map.size(); k += 2) half.push_back(*of_map[k]);
      displace(half, m, elsewhere);
      for (std::size_t k = 0; k < of_map.size(); k += 2) *of_map[k] = half[k / 2];
    }
    const placed_maps placed = place(links, truth.size());
    INFO("seed " << seed);
    for (std::size_t m = 0; m < truth.size(); ++m) CHECK(placed.ambiguous[m] == is_wrong[m]);
    CHECK(scenes::max_pose_error(placed.poses, in_components(truth, placed.parts)) < 0.1);
    CHECK(placed.parts.count() == 1 + truth.size() / 10);
  }
}

TEST_CASE("errors that add up around a ring are no contradiction") {
  for (const std::uint64_t seed : {7u, 8u, 9u}) {
    random_source random(seed);
    const auto truth = scenes::ring_of_maps(60, random);
    std::vector<survey_link> links;
    for (std::uint32_t m = 0; m < 60; ++m)
      links.push_back(scenes::link_between(m, (m + 1) % 60, truth, {0.03, 0.003}, random));
    const placed_maps placed = place(links, truth.size(), 0);
    CHECK(placed.parts.count() == 1);
    for (const survey_link& l : links) CHECK(l.used);
    CHECK(scenes::max_pose_error(placed.poses, truth) < 10);  // a chain is as long as it is
  }
}

TEST_CASE("a block of maps that one wrong link and one right one attach is a component of its own") {
  random_source random(10);
  auto truth = scenes::grid_of_maps(4, random);
  for (std::size_t m = 8; m < 16; ++m) truth[m].shift.y += 200;
  auto links = scenes::links_within(35, truth, {0.01, 0.0003}, random);
  links.push_back(scenes::link_between(5, 9, truth, {}, random));
  links.push_back(scenes::link_between(6, 14, truth, {}, random));
  const std::vector<survey_link> right = links;
  CHECK(place(links, truth.size()).parts.count() == 1);

  links = right;
  scenes::make_wrong(links.back(), random);
  const placed_maps placed = place(links, truth.size());
  CHECK(placed.parts.count() == 2);
  CHECK(scenes::max_pose_error(placed.poses, in_components(truth, placed.parts)) < 0.1);
  for (std::size_t m = 0; m < truth.size(); ++m) CHECK_FALSE(placed.ambiguous[m]);
}

TEST_CASE("links that agree outvote a wrong one that was more significant") {
  random_source random(11);
  const auto truth = scenes::grid_of_maps(4, random);
  std::vector<survey_link> links;
  for (const survey_link& l : scenes::links_within(35, truth, {0.01, 0.0003}, random))
    if (l.source != 0 && l.target != 0) links.push_back(l);
  for (const std::uint32_t m : {3u, 12u, 15u})  // far from each other: no cycle of three supports them
    links.push_back(scenes::link_between(0, m, truth, {0.01, 0.0003}, random));
  links.push_back(scenes::link_between(0, 5, truth, {}, random));
  scenes::make_wrong(links.back(), random);
  links.back().log10_nfa = -40;
  const placed_maps placed = place(links, truth.size());
  CHECK(placed.parts.count() == 1);
  CHECK(scenes::max_pose_error(placed.poses, in_components(truth, placed.parts)) < 0.1);
  CHECK_FALSE(links.back().used);
}

TEST_CASE("a map with one link here and one there is ambiguous, be it the preferred one") {
  for (const std::size_t preferred : {none, std::size_t(15)}) {
    random_source random(12);
    const auto truth = scenes::grid_of_maps(4, random);
    std::vector<survey_link> links;
    for (const survey_link& l : scenes::links_within(35, truth, {}, random))
      if (l.target != 15) links.push_back(l);
    links.push_back(scenes::link_between(1, 15, truth, {}, random));
    links.push_back(scenes::link_between(12, 15, truth, {}, random));
    scenes::make_wrong(links.back(), random);
    const placed_maps placed = place(links, truth.size(), preferred);
    for (std::size_t m = 0; m < truth.size(); ++m) CHECK(placed.ambiguous[m] == (m == 15));
    CHECK(placed.parts.count() == 2);
  }
}

TEST_CASE("without links each map is a component, and without maps there is none") {
  std::vector<survey_link> links;
  CHECK(place(links, 0).parts.count() == 0);
  const placed_maps placed = place(links, 3);
  CHECK(placed.parts.count() == 3);
  CHECK(placed.parts.reference == std::vector<std::uint32_t>{0, 1, 2});
}

}  // namespace globalmatch::test_place_maps
