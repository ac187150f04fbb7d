// Registers two scans of a forest plot: maps the stems of each, matches them, refines by ICP.
#include <globalmatch/registration.hpp>

#include "support/atomic_file.hpp"
#include "support/file_error.hpp"
#include "support/programs/command_line.hpp"
#include "support/programs/reports.hpp"
#include "support/programs/run_record.hpp"
#include "support/programs/scan_colours.hpp"
#include "support/report/registration_report.hpp"
#include "support/report/report_file.hpp"
#include "support/scan_files.hpp"
#include "support/scan_mapping.hpp"
#include "support/scan_writer.hpp"
#include "support/transform_forms.hpp"

#include <iostream>
#include <system_error>

using namespace globalmatch;

namespace {

/// Throws `file_error` where a scan would be replaced by what is read from it.
void require_other_file(const std::filesystem::path& path, const std::filesystem::path& scan) {
  std::error_code absent;
  if (std::filesystem::equivalent(path, support::parse_scan_name(scan).path, absent))
    throw support::file_error(path, "is one of the scans", "Name another file to write");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Registers two scans and writes the transform from source to target.", "register_scans");
  std::filesystem::path source_file, target_file, out, merged, picture;
  support::shared_options options;
  app.add_option(
         "SOURCE", source_file,
         "file of points: PLY, PCD, LAS, LAZ, E57, PTX, PTS or text; name#K: scan K of a file of several")
      ->required();
  app.add_option("TARGET", target_file, "scan to register it with")->required();
  app.add_option("--out", out, "4 x 4 matrix to write, source to target")->required()->type_name("FILE");
  app.add_option(
         "--write", merged,
         "both scans in the target's frame with their attributes: .ply (one colour each), .las or .laz")
      ->type_name("FILE");
  app.add_option(
         "--report", picture,
         "whether to trust the result, and why: a page (.html), or a drawing of both stem maps (.svg)")
      ->type_name("FILE");
  options.add_forms_to(app, true);
  options.add_mapping_to(app);
  options.add_matching_to(app);
  options.add_prior_to(app);
  options.add_icp_to(app);
  options.add_execution_to(app);

  return support::run_program(app, argc, argv, [&] {
    support::require_report_format(picture);
    support::require_writable({out, merged, picture, options.json});
    support::require_forms(options.out_as, source_file, target_file);
    support::scan_options reading = options.for_reading();
    if (!merged.empty()) {
      support::require_scan_format(merged);
      for (const auto& scan : {source_file, target_file}) require_other_file(merged, scan);
      reading.attributes = true;
    }
    const support::scan_file source = support::open_scan(source_file, reading);
    const support::scan_file target = support::open_scan(target_file, reading);
    support::stage_clock clock;
    const auto [source_map, target_map, result] =
        register_scans(source, target, {options.for_mapping(), options.for_matching(), options.for_icp()},
                       options.up_direction(), clock.listen(options.threads));
    const double seconds = clock.seconds();
    clock.leave();

    if (!merged.empty() && result.target_from_source) {
      const support::placed_scan scans[] = {
          {&target, Eigen::Isometry3d::Identity(), support::target_scan_colour},
          {&source, *result.target_from_source, support::source_scan_colour}};
      support::write_scans(merged, scans, options.threads);
    }
    auto report = support::describe(result.matching, result.target_from_source);
    report["source"] = support::describe(source_map);
    report["target"] = support::describe(target_map);
    report.update(support::describe_run(app, {argv, argv + argc}, clock));
    report["seconds"] = seconds;
    if (!options.json.empty()) report["inputs"] = support::describe_files({source_file, target_file});
    auto warnings = support::warnings_of(source_map, source, options.keep_noise);
    support::print(warnings, source_file);
    report["source"]["warnings"] = support::describe(warnings);
    warnings = support::warnings_of(target_map, target, options.keep_noise);
    support::print(warnings, target_file);
    report["target"]["warnings"] = support::describe(warnings);
    support::write_json(options.json, report);
    support::print(support::warnings_of(result.matching));
    const bool lacks_height =
        options.require_height && result.matching.vertical && !result.matching.vertical->is_known();
    if (!picture.empty()) {
      const auto [source_name, target_name] = support::names_apart(source_file, target_file);
      support::write_registration_report(picture, {source_name, source, source_map},
                                         {target_name, target, target_map}, result, options.require_height,
                                         report);
    }
    const auto trusted = lacks_height ? std::nullopt : result.target_from_source;
    support::write_or_remove_forms(options.out_as, trusted, support::first_stem(source_map.stems),
                                   source_file, std::cout,
                                   {source.header().pose.value_or(Eigen::Isometry3d::Identity()),
                                    target.header().pose.value_or(Eigen::Isometry3d::Identity())});
    support::write_or_remove_transform(out, trusted);  // last: it stands for the whole run
    const bool registered = result.outcome == outcome::registered;
    if (registered && options.dof == "4") {  // otherwise the reason says it
      support::warn_if_tilted(source_map, source_file);
      support::warn_if_tilted(target_map, target_file);
    }
    (registered ? std::cout : std::cerr) << support::summary(result.matching) << '\n';
    return registered && !lacks_height ? support::done : support::no_registration;
  });
}
