// Does ICP pull scans together that see opposite sides of the stems? Two stations of a frozen scene, on
// either side of its middle: how far the source is off along the line between them, in millimetres, where a
// negative sign is towards the target; before ICP and after it, with all stems and with those alone that
// stand between the stations.
#include <globalmatch/detail/core/statistics.hpp>
#include <globalmatch/registration.hpp>

#include "support/programs/command_line.hpp"
#include "support/simulator/scenes.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iomanip>
#include <iostream>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

using namespace globalmatch;
using Eigen::Isometry3d;
using Eigen::Vector3d;

namespace {

struct mapped_station {
  Isometry3d plot_from_scan;
  stem_map map;
};

/// The angle [rad] in plan at which a place of this scan sees both scanners: pi in between.
double angle_between_scanners(const Vector3d& place, const Vector3d& other_scanner) {
  const Eigen::Vector2d to_own = -place.head<2>(), to_other = other_scanner.head<2>() - place.head<2>();
  return std::acos(std::clamp(to_own.dot(to_other) / (to_own.norm() * to_other.norm()), -1.0, 1.0));
}

/// The map with only those samples of stems that see both scanners at `min_angle` [rad] or more.
stem_map with_stems_between(stem_map map, const Vector3d& other_scanner, double min_angle) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < map.stem_samples.size(); ++i) {
    if (angle_between_scanners(map.stem_samples[i], other_scanner) < min_angle) continue;
    map.stem_samples[kept] = map.stem_samples[i];
    map.stem_normals[kept] = map.stem_normals[i];
    ++kept;
  }
  map.stem_samples.resize(kept);
  map.stem_normals.resize(kept);
  return map;
}

/// Errors [mm] of pairs: along the line between the stations and across it, horizontally.
struct signed_errors {
  std::vector<double> along, across;

  /// Half way between the stations.
  void add(const Isometry3d& target_from_source, const mapped_station& source, const mapped_station& target) {
    const Isometry3d truth = target.plot_from_scan.inverse() * source.plot_from_scan;
    const Vector3d to_source = truth.translation();  // from the target's scanner
    const Vector3d middle = truth.inverse() * (to_source / 2);
    const Vector3d off = 1000 * (target_from_source * middle - truth * middle);
    const Eigen::Vector2d line = to_source.head<2>().normalized();
    along.push_back(off.head<2>().dot(line));
    across.push_back(off.head<2>().dot(Eigen::Vector2d(-line.y(), line.x())));
  }

  /// Mean and its standard error.
  static void print(std::ostream& out, const std::vector<double>& errors) {
    const double n = double(errors.size());
    if (errors.size() < 2) {
      out << "-";
      return;
    }
    double mean = 0, squares = 0;
    for (const double e : errors) mean += e / n;
    for (const double e : errors) squares += (e - mean) * (e - mean);
    out << mean << " +- " << std::sqrt(squares / (n - 1) / n);
  }
};

std::vector<mapped_station> map_scene(const std::string& name, std::uint64_t seed, double distance,
                                      const execution& exec) {
  support::simulation_options options = support::find_scene(name).options;
  options.seed = seed;
  if (distance > 0) options.stations.distance = distance;
  support::simulation plot(options);
  std::vector<mapped_station> stations;
  for (std::size_t i = 0; i < plot.stations().size(); ++i)
    stations.push_back({plot.stations()[i].plot_from_scan,
                        map_stems(plot.scan(i, exec).points, {}, Vector3d::UnitZ(), exec)});
  return stations;
}

/// The transforms of ICP count also where `register_maps` would not take them.
struct pair_errors {
  signed_errors coarse, refined;
  std::size_t pairs = 0, refused = 0, unconverged = 0;

  void add(const mapped_station& source, const mapped_station& target, double min_angle,
           const registration_options& options, const execution& exec) {
    const Isometry3d truth = target.plot_from_scan.inverse() * source.plot_from_scan;
    const registration result =
        register_maps(with_stems_between(source.map, truth.inverse().translation(), min_angle),
                      with_stems_between(target.map, truth.translation(), min_angle), options, exec);
    ++pairs;
    if (!result.icp || !result.icp->converged) {
      ++unconverged;
      return;
    }
    refused += !result.refined;
    coarse.add(*result.matching.target_from_source, source, target);
    refined.add(result.icp->target_from_source, source, target);
  }
};

void print_row(const std::string& scene, double degrees, const pair_errors& errors) {
  std::cout << "| `" << scene << "` | " << std::fixed << std::setprecision(0) << degrees << " | "
            << errors.pairs << ", " << errors.unconverged << ", " << errors.refused << " | "
            << std::setprecision(2);
  signed_errors::print(std::cout, errors.coarse.along);
  for (const auto* of : {&errors.refined.along, &errors.refined.across}) {
    std::cout << " | ";
    signed_errors::print(std::cout, *of);
  }
  std::cout << " |\n" << std::flush;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Signed errors of scans that see opposite sides of stems, along the line between the stations.",
      "opposite_sides");
  std::vector<std::string> names = {"plot_1", "far_30"};
  std::vector<std::uint64_t> seeds = {101, 102, 103, 104, 105, 106};
  std::vector<double> angles = {0, 120, 150};
  double distance = 0;
  support::shared_options shared;
  app.add_option("--scenes", names, "names of scenes")->delimiter(',')->capture_default_str();
  app.add_option("--seeds", seeds, "of the scenes")->delimiter(',')->capture_default_str();
  app.add_option("--min-angles", angles, "at which samples of stems see both scanners [deg]")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--distance", distance, "of the stations from the middle, instead of the scenes' own [m]");
  shared.add_icp_to(app);
  shared.add_threads_to(app);

  return support::run_program(app, argc, argv, [&] {
    const execution exec{.threads = shared.threads};
    const registration_options options{.icp = shared.for_icp()};
    std::cout << "| scene | stems that see the scanners at [deg] or more | pairs, not converged, refused | "
                 "coarse, along "
                 "[mm] | after ICP, along | across |\n|---|---|---|---|---|---|\n";
    for (const std::string& name : names) {
      std::vector<pair_errors> errors(angles.size());
      for (const std::uint64_t seed : seeds) {
        const auto stations = map_scene(name, seed, distance, exec);
        const std::size_t around = stations.size() - 1;
        for (std::size_t i = 1; i <= around / 2; ++i)
          for (std::size_t a = 0; a < angles.size(); ++a)
            errors[a].add(stations[i + around / 2], stations[i], angles[a] * std::numbers::pi / 180, options,
                          exec);
      }
      for (std::size_t a = 0; a < angles.size(); ++a) print_row(name, angles[a], errors[a]);
    }
    return support::done;
  });
}
