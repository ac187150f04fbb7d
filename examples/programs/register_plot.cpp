// Registers the scans of a plot with one of them; each scan is mapped once.
#include <globalmatch/registration.hpp>

#include "support/atomic_file.hpp"
#include "support/command_line.hpp"
#include "support/file_error.hpp"
#include "support/reports.hpp"
#include "support/scan_files.hpp"
#include "support/scan_sets.hpp"

#include <algorithm>
#include <iostream>
#include <optional>
#include <set>
#include <vector>

using namespace globalmatch;
namespace fs = std::filesystem;

namespace {

/// Two of the scans, and the file for the transform between them.
struct scan_pair {
  std::size_t source, target;
  fs::path transform_file;
};

/// Every scan with the first one; with `all`, every scan with every earlier one.
std::vector<scan_pair> pairs_of(const std::vector<fs::path>& scans, const fs::path& out_dir, bool all) {
  const auto name = [&](std::size_t i) { return support::name_of(scans[i]); };
  std::vector<scan_pair> pairs;
  for (std::size_t target = 0; target < (all ? scans.size() : 1); ++target)
    for (std::size_t source = target + 1; source < scans.size(); ++source) {
      const std::string on = target == 0 ? "" : "_on_" + name(target);
      pairs.push_back({source, target, out_dir / ("T_" + name(source) + on + ".txt")});
    }
  return pairs;
}

void require_distinct_names(const std::vector<fs::path>& scans, const std::vector<scan_pair>& pairs) {
  std::set<fs::path> names, transforms;
  for (const fs::path& file : scans)
    if (!names.insert(support::name_of(file)).second)
      throw support::file_error(file, "two scans have the name " + support::name_of(file),
                                "Rename one: the results are named by it");
  for (const scan_pair& pair : pairs)
    if (!transforms.insert(pair.transform_file).second)
      throw support::file_error(pair.transform_file, "two pairs of scans would write this file",
                                "Rename a scan: the results are named by them.");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Registers every source scan with the target scan; each is mapped once.", "register_plot");
  fs::path target_file, out_dir;
  std::vector<fs::path> scan_files;
  bool all_pairs = false;
  support::shared_options options;
  app.add_option("TARGET", target_file,
                 "scan whose frame is that of the results; name#K: scan K of a file of several")
      ->required();
  app.add_option("SOURCE", scan_files, "scans to register with it, folders of them, or patterns (*.las)")
      ->required();
  app.add_option("--out-dir", out_dir, "folder for T_<source name>.txt, one for each source")
      ->required()
      ->type_name("DIR");
  app.add_flag("--all-pairs", all_pairs,
               "register every source with every scan named before it, too: T_<source>_on_<target>.txt");
  options.add_mapping_to(app);
  options.add_matching_to(app);
  options.add_icp_to(app);
  options.add_execution_to(app);

  return support::run_program(app, argc, argv, [&] {
    scan_files = support::find_scans(scan_files, options.tiles);
    std::erase_if(scan_files, [&](const fs::path& scan) { return support::is_same_scan(scan, target_file); });
    if (scan_files.empty())
      throw std::invalid_argument("SOURCE: no scan besides TARGET: name others, or a folder of them");
    scan_files.insert(scan_files.begin(), target_file);
    const std::vector<scan_pair> pairs = pairs_of(scan_files, out_dir, all_pairs);
    require_distinct_names(scan_files, pairs);
    support::make_folder(out_dir);
    support::require_writable({options.json});
    for (const scan_pair& pair : pairs) support::require_writable({pair.transform_file});

    const registration_options library_options = {options.for_mapping(), options.for_matching(),
                                                  options.for_icp()};
    require_valid(library_options.matching);  // before the scans are mapped, not after
    support::stage_clock clock;
    const execution exec = clock.listen(options.threads);
    double seconds = 0;
    const auto timed = [&](const auto& work) {
      const double before = clock.seconds();
      auto result = work();
      clock.leave();
      seconds += clock.seconds() - before;
      return result;
    };

    std::vector<stem_map> maps;
    nlohmann::ordered_json scan_reports = nlohmann::ordered_json::array();
    for (const fs::path& file : scan_files) {
      const support::scan_file scan = support::open_scan(file, options.for_reading());
      maps.push_back(
          timed([&] { return map_stems(scan, library_options.mapping, options.up_direction(), exec); }));
      scan_reports.push_back(support::describe(maps.back()));
      if (options.dof == "4") support::warn_if_tilted(maps.back(), file);
    }

    nlohmann::ordered_json pair_reports = nlohmann::ordered_json::array();
    std::vector<std::optional<Eigen::Isometry3d>> transforms;
    for (const scan_pair& pair : pairs) {
      const registration result =
          timed([&] { return register_maps(maps[pair.source], maps[pair.target], library_options, exec); });
      transforms.push_back(result.target_from_source);
      auto report = support::describe(result.matching, result.target_from_source);
      report["name"] = support::name_of(scan_files[pair.source]);
      report["target_name"] = support::name_of(scan_files[pair.target]);
      report["source"] = scan_reports[pair.source];
      pair_reports.push_back(std::move(report));
      std::ostream& out = result.target_from_source ? std::cout : std::cerr;
      out << scan_files[pair.source].filename().string() << " on "
          << scan_files[pair.target].filename().string() << ": " << support::summary(result.matching) << '\n';
      support::print(support::warnings_of(result.matching));
    }
    // At the end, so that an unreadable scan leaves all old results in place.
    for (std::size_t i = 0; i < pairs.size(); ++i)
      support::write_or_remove_transform(pairs[i].transform_file, transforms[i]);
    support::write_json(options.json, {{"target", scan_reports.front()},
                                       {"pairs", std::move(pair_reports)},
                                       {"seconds", seconds},
                                       {"stages", clock.stages()}});
    const bool all_registered = std::all_of(transforms.begin(), transforms.end(),
                                            [](const auto& transform) { return transform.has_value(); });
    return all_registered ? support::done : support::no_registration;
  });
}
