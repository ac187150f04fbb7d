// Simulates a forest plot and laser scans of it, with the truth about both.
#include "support/command_line.hpp"
#include "support/file_error.hpp"
#include "support/reports.hpp"
#include "support/scan_files.hpp"
#include "support/simulator.hpp"
#include "support/stem_files.hpp"
#include "support/transform_files.hpp"

#include <algorithm>
#include <iostream>
#include <system_error>

using namespace globalmatch;

namespace {

struct simulation_options {
  support::plot_options plot;
  support::station_options stations;
  support::scanner_options scanner;
};

void add_to(CLI::App& app, simulation_options& o) {
  const auto add = [&](const char* name, auto& field, const char* meaning) {
    app.add_option(name, field, meaning)->capture_default_str();
  };
  add("--width", o.plot.width, "of the plot along x [m]");
  add("--depth", o.plot.depth, "of the plot along y [m]");
  add("--density", o.plot.stems_per_hectare, "stems per hectare");
  add("--shrubs", o.plot.shrubs_per_hectare, "shrubs per hectare");
  add("--slope", o.plot.slope, "of the ground [deg]");
  add("--stations", o.stations.count, "number of scans");
  add("--station-distance", o.stations.distance, "of all other stations from the first [m]");
  add("--angular-step", o.scanner.angular_step, "between rays [deg]");
  add("--noise", o.scanner.range_noise, "standard deviation of ranges [m]");
  add("--seed", o.plot.seed, "of all that is random");
}

void make_folder(const std::filesystem::path& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error)
    throw support::file_error(path, "the folder cannot be made: " + error.message(),
                              "Name one that can be written.");
}

/// In the frame of the plot, with the returns that each stem got in each scan.
void write_true_stems(const std::filesystem::path& path, const support::plot& plot,
                      const std::vector<std::vector<std::uint32_t>>& returns_by_scan) {
  std::vector<support::stem_record> records;
  std::vector<support::stem_column> columns = {{"dbh", {}}};
  for (const support::simulated_stem& s : plot.stems) {
    records.push_back({s.position.x(), s.position.y(), s.position.z(), s.radius});
    columns[0].values.push_back(2 * s.radius);
  }
  for (const auto& returns : returns_by_scan)
    columns.push_back({"returns_" + std::to_string(columns.size()), {returns.begin(), returns.end()}});
  support::write_stems(path, records, columns);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Simulates a forest plot and laser scans of it. Writes scan_K.ply, pose_K.txt (plot_from_scan) and "
      "stems.csv.",
      "simulate_plot");
  std::filesystem::path out_dir;
  simulation_options options;
  support::shared_options shared;
  app.add_option("OUTDIR", out_dir, "folder for the files; made when it is missing")->required();
  add_to(app, options);
  shared.add_execution_to(app);

  return support::run_program(app, argc, argv, [&] {
    options.stations.seed = options.scanner.seed = options.plot.seed;
    support::stage_clock clock;
    const execution how = clock.listen(shared.threads);
    const support::plot plot = support::grow_plot(options.plot);
    const std::vector<support::station> stations = support::place_stations(plot, options.stations);
    report_progress(how, "plot", 1);

    make_folder(out_dir);
    nlohmann::ordered_json scans = nlohmann::ordered_json::array();
    std::vector<std::vector<std::uint32_t>> returns_by_scan;
    for (const support::station& station : stations) {
      const support::simulated_scan scan = support::scan_plot(plot, station, options.scanner, how);
      const std::string number = std::to_string(station.number);
      support::write_ply(out_dir / ("scan_" + number + ".ply"), scan.points);
      support::write_transform(out_dir / ("pose_" + number + ".txt"), station.plot_from_scan);
      report_progress(how, "write", 1);

      returns_by_scan.push_back(scan.returns_per_stem);
      const auto well_seen = std::count_if(scan.returns_per_stem.begin(), scan.returns_per_stem.end(),
                                           [](std::uint32_t returns) { return returns >= 400; });
      scans.push_back({{"rays", scan.rays}, {"points", scan.points.size()}, {"stems_well_seen", well_seen}});
      std::cout << "scan_" << number << ".ply: " << scan.points.size() << " points of " << scan.rays
                << " rays, " << well_seen << " of " << plot.stems.size()
                << " stems with 400 returns or more\n";
    }
    write_true_stems(out_dir / "stems.csv", plot, returns_by_scan);
    support::write_json(shared.json, {{"stems", plot.stems.size()},
                                      {"scans", scans},
                                      {"seconds", clock.seconds()},
                                      {"stages", clock.stages()}});
    return support::done;
  });
}
