#include "support/simulator/simulation.hpp"

#include "support/simulator/detail.hpp"

namespace globalmatch::support {
namespace {

simulation_options with_one_seed(simulation_options options) {
  options.plot.seed = options.stations.seed = options.scanner.seed = options.seed;
  return options;
}

}  // namespace

simulation_options with_carried_scanner(simulation_options options) {
  options.mobile = true;
  options.stations.clearance = 0.4;
  options.scanner.range_noise = 0.02;
  options.scanner.max_range = 30;
  options.scanner.beam_divergence = 1.5;
  return options;
}

simulation::simulation(const simulation_options& options)
    : options_(with_one_seed(options)),
      plot_(grow_plot(options_.plot)),
      stations_(place_stations(plot_, options_.stations)) {
  if (!options_.mobile) return;
  for (station& s : stations_) {
    ways_.push_back(walk_path(plot_, options_.stations, s.number, options_.way.step));
    simulator_detail::require(!ways_.back().empty(),
                              "station_options.clearance is more than this plot leaves around a way");
    s.plot_from_scan.translation() = ways_.back().front();
  }
}

simulated_scan simulation::scan(std::size_t i, const execution& exec) {
  const station& from = stations_.at(i);
  const ray_caster& caster = caster_for(from, exec);
  if (!options_.mobile) return scan_from(from, plot_, caster, options_.scanner, exec);
  return scan_along(ways_[i], from, plot_, caster, options_.scanner, options_.way, exec);
}

const ray_caster& simulation::caster_for(const station& from, const execution& exec) {
  const bool harvested = options_.plot.harvest > 0 && from.number >= options_.harvested_from;
  if (!caster_ || harvested != caster_is_harvested_) {
    caster_.reset();  // before the next one, for the sake of memory
    caster_ = std::make_unique<ray_caster>(surfaces_of(plot_, clearings(), harvested), exec);
    caster_is_harvested_ = harvested;
  }
  return *caster_;
}

std::vector<Eigen::Vector2d> simulation::clearings() const {
  std::vector<Eigen::Vector2d> places;
  for (const station& s : stations_) places.push_back(s.plot_from_scan.translation().head<2>());
  return places;
}

}  // namespace globalmatch::support
