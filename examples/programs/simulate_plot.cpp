// Simulates a forest plot and laser scans of it, with the truth about both.
#include "support/atomic_file.hpp"
#include "support/file_error.hpp"
#include "support/programs/command_line.hpp"
#include "support/programs/reports.hpp"
#include "support/scan_files.hpp"
#include "support/simulator/simulation.hpp"
#include "support/simulator/simulation_options.hpp"
#include "support/stem_files.hpp"
#include "support/transform_files.hpp"

#include <algorithm>
#include <iostream>
#include <system_error>

using namespace globalmatch;

namespace {

std::filesystem::path scan_file(const std::filesystem::path& folder, std::size_t number) {
  return folder / ("scan_" + std::to_string(number) + ".ply");
}

std::filesystem::path pose_file(const std::filesystem::path& folder, std::size_t number) {
  return folder / ("pose_" + std::to_string(number) + ".txt");
}

/// An earlier run may have had more stations: its further scans would pass for scans of this plot.
void remove_scans_beyond(std::size_t count, const std::filesystem::path& folder) {
  const auto remove = [](const std::filesystem::path& path) {
    std::error_code absent, error;
    if (!std::filesystem::is_regular_file(path, absent)) return false;
    std::filesystem::remove(path, error);
    if (error)
      throw support::file_error(path, "an earlier run's file cannot be removed: " + error.message(),
                                "Remove it by hand: it is not of this plot.");
    std::cout << path.filename().string() << " of an earlier run: removed\n";
    return true;
  };
  for (std::size_t number = count + 1;; ++number) {
    const bool had_scan = remove(scan_file(folder, number)), had_pose = remove(pose_file(folder, number));
    if (!had_scan && !had_pose) return;
  }
}

/// In the frame of the plot, with the returns that each stem got in each scan.
void write_true_stems(const std::filesystem::path& path, const support::plot& plot,
                      const std::vector<std::vector<std::uint32_t>>& returns_by_scan) {
  std::vector<support::stem_record> records;
  support::stem_column dbh = {"dbh", {}}, inside = {"inside", {}}, harvested = {"harvested", {}};
  for (const support::stem& s : plot.stems) {
    records.push_back({s.position.x(), s.position.y(), s.position.z(), 0.5 * s.dbh});
    dbh.values.push_back(s.dbh);
    inside.values.push_back(s.inside);
    harvested.values.push_back(s.harvested);
  }
  std::vector<support::stem_column> columns = {dbh, inside, harvested};
  for (std::size_t i = 0; i < returns_by_scan.size(); ++i)
    columns.push_back(
        {"returns_" + std::to_string(i + 1), {returns_by_scan[i].begin(), returns_by_scan[i].end()}});
  support::write_stems(path, records, columns);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Simulates a forest plot and laser scans of it. Writes scan_K.ply, pose_K.txt (plot_from_scan) and "
      "stems.csv; removes scans and poses of an earlier run that had more stations.",
      "simulate_plot");
  std::filesystem::path out_dir;
  support::simulation_options options;
  support::shared_options shared;
  app.add_option("OUTDIR", out_dir, "folder for the files; made when it is missing")->required();
  support::add_simulation_options(app, options);
  shared.add_execution_to(app);

  return support::run_program(app, argc, argv, [&] {
    support::make_folder(out_dir);
    support::require_writable({out_dir / "stems.csv", shared.json});
    support::stage_clock clock;
    const execution exec = clock.listen(shared.threads);
    support::simulation simulation(options);
    exec.on_progress({"plot", 1});

    nlohmann::ordered_json scans = nlohmann::ordered_json::array();
    std::vector<std::vector<std::uint32_t>> returns_by_scan;
    for (std::size_t i = 0; i < simulation.stations().size(); ++i) {
      const support::simulated_scan scan = simulation.scan(i, exec);
      const std::filesystem::path file = scan_file(out_dir, i + 1);
      support::write_ply(file, scan.points);
      support::write_transform(pose_file(out_dir, i + 1), simulation.stations()[i].plot_from_scan);
      exec.on_progress({"write", 1});

      returns_by_scan.push_back(scan.returns_per_stem);
      const auto well_seen = std::count_if(scan.returns_per_stem.begin(), scan.returns_per_stem.end(),
                                           [](std::uint32_t returns) { return returns >= 400; });
      scans.push_back({{"rays", scan.rays}, {"points", scan.points.size()}, {"stems_well_seen", well_seen}});
      std::cout << file.filename().string() << ": " << scan.points.size() << " points of " << scan.rays
                << " rays, " << well_seen << " of " << scan.returns_per_stem.size()
                << " stems with 400 returns or more\n";
    }
    remove_scans_beyond(returns_by_scan.size(), out_dir);
    write_true_stems(out_dir / "stems.csv", simulation.plot(), returns_by_scan);
    support::write_json(shared.json, {{"stems", simulation.plot().stems.size()},
                                      {"scans", scans},
                                      {"seconds", clock.seconds()},
                                      {"stages", clock.stages()}});
    return support::done;
  });
}
