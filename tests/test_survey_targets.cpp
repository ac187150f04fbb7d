#include "globalmatch/detail/survey/survey_targets.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "catch.hpp"
#include "made_up_surveys.hpp"

namespace globalmatch::test_survey_targets {

using namespace detail;

namespace {

std::vector<survey_options::target> three_of_two_scans() {
  return {{1, "B", {4, 5, 6}, 0.003},
          {0, "A", {1, 2, 3}, 0.003},
          {1, "A", {1, 1, 1}, 0.005},
          {0, "B", {7, 8, 9}, 0.002},
          {2, "A", {0, 0, 0}, 0.005}};
}

}  // namespace

TEST_CASE("targets come by name and map, in the local frames, whatever their order") {
  std::vector<prepared_stems> maps(3);
  maps[1].stems.frame.origin = {10, 20, 30};
  auto given = three_of_two_scans();
  for (int order = 0; order < 3; ++order) {
    const target_observations targets = find_targets(given, maps);
    REQUIRE(targets.size() == 2);
    REQUIRE(targets.of(0).size() == 3);
    REQUIRE(targets.of(1).size() == 2);
    CHECK(targets.of(0)[1].map == 1);
    CHECK(targets.of(0)[1].at == vec3{-9, -19, -29});
    CHECK(targets.of(0)[1].sigma == 0.005);
    CHECK(targets.of(1)[0].at == vec3{7, 8, 9});
    for (const target_of_map& t : targets.seen) CHECK(given[t.given].scan == t.map);
    std::rotate(given.begin(), given.begin() + 2, given.end());
  }
  CHECK(find_targets({}, maps).size() == 0);
}

TEST_CASE("a target that two components show is one for each") {
  const std::vector<prepared_stems> maps(3);
  const auto given = three_of_two_scans();
  const target_observations all = find_targets(given, maps);
  const std::vector<std::uint32_t> part_of = {1, 0, 1};
  const target_observations apart = targets_of_components(all, part_of);
  REQUIRE(apart.size() == 4);
  CHECK(apart.seen.size() == all.seen.size());
  CHECK(apart.of(0).size() == 1);
  CHECK(apart.of(0)[0].map == 1);
  CHECK(apart.of(1).size() == 2);
  CHECK(apart.of(1)[1].map == 2);
  const std::vector<std::uint32_t> together = {0, 0, 0};
  CHECK(targets_of_components(all, together).first == all.first);
}

TEST_CASE("maps that have targets in common are pairs of an adjustment") {
  const std::vector<prepared_stems> maps(3);
  const target_observations all = find_targets(three_of_two_scans(), maps);
  const unknown_poses unknowns(3, [](std::size_t m) { return m == 0; });
  const auto pairs = pairs_of_landmarks({}, all, unknowns);
  REQUIRE(pairs.size() == 1);
  CHECK(std::minmax(pairs[0].first, pairs[0].second) == std::minmax(0u, 1u));
}

TEST_CASE("standard deviations narrow to those of the targets") {
  narrowing_sigmas none{target_observations{}};
  CHECK(none.are_final());
  CHECK(none.steps() == 0);
  target_observations targets;
  targets.seen = {{0, {}, 0.01, 0}, {1, {}, 0.002, 1}};
  targets.first = {0, 2};
  narrowing_sigmas sigmas(targets);
  const int steps = sigmas.steps();
  CHECK(sigmas(0.01) > 0.1);
  CHECK(sigmas.leniency(0.01) < 0.1);
  for (int i = 0; i < steps; ++i) {
    CHECK_FALSE(sigmas.are_final());
    sigmas.narrow();
  }
  CHECK(sigmas.are_final());
  CHECK(sigmas(0.01) == 0.01);
  CHECK(sigmas(0.002) == 0.002);
  CHECK(sigmas.leniency(0.002) == 1);
}

TEST_CASE("targets that make no sense are refused by name") {
  const auto refused = [](survey_options::target target, const std::string& message) {
    survey_options options;
    options.targets = {{0, "T1"}, target};
    CHECK_THROWS_WITH(require_valid(options), Catch::Contains("targets") && Catch::Contains(message));
  };
  refused({0, ""}, "no name");
  refused({0, "T1"}, "twice");
  refused({1, "T2", {1, 2, std::nan("")}}, "T2");
  refused({1, "T2", {1, 2, 3}, 0}, "T2");
  refused({1, "T2", {1, 2, 3}, std::nan("")}, "T2");
  survey_options options;
  options.targets = {{0, "T1"}, {1, "T1"}, {0, "T2"}};
  CHECK_NOTHROW(require_valid(options));
}

}  // namespace globalmatch::test_survey_targets
