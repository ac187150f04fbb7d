// Says what scan files hold, and whether they look like scans of a forest: a line for each.
#include <globalmatch/stem_mapping.hpp>

#include "support/atomic_file.hpp"
#include "support/command_line.hpp"
#include "support/file_error.hpp"
#include "support/reports.hpp"
#include "support/scan_files.hpp"
#include "support/scan_sets.hpp"
#include "support/scan_summary.hpp"

#include <iostream>
#include <sstream>

using namespace globalmatch;
using nlohmann::ordered_json;

namespace {

ordered_json to_json(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

std::string in_metres(double length) {
  std::ostringstream text;
  text << std::round(10 * length) / 10;
  return text.str();
}

const char* describe_ground(const stem_map& map) {
  switch (map.terrain.status) {
    case ground_status::none:
      return "no ground seen";
    case ground_status::normalised:
      return "heights above the ground";
    default:
      return map.terrain.cut_off ? "ground cut off in part" : "ground seen";
  }
}

std::string one_line(const support::scan_header& header, const support::scan_summary& summary,
                     const stem_map& map) {
  std::ostringstream text;
  text << header.format << ", " << summary.points << " points";
  if (summary.points > 0) {
    const Eigen::Vector3d size = summary.extent.sizes();
    text << ", " << in_metres(size.x()) << " x " << in_metres(size.y()) << " x " << in_metres(size.z())
         << " m";
  }
  for (std::size_t r = 0; r < summary.density.size(); ++r)
    text << (r == 0 ? ", " : "/") << std::llround(summary.density[r]);
  text << " points/m2 at 5/10/20 m";
  for (std::size_t a = 0; a < header.attributes.size(); ++a)
    text << (a == 0 ? ", " : " ") << header.attributes[a];
  if (header.pose) text << ", pose in the header";
  text << ", " << describe_ground(map) << ", " << map.stems.size() << " stems";
  return text.str();
}

ordered_json to_json(const support::scan_header& header, const support::scan_summary& summary,
                     const stem_map& map) {
  ordered_json report = {{"format", header.format}, {"points", summary.points}};
  if (summary.points > 0)
    report["extent"] = {{"min", to_json(summary.extent.min())}, {"max", to_json(summary.extent.max())}};
  else
    report["extent"] = nullptr;
  report["density"] = {{"distance", support::scan_summary::distances}, {"points_per_m2", summary.density}};
  report["attributes"] = header.attributes;
  if (header.pose)
    for (int i = 0; i < 16; ++i) report["survey_from_file"].push_back(header.pose->matrix()(i / 4, i % 4));
  else
    report["survey_from_file"] = nullptr;
  report["ground"] = describe_ground(map);
  report["stems"] = map.stems.size();
  return report;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Says what scan files hold, and whether units, vertical and ground look right.", "scan_info");
  std::vector<std::filesystem::path> files;
  support::shared_options options;
  app.add_option("SCAN", files, "files of points, or folders of them; name#K: scan K of a file of several")
      ->required();
  options.add_mapping_to(app);
  options.add_execution_to(app);

  return support::run_program(app, argc, argv, [&] {
    support::require_writable({options.json});
    const Eigen::Vector3d scanner =
        options.scanner.empty() ? Eigen::Vector3d::Zero()
                                : Eigen::Vector3d(options.scanner[0], options.scanner[1], options.scanner[2]);
    ordered_json reports = ordered_json::array();
    bool all_read = true;
    for (const auto& file : options.tiles ? files : support::find_scans(files)) {
      ordered_json report = {{"path", file.string()}};
      try {  // what is wrong with one file says nothing of the others
        const support::scan_file scan = support::open_scan(file, options.for_reading());
        const support::scan_summary summary = support::summarise(scan, scanner);
        const stem_map map =
            map_stems(scan, options.for_mapping(), options.up_direction(), {.threads = options.threads});
        const auto warnings = support::warnings_of(map, scan.marked(), options.keep_noise);
        std::cout << file.string() << ": " << one_line(scan.header(), summary, map) << '\n';
        support::print(warnings, file);
        support::warn_if_tilted(map, file);
        report.update(to_json(scan.header(), summary, map));
        report["warnings"] = support::describe(warnings);
      } catch (const support::file_error& error) {
        std::cerr << error.what() << '\n';
        report["error"] = error.what();
        all_read = false;
      } catch (const std::invalid_argument& error) {
        std::cerr << file.string() << ": " << error.what() << '\n';
        report["error"] = error.what();
        all_read = false;
      }
      reports.push_back(std::move(report));
    }
    support::write_json(options.json, {{"scans", std::move(reports)}});
    return all_read ? support::done : support::unusable_input;
  });
}
