#include "baselines/coherent_point_drift.hpp"

#include <Eigen/Geometry>

#include <cstddef>
#include <cstdint>

#include "baseline_scenes.hpp"
#include "catch.hpp"
#include "oracles/brute_force_alignment.hpp"
#include "oracles/dense_point_drift.hpp"

namespace globalmatch::test_coherent_point_drift {

using namespace benchmarks;

const auto run = [](const two_maps& maps, const run_limits& limits) {
  return run_coherent_point_drift(maps, limits);
};

Eigen::MatrixX2d in_plan(const position_set& stems) {
  Eigen::MatrixX2d points(Eigen::Index(stems.size()), 2);
  for (std::size_t i = 0; i < stems.size(); ++i)
    points.row(Eigen::Index(i)) = to_eigen(stems.at[i]).head<2>().transpose();
  return points;
}

struct drift_scene {
  explicit drift_scene(const two_maps& maps)
      : source(import_stems(maps.source, {}, "source")), target(import_stems(maps.target, {}, "target")) {}
  position_set source, target;
};

TEST_CASE("an iteration of coherent point drift is that of the paper's matrices") {
  constexpr double w = 0.3;
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const drift_scene scene(scenes::small_maps(seed, 15, 0.7));
    drift_state state{.target_from_source = {rotation_about_z(0.5), {1, -2, 0}}, .variance = 20};
    oracles::drift_step expected{Eigen::Rotation2Dd(0.5).toRotationMatrix(), {1, -2}, 20};
    for (int i = 0; i < 5; ++i) {
      INFO("seed " << seed << ", iteration " << i);
      expected = oracles::dense_drift_step(in_plan(scene.target), in_plan(scene.source), expected, w);
      const auto next =
          drift_maximization(scene.source, drift_expectation(scene.source, scene.target, state, w), 0);
      REQUIRE(next);
      state = *next;
      const Eigen::Isometry3d transform = to_eigen(state.target_from_source);
      CHECK((transform.linear().topLeftCorner<2, 2>() - expected.rotation).norm() < 1e-8);
      CHECK((transform.translation().head<2>() - expected.translation).norm() < 1e-6);
      CHECK(state.variance == Approx(expected.variance).epsilon(1e-6));
    }
  }
}

TEST_CASE("the likelihood never falls while coherent point drift iterates") {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const drift_scene scene(scenes::small_maps(seed, 20, 0.7));
    drift_state state{.variance = 50};
    for (int i = 0; i < 40; ++i) {
      INFO("seed " << seed << ", iteration " << i);
      const double before = state.negative_log_likelihood;
      const auto next =
          drift_maximization(scene.source, drift_expectation(scene.source, scene.target, state, 0.5), 1e-3);
      REQUIRE(next);
      state = *next;
      CHECK(state.negative_log_likelihood <= before + 1e-9);
    }
  }
}

TEST_CASE("coherent point drift brings as many stems together as brute force where all are common") {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    INFO("seed " << seed);
    const auto maps = scenes::small_maps(seed, 9, 1, {.detected = 1, .false_stems = 0});
    const match_run result = run(maps, {});
    REQUIRE(result.target_from_source);
    CHECK(oracles::agreeing_stems(maps.source, maps.target, *result.target_from_source, 0.1) ==
          oracles::most_agreeing_stems(maps.source, maps.target, 0.1,
                                       [](const auto&, const auto&) { return true; }));
    CHECK(scenes::is_right(result, maps));
  }
}

TEST_CASE(
    "coherent point drift registers equal maps, in any order of their stems, and bears degenerate ones") {
  scenes::require_equal_maps_register(run);
  scenes::require_order_does_not_count(run);
  scenes::require_degenerate_maps_return(run);
}

TEST_CASE("coherent point drift is stopped by its limits") {
  scenes::require_limits_stop(run, 300);
}

}  // namespace globalmatch::test_coherent_point_drift
