// Plot, stations and scans put together: what `simulate_plot` and the benchmarks ask for.
#pragma once

#include "support/simulator/plot.hpp"
#include "support/simulator/ray_caster.hpp"
#include "support/simulator/scanner.hpp"
#include "support/simulator/stations.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace globalmatch::support {

struct simulation_options {
  plot_options plot = {};
  station_options stations = {};
  scanner_options scanner = {};
  bool mobile = false;             ///< each station is a way through the plot, not a place
  mobile_options way = {};         ///< of mobile scanners
  std::size_t harvested_from = 2;  ///< number of the first station that sees the plot harvested
  std::uint64_t seed = 1;          ///< of all that is random; takes the place of the parts' own
};

/// The same plot seen by a scanner that is carried through it: its ranges are noisier (2 cm), its beam is
/// wider and its range shorter (30 m), and it passes stems more closely than one would put up a tripod.
simulation_options with_carried_scanner(simulation_options options);

/// A plot that is scanned station by station.
class simulation {
 public:
  /// Throws as `grow_plot` and `place_stations` do.
  explicit simulation(const simulation_options& options);

  const support::plot& plot() const { return plot_; }
  const std::vector<station>& stations() const { return stations_; }

  /// Scans from `stations()[i]`. Ask for the stations in their order: the plot is prepared again when the
  /// next one sees it harvested. Throws as `scan_from` and `scan_along` do.
  simulated_scan scan(std::size_t i, const execution& exec = {});

 private:
  const ray_caster& caster_for(const station& from, const execution& exec);
  std::vector<Eigen::Vector2d> clearings() const;

  simulation_options options_;
  support::plot plot_;
  std::vector<station> stations_;
  std::vector<std::vector<Eigen::Vector3d>> ways_;  ///< one a station, of mobile scanners
  std::unique_ptr<ray_caster> caster_;
  bool caster_is_harvested_ = false;
};

}  // namespace globalmatch::support
