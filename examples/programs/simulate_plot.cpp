// Simulates a forest plot and laser scans of it, with the truth about both.
#include "support/atomic_file.hpp"
#include "support/command_line.hpp"
#include "support/file_error.hpp"
#include "support/reports.hpp"
#include "support/scan_files.hpp"
#include "support/simulator/scenes.hpp"
#include "support/simulator/simulation.hpp"
#include "support/stem_files.hpp"
#include "support/transform_files.hpp"

#include <algorithm>
#include <iostream>
#include <map>
#include <system_error>

using namespace globalmatch;

namespace {

/// Options are read in this order, so a scene comes first and whatever else is given overrides it.
void add_to(CLI::App& app, support::simulation_options& o) {
  const auto add = [&](const char* name, auto& field, const char* meaning) {
    return app.add_option(name, field, meaning)->capture_default_str();
  };
  std::vector<std::string> scenes;
  for (const support::named_scene& scene : support::frozen_scenes()) scenes.push_back(scene.name);
  app.add_option_function<std::string>(
         "--scene", [&o](const std::string& name) { o = support::find_scene(name).options; },
         "one of the frozen scenes; further options override it")
      ->check(CLI::IsMember(scenes));
  app.add_flag_callback(
      "--list-scenes",
      [] {
        std::cout << support::scene_table();
        throw CLI::Success();
      },
      "print the frozen scenes and exit");
  app.add_flag_callback(
         "--mobile", [&o] { o = support::with_carried_scanner(o); },
         "carry the scanner through the plot, each station is another way; with the noise, reach and beam of "
         "scene `mobile`, unless further options override them")
      ->disable_flag_override();
  add("--width", o.plot.width, "of the plot along x [m]");
  add("--depth", o.plot.depth, "of the plot along y [m]");
  add("--margin", o.plot.margin, "of the same forest around the plot [m]");
  const std::map<std::string, support::arrangement> arrangements = {
      {"random", support::arrangement::random},
      {"clumped", support::arrangement::clumped},
      {"rows", support::arrangement::rows}};
  app.add_option("--layout", o.plot.layout.arrangement, "of the stems: random, clumped or rows")
      ->transform(CLI::CheckedTransformer(arrangements))
      ->option_text("NAME");
  add("--density", o.plot.layout.stems_per_hectare, "stems per hectare, but for rows");
  add("--row-spacing", o.plot.layout.row_spacing, "between rows [m]");
  add("--tree-spacing", o.plot.layout.tree_spacing, "along rows [m]");
  add("--row-jitter", o.plot.layout.row_jitter, "standard deviation of places in rows, along x and y [m]");
  add("--missing", o.plot.layout.missing, "share of the places in rows that are empty");
  add("--height", o.plot.trees.height, "of a tree of 20 cm [m]");
  add("--lean", o.plot.trees.lean, "detail::median lean of stems [deg]");
  add("--shrubs", o.plot.undergrowth.shrubs_per_hectare, "shrubs per hectare");
  add("--grass", o.plot.undergrowth.blades_per_square_metre, "blades of grass per square metre");
  add("--slope", o.plot.ground.slope, "of the ground [deg]");
  add("--relief", o.plot.ground.relief, "of the ground's long waves [m]");
  add("--harvest", o.plot.harvest, "share of the stems felled between scans");
  add("--harvested-from", o.harvested_from, "number of the first station after the harvest");
  add("--stations", o.stations.count, "number of scans");
  add("--station-distance", o.stations.distance, "of all other stations from the first [m]");
  add("--tilt", o.stations.tilt, "of scanners from the vertical [deg]");
  add("--angular-step", o.scanner.angular_step, "between rays [deg]");
  add("--noise", o.scanner.range_noise, "standard deviation of ranges [m]");
  add("--max-range", o.scanner.max_range, "of the scanner [m]");
  add("--seed", o.seed, "of all that is random");
}

void make_folder(const std::filesystem::path& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error)
    throw support::file_error(path, "the folder cannot be made: " + error.message(),
                              "Name one that can be written.");
}

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
  add_to(app, options);
  shared.add_execution_to(app);

  return support::run_program(app, argc, argv, [&] {
    make_folder(out_dir);
    support::require_writable({out_dir / "stems.csv", shared.json});
    support::stage_clock clock;
    const execution exec = clock.listen(shared.threads);
    support::simulation simulation(options);
    report_progress(exec, "plot", 1);

    nlohmann::ordered_json scans = nlohmann::ordered_json::array();
    std::vector<std::vector<std::uint32_t>> returns_by_scan;
    for (std::size_t i = 0; i < simulation.stations().size(); ++i) {
      const support::simulated_scan scan = simulation.scan(i, exec);
      const std::filesystem::path file = scan_file(out_dir, i + 1);
      support::write_ply(file, scan.points);
      support::write_transform(pose_file(out_dir, i + 1), simulation.stations()[i].plot_from_scan);
      report_progress(exec, "write", 1);

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
