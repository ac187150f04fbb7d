// Surveys with targets: what the steps composed do with them.

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "catch.hpp"
#include "globalmatch/survey.hpp"
#include "survey_layouts.hpp"

namespace globalmatch::test_register_positions {

using namespace detail;

using benchmarks::plant;
using benchmarks::positions;
using benchmarks::survey_layout;
using benchmarks::surveyed_map;
using status = survey::status;

namespace {

constexpr double sigma = 0.002;  // [m] of targets

/// Stations of two forests that have no tree in common, side by side; those of the first come first.
struct two_forests {
  std::vector<surveyed_map> maps;
  std::size_t first = 0;  ///< number of the maps of the first forest

  explicit two_forests(random_source& random) {
    constexpr survey_layout precise = {.noise = 0.015};
    for (const double shift : {0.0, 60.0}) {
      const positions trees = plant("spaced", 50, 50, random);
      auto of_forest = survey_stand(trees, precise, std::numeric_limits<std::size_t>::max(), random);
      for (surveyed_map& m : of_forest) m.stand_from_scan.pretranslate(Eigen::Vector3d(shift, 0, 0));
      maps.insert(maps.end(), of_forest.begin(), of_forest.end());
      if (shift == 0) first = maps.size();
    }
  }

  std::vector<positions> stems() const {
    std::vector<positions> stems;
    for (const surveyed_map& m : maps) stems.push_back(m.stems);
    return stems;
  }
  /// A target at a place [m] of the survey, as scans within `range` [m] show it.
  void add_target(std::vector<survey_options::target>& targets, const std::string& name,
                  const Eigen::Vector3d& place, double range, random_source& random) const {
    for (std::size_t m = 0; m < maps.size(); ++m) {
      if ((maps[m].stand_from_scan.translation() - place).head<2>().norm() > range) continue;
      targets.push_back(
          {m, name, maps[m].stand_from_scan.inverse() * place + benchmarks::gaussian(random, sigma), sigma});
    }
  }
  /// Those between both forests.
  std::vector<survey_options::target> targets_between(std::size_t count, random_source& random) const {
    std::vector<survey_options::target> targets;
    for (std::size_t i = 0; i < count; ++i)
      add_target(targets, "T" + std::to_string(i), {50 + 3.0 * double(i % 2), 8 + 11.0 * double(i), 2}, 30,
                 random);
    return targets;
  }
  /// Largest error [m] of scans of one forest against those of the other, at the targets between them.
  double error_between(const survey& s) const {
    double worst = 0;
    for (std::size_t a = 0; a < first; ++a)
      for (std::size_t b = first; b < maps.size(); ++b)
        for (const survey::target& t : s.targets) {
          const auto shows = [&](std::size_t scan) {
            return std::any_of(t.seen.begin(), t.seen.end(), [&](const auto& o) { return o.scan == scan; });
          };
          if (!shows(a) || !shows(b)) continue;
          const Eigen::Vector3d in_b = s.scans[b].survey_from_scan.inverse() * t.position;
          const Eigen::Isometry3d found = s.scans[a].survey_from_scan.inverse() * s.scans[b].survey_from_scan,
                                  truth = maps[a].stand_from_scan.inverse() * maps[b].stand_from_scan;
          worst = std::max(worst, (found * in_b - truth * in_b).norm());
        }
    return worst;
  }
};

bool are_equal(const survey& a, const survey& b) {
  bool equal = a.scans.size() == b.scans.size() && a.targets.size() == b.targets.size();
  for (std::size_t m = 0; equal && m < a.scans.size(); ++m)
    equal = a.scans[m].survey_from_scan.matrix() == b.scans[m].survey_from_scan.matrix();
  for (std::size_t t = 0; equal && t < a.targets.size(); ++t)
    equal = a.targets[t].name == b.targets[t].name && a.targets[t].position == b.targets[t].position &&
            a.targets[t].sigma == b.targets[t].sigma;
  return equal;
}

}  // namespace

TEST_CASE("three targets place two groups of maps beside each other that have no tree in common") {
  random_source random(1);
  const two_forests forests(random);
  const auto stems = forests.stems();
  CHECK(register_survey(stems).components == 2);
  survey_options options;
  options.targets = forests.targets_between(3, random);
  const survey s = register_survey(stems, options);
  CHECK(s.components == 1);
  for (const survey::scan& scan : s.scans) CHECK(scan.status == status::placed);
  REQUIRE(s.targets.size() == 3);
  CHECK(forests.error_between(s) < 0.012);
  std::size_t by_targets = 0;
  for (const survey::link& l : s.links) {
    CHECK(l.log10_nfa < 0);
    by_targets += l.targets > 0;
    if (l.targets == 0) continue;
    CHECK(l.used);
    CHECK(l.correspondences == 0);
    CHECK(l.residual < 0.01);
    CHECK(l.target_from_source.matrix().allFinite());
  }
  CHECK(by_targets > 0);
  std::size_t observations = 0, left_out = 0;
  for (const survey::target& t : s.targets) {
    CHECK(t.component == 0);
    CHECK(t.sigma < 0.003);
    CHECK(t.height_sigma < 0.003);
    for (const survey::target_observation& o : t.seen) {
      CHECK(o.residual < 0.012);
      ++observations;
      left_out += std::min(o.weight, o.height_weight) < 0.1;
    }
  }
  CHECK(observations >= 8);
  CHECK(left_out <= 1);  // of errors that are Gaussian some are large
}

TEST_CASE("a target of a wrong name loses its weight, and displaces no map") {
  random_source random(2);
  const two_forests forests(random);
  survey_options options;
  options.targets = forests.targets_between(4, random);
  const auto wrong = std::find_if(options.targets.begin(), options.targets.end(),
                                  [&](const auto& t) { return t.name == "T2" && t.scan >= forests.first; });
  REQUIRE(wrong != options.targets.end());
  const std::size_t scan = wrong->scan;
  wrong->position += Eigen::Vector3d(2, -1, 0.5);
  const survey s = register_survey(forests.stems(), options);
  CHECK(s.components == 1);
  for (const survey::target& t : s.targets)
    for (const survey::target_observation& o : t.seen) {
      INFO(t.name << " of scan " << o.scan);
      const bool is_wrong = t.name == "T2" && o.scan == scan;
      CHECK((o.residual > 1) == is_wrong);
      CHECK((o.weight == 0) == is_wrong);
    }
  CHECK(forests.error_between(s) < 0.012);
}

TEST_CASE(
    "a scan whose targets contradict its stems is placed by the trees, and its targets lose their weight") {
  random_source random(7);
  const two_forests forests(random);
  std::vector<positions> stems = forests.stems();
  stems.resize(forests.first);
  survey_options options;
  for (int t = 0; t < 3; ++t)
    forests.add_target(options.targets, "T" + std::to_string(t), {15.0 + 10 * t, 20 + 8.0 * (t % 2), 2}, 100,
                       random);
  std::erase_if(options.targets, [&](const auto& t) { return t.scan >= forests.first; });
  const survey right = register_survey(stems, options);
  for (const survey::scan& scan : right.scans) CHECK(scan.status == status::placed);
  for (survey_options::target& t : options.targets)
    if (t.scan == 2) t.position += Eigen::Vector3d(3, 1, 0);
  const survey s = register_survey(stems, options);
  const Eigen::Isometry3d frame = right.scans[0].survey_from_scan * s.scans[0].survey_from_scan.inverse();
  for (std::size_t m = 0; m < stems.size(); ++m) {
    CHECK(s.scans[m].status == status::placed);
    const Eigen::Isometry3d moved =
        right.scans[m].survey_from_scan.inverse() * frame * s.scans[m].survey_from_scan;
    CHECK(moved.translation().norm() < 0.1);
  }
  std::size_t displaced = 0;
  for (const survey::target& t : s.targets)
    for (const survey::target_observation& o : t.seen)
      if (o.scan == 2) {
        CHECK(o.weight == 0);
        ++displaced;
      }
  CHECK(displaced == 3);
}

TEST_CASE("one target in common links no groups, and still counts within each") {
  random_source random(3);
  const two_forests forests(random);
  survey_options options;
  options.targets = forests.targets_between(1, random);
  const std::vector<positions> stems = forests.stems();
  const survey s = register_survey(stems, options), without = register_survey(stems);
  CHECK(s.components == 2);
  REQUIRE(s.targets.size() == 2);  // one for each component
  CHECK(s.targets[0].name == s.targets[1].name);
  CHECK(s.targets[0].component < s.targets[1].component);
  for (const survey::target& t : s.targets)
    if (t.seen.size() > 1)
      for (const survey::target_observation& o : t.seen) CHECK(o.residual < 0.01);
  for (std::size_t m = 0; m < s.scans.size(); ++m)
    CHECK(
        (s.scans[m].survey_from_scan.translation() - without.scans[m].survey_from_scan.translation()).norm() <
        0.02);
}

TEST_CASE("a scan of few stems is placed by targets, and one without stems as well") {
  random_source random(4);
  const two_forests forests(random);
  std::vector<positions> stems(forests.maps.size());
  for (std::size_t m = 0; m < forests.first; ++m) stems[m] = forests.maps[m].stems;
  survey_options options;
  options.targets = forests.targets_between(3, random);
  const survey s = register_survey(stems, options);
  std::size_t placed = 0;
  for (std::size_t m = forests.first; m < stems.size(); ++m) placed += s.scans[m].status == status::placed;
  CHECK(placed > 0);
  CHECK(forests.error_between(s) < 0.012);
}

TEST_CASE("surveys with targets are the same bits for any number of threads and order of targets") {
  random_source random(5);
  const two_forests forests(random);
  const auto stems = forests.stems();
  survey_options options;
  options.targets = forests.targets_between(3, random);
  const survey s = register_survey(stems, options, {.threads = 1});
  CHECK(are_equal(s, register_survey(stems, options, {.threads = 4})));
  std::reverse(options.targets.begin(), options.targets.end());
  CHECK(are_equal(s, register_survey(stems, options)));
  const survey_matches parts[] = {match_survey(stems, {.number = 0, .count = 1})};  // which knows no targets
  CHECK(are_equal(s, solve_survey(stems, parts, options)));
}

TEST_CASE("targets move with the frame of their component") {
  random_source random(6);
  const two_forests forests(random);
  survey_options options;
  options.targets = forests.targets_between(3, random);
  options.fixed = {{0, forests.maps[0].stand_from_scan}};
  const survey s = register_survey(forests.stems(), options);
  REQUIRE(s.targets.size() == 3);
  for (std::size_t i = 0; i < 3; ++i)
    CHECK(
        (s.targets[i].position - Eigen::Vector3d(50 + 3.0 * double(i % 2), 8 + 11.0 * double(i), 2)).norm() <
        0.05);
  options.targets[0].scan = forests.maps.size();
  CHECK_THROWS_WITH(register_survey(forests.stems(), options), Catch::Contains("targets"));
}

}  // namespace globalmatch::test_register_positions
