#include "globalmatch/detail/survey/target_links.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "catch.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_target_links {

using namespace detail;

using scenes::uniform;

namespace {

constexpr double sigma = 0.002;  // [m]
const plan_pose target_from_source{{12, -7}, 2.1};
constexpr double raise = 1.5;  // [m]

/// Targets that two maps show, at places [m] in the source.
target_observations seen_by_two(const std::vector<vec3>& places, double noise, random_source& random) {
  target_observations targets;
  std::uint32_t given = 0;
  for (const vec3& p : places) {
    const vec2 there = target_from_source * p.xy();
    const auto off = [&] { return noise * random.normal(); };
    targets.seen.push_back({0, {p.x + off(), p.y + off(), p.z + off()}, sigma, given++});
    targets.seen.push_back({1, {there.x + off(), there.y + off(), p.z + raise + off()}, sigma, given++});
    targets.first.push_back(targets.seen.size());
  }
  return targets;
}

const std::vector<vec3> four_places = {{0, 0, 1}, {10, 2, 0}, {3, 9, 2}, {-6, 5, 1.5}};

}  // namespace

TEST_CASE("targets without noise give the transform of their maps exactly") {
  random_source random(1);
  for (const std::size_t count : {2u, 3u, 4u}) {
    const std::vector<vec3> places(four_places.begin(), four_places.begin() + std::ptrdiff_t(count));
    const auto links = links_by_targets(seen_by_two(places, 0, random));
    REQUIRE(links.size() == 1);
    const survey_link& l = links[0];
    CHECK((l.source == 0 && l.target == 1 && l.is_of_targets() && l.targets.size() == count));
    CHECK((l.target_from_source.shift - target_from_source.shift).norm() < 1e-9);
    CHECK(std::abs(wrapped(l.target_from_source.yaw - target_from_source.yaw)) < 1e-9);
    CHECK(raise_of({}, l) == Approx(raise));
    CHECK(l.covariance(0, 0) == Approx(2 * sigma * sigma / double(count)));
  }
}

TEST_CASE("the covariance of a link by targets is calibrated") {
  double squares = 0;
  constexpr int trials = 500;
  for (int trial = 0; trial < trials; ++trial) {
    random_source random(std::uint64_t(10 + trial));
    const auto links = links_by_targets(seen_by_two(four_places, sigma, random));
    REQUIRE(links.size() == 1);
    const survey_link& l = links[0];
    const vec2 off = l.target_from_source * l.center_in_source() - target_from_source * l.center_in_source();
    const vec3 error = {off.x, off.y, wrapped(l.target_from_source.yaw - target_from_source.yaw)};
    squares += error.dot(l.covariance.inverse() * error) / 3;
  }
  CHECK(std::sqrt(squares / trials) == Approx(1).margin(0.1));
}

TEST_CASE("of three or four targets one that is wrong is left out, of two none can be") {
  random_source random(3);
  for (const std::size_t count : {2u, 3u, 4u})
    for (std::size_t wrong = 0; wrong < count; ++wrong) {
      const std::vector<vec3> places(four_places.begin(), four_places.begin() + std::ptrdiff_t(count));
      target_observations targets = seen_by_two(places, sigma, random);
      const vec3 away = targets.seen[2 * wrong + 1].at - targets.seen[wrong == 0 ? 3 : 1].at;
      targets.seen[2 * wrong + 1].at += 0.07 / away.norm() * away;
      const auto links = links_by_targets(targets);
      REQUIRE(links.size() == (count == 2 ? 0 : 1));
      for (const survey_link& l : links) {
        CHECK(l.targets.size() == count - 1);
        for (const correspondence& c : l.targets) CHECK(c.source != 2 * wrong);
        CHECK((l.target_from_source * vec2{3, 3} - target_from_source * vec2{3, 3}).norm() < 0.02);
      }
    }
}

TEST_CASE("unrelated targets link no more maps than the NFA of the links says") {
  constexpr int trials = 20'000;
  for (const std::size_t in_common : {2u, 3u}) {
    std::size_t linked = 0, significant = 0;
    double expected = 0;
    random_source random(11);
    for (int trial = 0; trial < trials; ++trial) {
      target_observations targets;
      std::uint32_t given = 0;
      for (std::size_t t = 0; t < in_common; ++t) {
        for (const std::uint32_t map : {0u, 1u})
          targets.seen.push_back({map,
                                  {uniform(random, -15, 15), uniform(random, -15, 15), uniform(random, 0, 2)},
                                  0.02,
                                  given++});
        targets.first.push_back(targets.seen.size());
      }
      for (const survey_link& l : links_by_targets(targets)) {
        ++linked;
        significant += l.log10_nfa <= -2;
        expected = std::max(expected, std::pow(10, l.log10_nfa));
      }
    }
    CAPTURE(in_common, linked, significant, expected);
    CHECK(linked > 0);
    CHECK(double(significant) <= 0.01 * trials);
    CHECK(double(linked) < expected * trials);
  }
}

TEST_CASE("three targets are significant alone, two are not among many maps") {
  random_source random(12);
  const auto log10_nfa_of_targets = [&](std::size_t count) {
    const std::vector<vec3> places(four_places.begin(), four_places.begin() + std::ptrdiff_t(count));
    return links_by_targets(seen_by_two(places, sigma, random)).at(0).log10_nfa;
  };
  CHECK(log10_nfa_of_targets(2) > -3);
  CHECK(log10_nfa_of_targets(3) < -6);
  CHECK(log10_nfa_of_targets(4) < -10);
}

TEST_CASE("two pairs of targets that contradict each other link no maps") {
  random_source random(4);
  target_observations targets = seen_by_two(four_places, 0, random);
  for (const std::size_t i : {5u, 7u}) targets.seen[i].at.x += 3;
  CHECK(links_by_targets(targets).empty());
}

TEST_CASE("targets that are mirrored, above each other or alone link no maps") {
  random_source random(5);
  target_observations mirrored = seen_by_two(four_places, 0, random);
  for (std::size_t i = 1; i < mirrored.seen.size(); i += 2) mirrored.seen[i].at.x *= -1;
  CHECK(links_by_targets(mirrored).empty());
  CHECK(links_by_targets(seen_by_two({{1, 2, 0}, {1, 2, 3}}, 0, random)).empty());
  CHECK(links_by_targets(seen_by_two({{1, 2, 0}, {1.05, 2, 3}}, 0, random)).empty());  // 5 cm apart
  CHECK(links_by_targets(seen_by_two({{1, 2, 0}}, 0, random)).empty());
  CHECK(links_by_targets({}).empty());
}

TEST_CASE("maps that lean a little are linked by targets at different heights") {
  random_source random(6);
  std::vector<vec3> places = four_places;
  places[2].z = 8;
  target_observations targets = seen_by_two(places, 0, random);
  const mat3 lean = rotation_about({1, 0, 0}, 0.006);
  for (std::size_t i = 1; i < targets.seen.size(); i += 2) targets.seen[i].at = lean * targets.seen[i].at;
  const auto links = links_by_targets(targets);
  REQUIRE(links.size() == 1);
  CHECK(links[0].targets.size() == 4);
}

}  // namespace globalmatch::test_target_links
