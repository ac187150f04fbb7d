// Finds the tree stems in a scan.
#include <globalmatch/stem_mapping.hpp>

#include "support/atomic_file.hpp"
#include "support/programs/command_line.hpp"
#include "support/programs/reports.hpp"
#include "support/programs/run_record.hpp"
#include "support/scan_files.hpp"
#include "support/scan_mapping.hpp"
#include "support/stem_files.hpp"

#include <iostream>

using namespace globalmatch;

namespace {

void write_stem_map(const std::filesystem::path& path, const stem_map& map) {
  std::vector<support::stem_record> records;
  std::vector<support::stem_column> columns = {{"axis_x", {}},       {"axis_y", {}},       {"axis_z", {}},
                                               {"taper", {}},        {"points", {}},       {"sigma_plan", {}},
                                               {"sigma_height", {}}, {"sigma_radius", {}}, {"quality", {}},
                                               {"ground_seen", {}},  {"ground_points", {}}};
  for (const stem& s : map.stems) {
    records.push_back({s.position.x(), s.position.y(), s.position.z(), s.radius});
    const double values[] = {s.axis.x(),
                             s.axis.y(),
                             s.axis.z(),
                             s.taper,
                             double(s.support.size()),
                             s.position_sigma,
                             s.height_sigma,
                             s.radius_sigma,
                             s.quality,
                             s.ground_seen ? 1.0 : 0.0,
                             double(s.ground_points)};
    for (std::size_t c = 0; c < columns.size(); ++c) columns[c].values.push_back(values[c]);
  }
  support::write_stems(path, records, columns);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Finds the tree stems in a scan: positions on the ground, radii, axes.", "map_stems");
  std::filesystem::path scan_path, out;
  support::shared_options options;
  app.add_option("SCAN", scan_path,
                 "file of points: PLY, PCD, LAS, LAZ, E57, PTX, PTS or text; name#K: scan K of a file of "
                 "several; -: standard input")
      ->required();
  app.add_option("--out", out, "stem map to write (CSV)")->required()->type_name("FILE");
  options.add_mapping_to(app);
  options.add_execution_to(app);

  return support::run_program(app, argc, argv, [&] {
    support::require_writable({out, options.json});
    const support::scan_file scan = support::open_scan(scan_path, options.for_reading());
    support::stage_clock clock;
    const stem_map map =
        map_stems(scan, options.for_mapping(), options.up_direction(), clock.listen(options.threads));
    const double seconds = clock.seconds();
    clock.leave();

    write_stem_map(out, map);
    auto report = support::describe(map);
    report.update(support::describe_run(app, {argv, argv + argc}, clock));
    report["seconds"] = seconds;
    if (!options.json.empty()) report["inputs"] = support::describe_files({scan_path});
    const auto warnings = support::warnings_of(map, scan, options.keep_noise);
    report["warnings"] = support::describe(warnings);
    support::write_json(options.json, report);
    support::print(warnings, scan_path);
    support::warn_if_tilted(map, scan_path);
    std::cout << map.stems.size() << " stems in " << report["points"] << " points\n";
    return support::done;
  });
}
