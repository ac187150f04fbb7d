// Registers the scans of a whole plot on one of them; each scan is mapped once.
#include <globalmatch/registration.hpp>

#include "support/atomic_file.hpp"
#include "support/command_line.hpp"
#include "support/file_error.hpp"
#include "support/reports.hpp"
#include "support/scan_files.hpp"

#include <algorithm>
#include <iostream>
#include <optional>
#include <set>
#include <vector>

using namespace globalmatch;

int main(int argc, char** argv) {
  CLI::App app("Lays every source scan on the target scan; each is mapped once.", "register_plot");
  std::filesystem::path target_file, out_dir;
  std::vector<std::filesystem::path> source_files;
  support::shared_options options;
  app.add_option("TARGET", target_file, "scan to lay the others on")->required();
  app.add_option("SOURCE", source_files, "scans to lay on it")->required();
  app.add_option("--out-dir", out_dir, "folder for T_<source name>.txt, one for each source")
      ->required()
      ->type_name("DIR");
  options.add_mapping_to(app);
  options.add_matching_to(app);
  options.add_icp_to(app);
  options.add_execution_to(app);

  return support::run_program(app, argc, argv, [&] {
    std::set<std::filesystem::path> names;
    for (const auto& file : source_files)
      if (!names.insert(file.stem()).second)
        throw support::file_error(file, "two sources have this name",
                                  "Rename one: the results are named by it.");
    std::error_code error;
    std::filesystem::create_directories(out_dir, error);
    if (error)
      throw support::file_error(out_dir, "the folder cannot be made", "Name one that can be written.");

    const auto transform_of = [&](const std::filesystem::path& file) {
      return out_dir / ("T_" + file.stem().string() + ".txt");
    };
    support::require_writable({options.json});
    for (const auto& file : source_files) support::require_writable({transform_of(file)});

    const registration_options library_options = {options.for_mapping(), options.for_matching(),
                                                  options.for_icp()};
    support::stage_clock clock;
    const execution how = clock.listen(options.threads);
    double seconds = 0;
    const auto timed = [&](const auto& work) {
      const double before = clock.seconds();
      auto result = work();
      clock.leave();
      seconds += clock.seconds() - before;
      return result;
    };
    const auto map_file = [&](const std::filesystem::path& file) {
      const auto scan = support::read_scan(file);
      return timed([&] { return map_stems(scan, library_options.mapping, options.up_direction(), how); });
    };

    const stem_map target = map_file(target_file);
    nlohmann::ordered_json pairs = nlohmann::ordered_json::array();
    std::vector<std::optional<Eigen::Isometry3d>> transforms;
    for (const auto& file : source_files) {
      const stem_map source = map_file(file);
      const registration result = timed([&] { return register_maps(source, target, library_options, how); });
      transforms.push_back(result.target_from_source);
      auto pair = support::describe(result.matching, result.target_from_source);
      pair["name"] = file.stem().string();
      pair["source"] = support::describe(source);
      pairs.push_back(std::move(pair));
      const bool registered = result.outcome == outcome::registered;
      (registered ? std::cout : std::cerr)
          << file.filename().string() << ": " << support::summary(result.matching) << '\n';
    }
    support::write_json(options.json, {{"target", support::describe(target)},
                                       {"pairs", std::move(pairs)},
                                       {"seconds", seconds},
                                       {"stages", clock.stages()}});
    // Last, so that an unreadable scan leaves all old results in place.
    for (std::size_t i = 0; i < transforms.size(); ++i)
      support::write_or_remove_transform(transform_of(source_files[i]), transforms[i]);
    const bool all_registered = std::all_of(transforms.begin(), transforms.end(),
                                            [](const auto& transform) { return transform.has_value(); });
    return all_registered ? support::done : support::no_registration;
  });
}
