#include "globalmatch/growing_survey.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "catch.hpp"
#include "stem_scenes.hpp"
#include "survey_layouts.hpp"

namespace globalmatch::test_growing_survey {

using namespace detail;

using benchmarks::plant;
using benchmarks::survey_layout;
using benchmarks::surveyed_map;
using scenes::positions;
using status = survey::status;

namespace {

/// The stems of maps of a forest of `width` by `height` [m], row by row.
std::vector<positions> maps_of_forest(double width, double height, random_source& random) {
  const survey_layout precise = {.noise = 0.015};
  std::vector<positions> stems;
  for (const surveyed_map& m : survey_stand(plant("spaced", width, height, random), precise, 1000, random))
    stems.push_back(m.stems);
  return stems;
}

/// A survey of the first maps, to which the others were added.
growing_survey grown(const std::vector<positions>& maps, std::size_t first, const survey_options& options,
                     const execution& exec = {}) {
  growing_survey g(std::vector<positions>(maps.begin(), maps.begin() + std::ptrdiff_t(first)), options, exec);
  for (std::size_t m = first; m < maps.size(); ++m) {
    const survey::scan& added = g.add(maps[m], exec);
    CHECK(&added == &g.result().scans[m]);
  }
  return g;
}

/// Where a scan is placed in one survey and in another one, at the centroid of its stems.
struct place_difference {
  double plan, height;  ///< in standard deviations
};
place_difference difference_of(const survey::scan& a, const survey::scan& b) {
  const Eigen::Vector3d& center = b.uncertainty->center;
  const Eigen::Vector3d off = a.survey_from_scan * (b.survey_from_scan.inverse() * center) - center;
  const auto& c = b.uncertainty->covariance;
  if (c(0, 0) == 0) return {off.norm() < 1e-9 ? 0.0 : 1e9, 0};
  return {off.head<2>().norm() / std::sqrt((c(0, 0) + c(1, 1)) / 2), std::abs(off.z()) / std::sqrt(c(2, 2))};
}

/// Both have the same scans placed, and the same trees; at the same places but for what two adjustments leave
/// that started from other poses, which is common to most where it is of the reference. `max_median` [sigmas]
/// in plan.
void check_alike(const survey& a, const survey& b, double max_median) {
  REQUIRE(a.scans.size() == b.scans.size());
  CHECK(a.components == b.components);
  CHECK(a.frames.size() == b.frames.size());
  CHECK(a.stem_sigma == Approx(b.stem_sigma).epsilon(0.05));
  CHECK(double(a.trees.size()) == Approx(double(b.trees.size())).epsilon(0.01));
  std::vector<double> plan;
  for (std::size_t m = 0; m < a.scans.size(); ++m) {
    const survey::scan &s = a.scans[m], &t = b.scans[m];
    INFO("map " << m << " " << s.reason);
    REQUIRE(s.status == t.status);
    CHECK(s.component == t.component);
    CHECK(s.reason == t.reason);
    CHECK(s.uncertainty.has_value() == t.uncertainty.has_value());
    CHECK(std::isnan(s.check_median) == std::isnan(t.check_median));
    if (!s.uncertainty) continue;
    CHECK(s.is_height_known == t.is_height_known);
    CHECK(s.uncertainty->covariance.isApprox(t.uncertainty->covariance, 0.1));
    const place_difference d = difference_of(s, t);
    CHECK(d.plan < 0.6);
    CHECK(d.height < 0.1);
    plan.push_back(d.plan);
  }
  if (!plan.empty()) CHECK(median(plan) < max_median);
}

/// Whether two surveys have the same bits where they have scans and links.
bool are_equal(const survey& a, const survey& b) {
  bool equal =
      a.scans.size() == b.scans.size() && a.links.size() == b.links.size() && a.candidates == b.candidates;
  for (std::size_t m = 0; equal && m < a.scans.size(); ++m) {
    const survey::scan &s = a.scans[m], &t = b.scans[m];
    equal = s.status == t.status && s.survey_from_scan.matrix() == t.survey_from_scan.matrix() &&
            s.uncertainty.has_value() == t.uncertainty.has_value() &&
            (!s.uncertainty || s.uncertainty->covariance == t.uncertainty->covariance);
  }
  for (std::size_t l = 0; equal && l < a.links.size(); ++l)
    equal = a.links[l].residual == b.links[l].residual && a.links[l].used == b.links[l].used;
  return equal;
}

}  // namespace

TEST_CASE("a survey to which maps are added is that of all maps, but for fractions of their deviations") {
  random_source random(1);
  const auto maps = maps_of_forest(190, 190, random);
  const survey_options options = {.reference = 0};
  const survey fresh = register_survey(maps, options);
  REQUIRE(maps.size() > 70);  // few maps are solved again
  for (const std::size_t first : {maps.size() - 6, maps.size() / 2}) {
    const growing_survey g = grown(maps, first, options);
    check_alike(g.result(), fresh, first > maps.size() / 2 ? 0.1 : 0.5);
    for (std::size_t l = 1; l < g.result().links.size(); ++l) {
      const survey::link &a = g.result().links[l - 1], &b = g.result().links[l];
      CHECK(std::pair(a.source, a.target) < std::pair(b.source, b.target));
    }
    std::set<std::pair<std::size_t, std::size_t>> seen;
    for (const survey::tree& t : g.result().trees)
      for (const survey::observation& o : t.seen) CHECK(seen.insert({o.scan, o.stem}).second);
  }
}

TEST_CASE("a survey may start from nothing") {
  random_source random(2);
  const auto maps = maps_of_forest(70, 70, random);
  const growing_survey g = grown(maps, 0, {});
  check_alike(g.result(), register_survey(maps, {.reference = 0}), 0.1);
}

TEST_CASE("a map that has nothing in common with others is placed alone, and moves none") {
  random_source random(3);
  const auto maps = maps_of_forest(170, 170, random);
  growing_survey g(maps);
  const survey before = g.result();
  const status of_alien = g.add(maps_of_forest(22, 22, random)[0]).status;
  CHECK((of_alien == status::placed_alone || of_alien == status::unplaced));
  CHECK(g.add(positions{{1, 2, 0}, {2, 5, 0}}).status == status::unplaced);
  CHECK(g.add(positions()).status == status::no_stems);
  REQUIRE(g.result().scans.size() == maps.size() + 3);
  CHECK(g.result().components == before.components + (of_alien == status::placed_alone));
  for (std::size_t m = 0; m < maps.size(); ++m) {
    CHECK(g.result().scans[m].status == before.scans[m].status);
    CHECK(g.result().scans[m].survey_from_scan.translation().head<2>() ==
          before.scans[m].survey_from_scan.translation().head<2>());
  }
}

TEST_CASE("a map that joins two components makes one of them, in the frame of the larger one") {
  random_source random(4);
  // Five columns of stations, of which the middle one comes last.
  const auto all = maps_of_forest(330, 110, random);
  constexpr std::size_t columns = 15;
  std::vector<positions> maps, between;
  for (std::size_t m = 0; m < all.size(); ++m) {
    const std::size_t column = m % columns;
    if (column <= 5 || column >= 9) maps.push_back(all[m]);
    if (column == 6 || column == 7 || column == 8) between.push_back(all[m]);
  }
  growing_survey g(maps);
  REQUIRE(g.result().components == 2);
  std::size_t reference = 0;
  while (!(g.result().scans[reference].component == 0 &&
           g.result().scans[reference].survey_from_scan.matrix() == Eigen::Matrix4d::Identity()))
    ++reference;
  for (const positions& m : between) CHECK(g.add(m).status == status::placed);
  CHECK(g.result().components == 1);
  maps.insert(maps.end(), between.begin(), between.end());
  check_alike(g.result(), register_survey(maps, {.reference = reference}), 0.2);
}

TEST_CASE("a map of two places is ambiguous, and displaces no other") {
  random_source random(5);
  const auto maps = maps_of_forest(170, 170, random);
  positions both = maps[6];
  both.insert(both.end(), maps[maps.size() - 7].begin(), maps[maps.size() - 7].end());
  growing_survey g(maps);
  const survey before = g.result();
  const survey::scan& added = g.add(both);
  CHECK(added.status == status::ambiguous);
  CHECK(added.alternatives.size() >= 1);
  for (std::size_t m = 0; m < maps.size(); ++m) {
    REQUIRE(g.result().scans[m].status == status::placed);
    CHECK(difference_of(g.result().scans[m], before.scans[m]).plan < 0.4);
  }
}

/// Three targets, as all scans of a survey would show them.
std::vector<survey_options::target> targets_seen_by_all(const survey& placed) {
  std::vector<survey_options::target> targets;
  for (std::size_t m = 0; m < placed.scans.size(); ++m)
    for (int t = 0; t < 3; ++t)
      targets.push_back({m, "T" + std::to_string(t),
                         placed.scans[m].survey_from_scan.inverse() *
                             Eigen::Vector3d(20.0 + 30 * t, 30.0 + 10 * (t % 2), 2)});
  return targets;
}

TEST_CASE("a map that leans is turned upright when it is added, with targets and without") {
  random_source random(6);
  const auto maps = maps_of_forest(170, 170, random);
  const std::size_t last = maps.size() / 2;
  std::vector<positions> others = maps;
  others.erase(others.begin() + std::ptrdiff_t(last));
  const Eigen::Isometry3d tilt(Eigen::AngleAxisd(0.05, Eigen::Vector3d(1, 2, 0).normalized()));
  for (const bool has_targets : {false, true}) {
    CAPTURE(has_targets);
    survey_options options;
    if (has_targets) options.targets = targets_seen_by_all(register_survey(others));
    growing_survey level(others, options), leaning(others, options);
    const Eigen::Isometry3d expected = level.add(maps[last]).survey_from_scan * tilt.inverse();
    const survey::scan& added = leaning.add(scenes::moved(tilt, maps[last]));
    REQUIRE(added.status == status::placed);
    CHECK(added.survey_from_scan.linear().isApprox(expected.linear(), 0.005));
  }
}

TEST_CASE("a survey that grows has the same bits for any number of threads") {
  random_source random(7);
  const auto maps = maps_of_forest(170, 170, random);
  const std::size_t first = maps.size() - 4;
  const growing_survey one = grown(maps, first, {}, {.threads = 1}),
                       three = grown(maps, first, {}, {.threads = 3});
  CHECK(are_equal(one.result(), three.result()));
}

TEST_CASE("a map whose adding is cancelled, or that is refused, leaves the survey as it was") {
  random_source random(8);
  auto maps = maps_of_forest(170, 170, random);
  const positions last = maps.back();
  maps.pop_back();
  growing_survey g(maps), other(maps);
  const survey before = g.result();
  std::size_t calls = 0;
  CHECK(other
            .add(last, {.threads = 1,
                        .on_progress =
                            [&](const progress&) {
                              ++calls;
                              return true;
                            }})
            .status == status::placed);
  REQUIRE(calls > 0);
  for (std::size_t left = 0; left < std::min<std::size_t>(calls, 3); ++left) {
    std::size_t more = left;
    const execution exec = {.threads = 1, .on_progress = [&](const progress&) { return more-- > 0; }};
    try {
      g.add(last, exec);
      FAIL("was not cancelled");
    } catch (const operation_cancelled&) {
      CHECK(are_equal(g.result(), before));
    }
  }
  positions wrong = last;
  wrong[3].y() = std::nan("");
  CHECK_THROWS_WITH(g.add(wrong), Catch::Contains("map " + std::to_string(maps.size())));
  CHECK(are_equal(g.result(), before));
  CHECK(g.add(last).status == status::placed);
  CHECK(are_equal(g.result(), other.result()));
  CHECK_THROWS_AS(growing_survey(maps, {}, {.on_progress = [](const progress&) { return false; }}),
                  operation_cancelled);
  CHECK_THROWS_WITH(growing_survey(maps, {.max_nfa = 0}), Catch::Contains("max_nfa"));
}

TEST_CASE("maps of any container are added, as are stem maps") {
  random_source random(9);
  const auto maps = maps_of_forest(70, 70, random);
  const std::vector<positions> first(maps.begin(), maps.end() - 1);
  growing_survey expected(first), of_arrays(first), of_maps(first);
  expected.add(maps.back());
  std::vector<std::array<double, 3>> arrays;
  stem_map map;
  map.terrain.status = ground_status::seen;
  for (const Eigen::Vector3d& p : maps.back()) {
    arrays.push_back({p.x(), p.y(), p.z()});
    map.stems.emplace_back();
    map.stems.back().position = p;
  }
  of_arrays.add(arrays);
  CHECK(are_equal(of_arrays.result(), expected.result()));
  CHECK(of_maps.add(map).status == status::placed);
}

TEST_CASE("fixed scans stay where they are while a survey grows") {
  random_source random(10);
  const auto maps = maps_of_forest(170, 170, random);
  survey_options options;
  const survey free = register_survey(maps, {.reference = 0});
  for (const std::size_t m : {0u, 2u}) options.fixed.push_back({m, free.scans[m].survey_from_scan});
  const growing_survey g = grown(maps, maps.size() - 4, options);
  check_alike(g.result(), register_survey(maps, options), 0.2);
  for (const survey_options::fixed_scan& f : options.fixed)
    CHECK(g.result().scans[f.scan].survey_from_scan.matrix() == f.survey_from_scan.matrix());
  CHECK(g.result().frames.front().source == survey::frame_source::fixed);
}

}  // namespace globalmatch::test_growing_survey
