// Says what scan files hold, and whether they look like scans of a forest: a line for each.
#include <globalmatch/stem_mapping.hpp>

#include "support/atomic_file.hpp"
#include "support/file_error.hpp"
#include "support/programs/command_line.hpp"
#include "support/programs/reports.hpp"
#include "support/programs/scan_reports.hpp"
#include "support/scan_files.hpp"
#include "support/scan_mapping.hpp"
#include "support/scan_sets.hpp"
#include "support/scan_summary.hpp"

#include <iostream>
#include <optional>

using namespace globalmatch;
using nlohmann::ordered_json;

namespace {

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

// What one scan holds goes to standard output and into `report`, what looks wrong to standard error as well.
void look_at(const std::filesystem::path& file, const support::shared_options& options,
             ordered_json& report) {
  const support::scan_file scan = support::open_scan(file, options.for_reading());
  const std::optional<Eigen::Vector3d> scanner =
      options.scanner.empty() ? std::nullopt : std::optional(Eigen::Vector3d(options.scanner.data()));
  const execution exec{.threads = options.threads};
  const support::scan_summary summary = support::summarise(scan, scanner, exec);
  report.update(support::describe(scan.header(), summary));
  std::cout << file.string() << ": " << support::one_line(scan.header(), summary) << std::flush;
  std::optional<stem_map> map;
  try {
    map = map_stems(scan, options.for_mapping(), options.up_direction(), exec);
  } catch (...) {
    std::cout << '\n';
    throw;
  }
  std::cout << ", " << describe_ground(*map) << ", " << map->stems.size() << " stems\n";
  report["ground"] = describe_ground(*map);
  report["stems"] = map->stems.size();
  const auto warnings = support::warnings_of(*map, scan, options.keep_noise);
  support::print(warnings, file);
  support::warn_if_tilted(*map, file);
  report["warnings"] = support::describe(warnings);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Says what scan files hold, and whether units, vertical and ground look right.", "scan_info");
  std::vector<std::filesystem::path> names;
  support::shared_options options;
  app.add_option("SCAN", names,
                 "files of points, folders of them, patterns (*.las) or - for standard input; name#K: scan K "
                 "of a file of several")
      ->required();
  options.add_mapping_to(app);
  options.add_execution_to(app);

  return support::run_program(app, argc, argv, [&] {
    support::require_writable({options.json});
    ordered_json reports = ordered_json::array();
    bool all_read = true;
    // What is wrong with one file says nothing of the others.
    const auto attempt = [&](const std::filesystem::path& name, ordered_json& report, const auto& work) {
      const auto fail = [&](const std::string& message) {
        std::cerr << message << '\n';
        report["error"] = message;
        all_read = false;
      };
      try {
        work();
      } catch (const support::file_error& error) {
        fail(error.what());
      } catch (const std::invalid_argument& error) {
        fail(name.string() + ": " + error.what());
      }
    };
    for (const auto& name : names) {
      std::vector<std::filesystem::path> files;
      ordered_json unread = {{"path", name.string()}};
      attempt(name, unread, [&] { files = support::find_scans({name}, options.tiles); });
      if (unread.contains("error")) reports.push_back(unread);
      for (const auto& file : files) {
        ordered_json report = {{"path", file.string()}};
        attempt(file, report, [&] { look_at(file, options, report); });
        reports.push_back(std::move(report));
      }
    }
    support::write_json(options.json, {{"scans", std::move(reports)}});
    return all_read ? support::done : support::unusable_input;
  });
}
