#include "globalmatch/detail/survey/link_graph.hpp"

#include <algorithm>
#include <set>

#include "catch.hpp"
#include "made_up_surveys.hpp"

namespace globalmatch::test_link_graph {

using namespace detail;

namespace {

constexpr double sufficient = -10;

/// A transform of the link as an affine one, source to target or the other way.
Eigen::Isometry2d transform_of(const survey_link& l, std::uint32_t from) {
  Eigen::Isometry2d t = Eigen::Isometry2d::Identity();
  t.rotate(l.target_from_source.yaw);
  t.pretranslate(Eigen::Vector2d(l.target_from_source.shift.x, l.target_from_source.shift.y));
  return l.source == from ? t : t.inverse();
}

const survey_link* find(const std::vector<survey_link>& links, std::uint32_t a, std::uint32_t b) {
  for (const survey_link& l : links)
    if ((l.source == a && l.target == b) || (l.source == b && l.target == a)) return &l;
  return nullptr;
}

/// Cycles of three that return to where they began within 20 cm and a degree, by all triples of maps.
std::size_t count_cycles(const std::vector<survey_link>& links, const survey_link& l, std::uint32_t maps) {
  std::size_t count = 0;
  for (std::uint32_t third = 0; third < maps; ++third) {
    const survey_link *first = find(links, l.target, third), *second = find(links, third, l.source);
    if (!first || !second) continue;
    const Eigen::Isometry2d around =
        transform_of(*second, third) * transform_of(*first, l.target) * transform_of(l, l.source);
    const vec2 c = l.center_in_source();
    const Eigen::Vector2d center(c.x, c.y);
    count +=
        (around * center - center).norm() < 0.2 && std::abs(std::atan2(around(1, 0), around(0, 0))) < 0.017;
  }
  return count;
}

/// Three maps, each linked to the others.
std::vector<survey_link> triangle_of_links(random_source& random) {
  return scenes::links_within(100, {{{0, 0}, 0}, {{20, 0}, 1}, {{5, 15}, -2}}, {}, random);
}

}  // namespace

TEST_CASE("the graph has the links of each map, by neighbors, and only those that are taken") {
  random_source random(1);
  const auto truth = scenes::grid_of_maps(5, random);
  const auto links = scenes::links_within(45, truth, {}, random);
  const link_graph graph(truth.size(), links, [](const survey_link& l) { return l.source % 2 == 0; });
  REQUIRE(graph.size() == truth.size());
  for (std::uint32_t m = 0; m < truth.size(); ++m) {
    std::vector<std::uint32_t> neighbors, expected;
    for (const auto& e : graph.of(m)) {
      neighbors.push_back(e.neighbor);
      const plan_pose placed = truth[e.neighbor] * graph.neighbor_from(m, e);
      CHECK((placed.shift - truth[m].shift).norm() < 1e-9);
      CHECK(std::abs(wrapped(placed.yaw - truth[m].yaw)) < 1e-9);
    }
    for (std::uint32_t other = 0; other < truth.size(); ++other)
      if (const survey_link* l = find(links, m, other); l && l->source % 2 == 0) expected.push_back(other);
    CHECK(neighbors == expected);
  }
}

TEST_CASE("cycles that support links are those that brute force finds") {
  for (const std::uint64_t seed : {2u, 3u}) {
    random_source random(seed);
    const auto truth = scenes::grid_of_maps(5, random);
    auto links = scenes::links_within(45, truth, {0.005, 0.0002}, random);
    for (survey_link& l : links)
      if (random.uniform() < 0.3) scenes::make_wrong(l, random);
    use_supported_links(links, truth.size(), sufficient);
    std::size_t supported = 0;
    for (const survey_link& l : links) {
      CHECK(l.supporting_cycles == count_cycles(links, l, std::uint32_t(truth.size())));
      CHECK(l.used);  // all are significant
      supported += l.supporting_cycles > 0;
    }
    CHECK(supported > links.size() / 3);
    CHECK(supported < links.size());
  }
}

TEST_CASE("a link that is not significant needs a cycle, and the evidence of its weak links together") {
  random_source random(4);
  const auto used_with = [&](double a, double b, double c, bool wrong = false) {
    auto links = triangle_of_links(random);
    links[0].log10_nfa = a, links[1].log10_nfa = b, links[2].log10_nfa = c;
    if (wrong) scenes::make_wrong(links[0], random);
    use_supported_links(links, 3, sufficient);
    std::vector<bool> used;
    for (const survey_link& l : links) used.push_back(l.used);
    return used;
  };
  using bools = std::vector<bool>;
  CHECK(used_with(-1, -20, -20) == bools{true, true, true});
  CHECK(used_with(-1, -20, -20, true) == bools{false, true, true});
  CHECK(used_with(-4, -4, -20) == bools{false, false, true});
  CHECK(used_with(-6, -6, -20) == bools{true, true, true});
  CHECK(used_with(-3, -3, -3) == bools{false, false, false});
  CHECK(used_with(-4, -4, -4) == bools{true, true, true});
  auto alone = triangle_of_links(random);
  alone.pop_back();
  alone[0].log10_nfa = -9;
  use_supported_links(alone, 3, sufficient);
  CHECK_FALSE(alone[0].used);
  CHECK(alone[1].used);
}

TEST_CASE("weak links of a cycle that pair the same stems are no more evidence than one of them") {
  random_source random(7);
  for (const bool same : {true, false}) {
    auto links = triangle_of_links(random);  // 0-1, 0-2 and 1-2
    links[0].log10_nfa = -20;
    links[1].log10_nfa = links[2].log10_nfa = -8;
    for (stem_index i = 0; i < 6; ++i) {
      links[1].correspondences.push_back({i, i});
      links[2].correspondences.push_back({i, same ? i : i + 6});
    }
    use_supported_links(links, 3, sufficient);
    CHECK(links[0].used);
    for (const std::size_t l : {1u, 2u}) CHECK(links[l].used != same);
  }
}

TEST_CASE("components are what links connect, with the map of most links or the preferred one as reference") {
  random_source random(5);
  for (int repeat = 0; repeat < 20; ++repeat) {
    constexpr std::uint32_t maps = 30;
    std::vector<survey_link> links;
    for (int i = 0; i < 22; ++i) {
      survey_link l;
      l.source = random.below(maps), l.target = random.below(maps);
      if (l.source != l.target && !find(links, l.source, l.target)) links.push_back(l);
    }
    std::vector<std::uint32_t> lowest(maps);  // map that each is connected with
    for (std::uint32_t m = 0; m < maps; ++m) lowest[m] = m;
    for (std::uint32_t again = 0; again < maps; ++again)
      for (const survey_link& l : links)
        lowest[l.source] = lowest[l.target] = std::min(lowest[l.source], lowest[l.target]);
    const link_graph graph(maps, links, [](const survey_link&) { return true; });
    const components found = find_components(graph, 17);
    CHECK(found.count() == std::set<std::uint32_t>(lowest.begin(), lowest.end()).size());
    for (std::uint32_t a = 0; a < maps; ++a) {
      for (std::uint32_t b = 0; b < a; ++b) CHECK((found.of[a] == found.of[b]) == (lowest[a] == lowest[b]));
      const std::uint32_t reference = found.reference[found.of[a]];
      if (reference != 17) CHECK(graph.of(reference).size() >= graph.of(a).size());
    }
    CHECK(found.reference[found.of[17]] == 17);
  }
}

}  // namespace globalmatch::test_link_graph
