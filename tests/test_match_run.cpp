#include "match_run.hpp"

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "baseline_scenes.hpp"
#include "catch.hpp"
#include "matchers.hpp"

namespace globalmatch::test_match_run {

using namespace benchmarks;

TEST_CASE("a run that polls is stopped once its time is up, and has no transform") {
  const match_run run = run_within({.seconds = 0.001}, 0, [](const execution&) -> match_run {
    while (true) poll_cancelled();
  });
  CHECK(run.stopped);
  CHECK_FALSE(run.target_from_source);
  CHECK(run.seconds > 0);
}

TEST_CASE("a run that ends in time keeps what it made, and its stages are timed") {
  const match_run run = run_within({.seconds = 600}, 0, [](const execution& exec) {
    report_progress(exec, "one", 0);
    report_progress(exec, "another", 0);
    return match_run{.target_from_source = Eigen::Isometry3d::Identity()};
  });
  CHECK_FALSE(run.stopped);
  CHECK(run.target_from_source);
  CHECK(run.stages.contains("one"));
  CHECK(run.stages.contains("another"));
}

TEST_CASE("a run that needs more memory than is allowed is not begun") {
  bool begun = false;
  const auto match = [&](const execution&) {
    begun = true;
    return match_run{};
  };
  CHECK(run_within({.memory = 100}, 101, match).stopped);
  CHECK_FALSE(begun);
  CHECK_FALSE(run_within({.memory = 100}, 100, match).stopped);
  CHECK(begun);
}

TEST_CASE("what a run throws besides passes through") {
  CHECK_THROWS_AS(run_within({}, 0, [](const execution&) -> match_run { throw std::invalid_argument("no"); }),
                  std::invalid_argument);
}

TEST_CASE("every matcher registers a pair of equal maps, and none that is stopped has a transform") {
  const two_maps maps = scenes::equal_maps(2, 20), large = scenes::small_maps(2, 300, 0.5);
  for (const matcher& by : all_matchers()) {
    INFO(by.name);
    CHECK(scenes::is_right(by.run(maps, {}), maps));
    const match_run stopped = by.run(large, {.seconds = 1e-6});
    CHECK(stopped.stopped != stopped.target_from_source.has_value());
  }
}

TEST_CASE("the matcher of this library has the options that are given: degrees of freedom, tolerance") {
  two_maps maps = scenes::small_maps(2, 30, 1, {.noise = 0, .detected = 1, .false_stems = 0});
  double height = 0;  // else stems on level ground leave a tilt unknown
  for (Eigen::Vector3d& position : maps.source) position.z() += (height = 1.7 - height);
  const Eigen::Isometry3d tilted(Eigen::AngleAxisd(0.05, Eigen::Vector3d::UnitX()));
  for (std::size_t i = 0; i < maps.source.size(); ++i) maps.target.push_back(tilted * maps.source[i]);
  maps.target.erase(maps.target.begin(), maps.target.end() - std::ptrdiff_t(maps.source.size()));
  const auto up = [&](degrees_of_freedom dof) {
    matching_options options;
    options.dof = dof;
    options.inlier_threshold = 0.2;
    const auto found = all_matchers(options).front().run(maps, {}).target_from_source;
    REQUIRE(found);
    return Eigen::Vector3d(found->linear().col(2));
  };
  CHECK(up(degrees_of_freedom::four).isApprox(Eigen::Vector3d::UnitZ(), 1e-9));
  CHECK(up(degrees_of_freedom::six).isApprox(tilted.linear().col(2), 1e-6));
}

}  // namespace globalmatch::test_match_run
