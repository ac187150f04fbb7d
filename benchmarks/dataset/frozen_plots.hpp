// The frozen scenes as plots to evaluate: without files, but with the points that files of them have.
#pragma once

#include "evaluate_plot.hpp"
#include "support/simulator/scenes.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace globalmatch::benchmarks {

/// As `simulate_plot` stores them: coordinates are floats.
inline void round_to_float(std::vector<Eigen::Vector3d>& points) {
  for (Eigen::Vector3d& p : points) p = p.cast<float>().cast<double>();
}

/// Scene `name` with this seed; `angular_step` [deg] instead of its own unless 0. Throws
/// `std::invalid_argument` when there is no such scene.
inline plot_to_evaluate frozen_plot(const std::string& name, std::uint64_t seed, double angular_step,
                                    const evaluation_options& options) {
  support::simulation_options simulated = support::find_scene(name).options;
  simulated.seed = seed;
  if (angular_step > 0) simulated.scanner.angular_step = angular_step;
  const auto plot = std::make_shared<support::simulation>(simulated);
  plot_to_evaluate result;
  result.name = name + "_" + std::to_string(seed);
  std::vector<std::optional<Eigen::Isometry3d>> poses;
  for (const support::station& station : plot->stations()) {
    poses.emplace_back(station.plot_from_scan);
    result.scans.push_back("scan_" + std::to_string(poses.size()));
  }
  result.truth = true_transforms(std::move(poses));
  result.middle = middle_scan(result.truth);
  result.map = [plot, &options](std::size_t i) {
    support::simulated_scan scan = plot->scan(i, {.threads = options.threads});
    round_to_float(scan.points);
    mapped_scan mapped = map_for_evaluation(scan.points, plot->stations()[i].plot_from_scan, options);
    mapped.stems_are_of_plot = true;
    mapped.stems = {{}, std::move(scan.returns_per_stem)};
    for (const auto& stem : plot->plot().stems) mapped.stems->positions.push_back(stem.position);
    return mapped;
  };
  return result;
}

}  // namespace globalmatch::benchmarks
