#include "support/simulator/simulation.hpp"

#include "bare_plot.hpp"
#include "catch.hpp"
#include "support/message_of.hpp"
#include "support/simulator/scenes.hpp"
#include "support/temporary_directory.hpp"

#include <algorithm>
#include <cmath>
#include <set>

namespace globalmatch::support::test_simulation {
namespace {

using Eigen::Vector3d;

simulation_options small_simulation() {
  simulation_options o;
  o.plot.width = o.plot.depth = 24;
  o.plot.margin = 2;
  o.stations.distance = 6;
  o.scanner.angular_step = 0.4;
  return o;
}

}  // namespace

TEST_CASE("harvested stems give returns before the harvest, and none after it but from their stumps") {
  simulation_options options = small_simulation();
  options.plot.harvest = 0.4;
  simulation sim(options);
  const simulated_scan before = sim.scan(0), after = sim.scan(1);
  std::uint32_t felled_before = 0, felled_after = 0, kept_after = 0;
  for (std::size_t i = 0; i < sim.plot().stems.size(); ++i) {
    if (sim.plot().stems[i].harvested) {
      felled_before += before.returns_per_stem[i];
      felled_after += after.returns_per_stem[i];
    } else {
      kept_after += after.returns_per_stem[i];
    }
  }
  CHECK(felled_before > 500);
  CHECK(felled_after == 0);
  CHECK(kept_after > 500);

  // Where a stem stood there is something above the ground, but no longer at breast height.
  std::size_t stump = 0, at_breast_height = 0;
  for (const Vector3d& in_scan : after.points) {
    const Vector3d p = sim.stations()[1].plot_from_scan * in_scan;
    for (const stem& s : sim.plot().stems) {
      if (!s.harvested || (p - s.position).head<2>().norm() > 0.55 * s.dbh) continue;
      stump += p.z() - s.position.z() > 0.05 && p.z() - s.position.z() < 0.32;
      at_breast_height += std::abs(p.z() - s.position.z() - 1.3) < 0.3;
    }
  }
  CHECK(stump > 20);
  CHECK(at_breast_height < stump / 4);  // a branch of a neighbour may hang there
}

TEST_CASE("the station from which on the plot is harvested may be chosen") {
  simulation_options options = small_simulation();
  options.plot.harvest = 1;
  options.stations.count = 3;
  options.harvested_from = 3;
  simulation sim(options);
  const auto max_returns = [&](std::size_t i) {
    const auto returns = sim.scan(i).returns_per_stem;
    return *std::max_element(returns.begin(), returns.end());
  };
  CHECK(max_returns(1) > 100);
  CHECK(max_returns(2) == 0);
}

TEST_CASE("poses bring the scans of tilted scanners to the true ground") {
  simulation_options options = small_simulation();
  options.plot = bare_options();
  options.plot.ground.slope = 10;
  options.stations.tilt = 8;
  options.scanner = perfect_scanner(1);
  simulation sim(options);
  for (std::size_t i = 0; i < 2; ++i) {
    const simulated_scan scan = sim.scan(i);
    REQUIRE(scan.points.size() > 10000);
    double worst = 0;
    for (const Vector3d& in_scan : scan.points) {
      const Vector3d p = sim.stations()[i].plot_from_scan * in_scan;
      worst = std::max(worst, std::abs(p.z() - sim.plot().ground.height(p.x(), p.y())));
    }
    CHECK(worst < 1e-3);
  }
}

TEST_CASE("returns per stem are from 0.2 m to 3 m above the ground, and lie around the stem") {
  simulation_options options = small_simulation();
  options.plot = bare_options();
  options.plot.layout.stems_per_hectare = 400;
  options.scanner = perfect_scanner(0.3);
  simulation sim(options);
  const simulated_scan scan = sim.scan(0);
  std::vector<std::uint32_t> expected(sim.plot().stems.size());
  for (const Vector3d& in_scan : scan.points) {
    const Vector3d p = sim.stations()[0].plot_from_scan * in_scan;
    if (p.z() < 0.2 || p.z() > 3) continue;
    for (std::size_t i = 0; i < expected.size(); ++i)
      expected[i] +=
          (p - sim.plot().stems[i].position).head<2>().norm() < 0.51 * sim.plot().stems[i].dbh + 0.02;
  }
  CHECK(scan.returns_per_stem == expected);
}

TEST_CASE("a carried scanner's station is where its way starts, and it casts its rays all along the way") {
  simulation_options options = with_carried_scanner(small_simulation());
  options.way.rays_per_place = 500;
  simulation sim(options);
  const auto way = walk_path(sim.plot(), options.stations, 2, options.way.step);
  CHECK(sim.stations()[1].plot_from_scan.translation() == way.front());
  const simulated_scan scan = sim.scan(1);
  CHECK(scan.rays == way.size() * 500);
  CHECK(scan.points.size() > scan.rays / 3);
}

TEST_CASE("a carried scanner is noisier than a standing one, and sees less far") {
  simulation_options standing = small_simulation();
  standing.plot = bare_options();  // level ground: what is not at height 0 is noise
  standing.plot.width = standing.plot.depth = 24;
  standing.scanner.multipath = 0;
  simulation_options carried = with_carried_scanner(standing);
  carried.way.drift = 0;
  carried.way.rays_per_place = 50;

  const auto noise_of = [](const simulation_options& options) {
    simulation sim(options);
    const simulated_scan scan = sim.scan(0);
    double square_sum = 0;
    for (const Vector3d& p : scan.points)
      square_sum += std::pow((sim.stations()[0].plot_from_scan * p).z(), 2);
    return std::sqrt(square_sum / double(scan.points.size()));
  };
  CHECK(noise_of(carried) > 3 * noise_of(standing));

  simulation sim(carried);
  const auto way = walk_path(sim.plot(), carried.stations, 1, carried.way.step);
  const auto distance_from_way = [&](const Vector3d& in_scan) {
    const Vector3d p = sim.stations()[0].plot_from_scan * in_scan;
    double nearest = 1e9;
    for (const Vector3d& place : way) nearest = std::min(nearest, (p - place).norm());
    return nearest;
  };
  for (const Vector3d& p : sim.scan(0).points)
    if (distance_from_way(p) > 30.2) FAIL("a point is " << distance_from_way(p) << " m away from the way");
  const auto points = simulation(standing).scan(0).points;
  CHECK(std::any_of(points.begin(), points.end(), [](const Vector3d& p) { return p.norm() > 35; }));
}

TEST_CASE("the frozen scenes have names of their own, and their options are valid") {
  std::set<std::string> names;
  for (const named_scene& scene : frozen_scenes()) {
    INFO(scene.name);
    CHECK(names.insert(scene.name).second);
    CHECK(find_scene(scene.name).about == scene.about);
    CHECK(simulation(scene.options).stations().size() == 5);
  }
  for (const char* name : {"plot_1", "plot_2", "plot_3", "plot_4", "sparse_natural", "underwood", "slope_15",
                           "slope_28", "lean_12", "tilt_3", "tilt_8", "far_30", "harvest_40", "mobile"})
    CHECK(names.count(name) == 1);
  CHECK(message_of([] { find_scene("nowhere"); }).find("plot_1") != std::string::npos);
}

TEST_CASE("the paper's plots have its sizes and densities") {
  const std::vector<std::pair<const char*, double>> per_hectare = {
      {"plot_1", 1036}, {"plot_2", 1210}, {"plot_3", 433}, {"plot_4", 982}};
  for (const auto& [name, expected] : per_hectare) {
    double stems = 0, hectares = 0;
    for (const std::uint64_t seed : {1u, 2u, 101u, 102u}) {
      plot_options options = find_scene(name).options.plot;
      options.seed = seed;
      const plot scene = grow_plot(options);
      stems += double(
          std::count_if(scene.stems.begin(), scene.stems.end(), [](const stem& s) { return s.inside; }));
      hectares += options.width * options.depth / 10000;
    }
    INFO(name);
    CHECK(stems / hectares == Approx(expected).epsilon(0.05));
  }
}

TEST_CASE("docs/scenes.md holds the list of scenes word for word") {
  CHECK(bytes_of(GLOBALMATCH_SCENES_PAGE).find(scene_table()) != std::string::npos);
}

}  // namespace globalmatch::support::test_simulation
