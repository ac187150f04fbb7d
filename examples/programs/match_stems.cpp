// Matches two stem maps by the relative positions of their stems.
#include <globalmatch/stem_matching.hpp>

#include "support/atomic_file.hpp"
#include "support/programs/command_line.hpp"
#include "support/programs/reports.hpp"
#include "support/programs/run_record.hpp"
#include "support/stem_files.hpp"
#include "support/transform_forms.hpp"

#include <iostream>

using namespace globalmatch;

int main(int argc, char** argv) {
  CLI::App app("Matches two stem maps and writes the transform from source to target.", "match_stems");
  std::filesystem::path source_file, target_file, out;
  support::shared_options options;
  app.add_option("SOURCE", source_file, "stem map (CSV with columns x, y and, if known, z and radius or dbh)")
      ->required();
  app.add_option("TARGET", target_file, "stem map to register it with")->required();
  app.add_option("--out", out, "4 x 4 matrix to write, source to target")->required()->type_name("FILE");
  app.add_option("--up", options.up, "direction away from the ground in both maps")
      ->delimiter(',')
      ->expected(3)
      ->type_name("X,Y,Z")
      ->capture_default_str();
  options.add_forms_to(app, false);
  options.add_matching_to(app);
  options.add_prior_to(app);
  app.add_flag(
      "--scale", options.scale,
      "multiply SOURCE by the factor that fits best, where distances differ beyond doubt: the 3 x 3 part "
      "of FILE is then a rotation times this factor");
  options.add_execution_to(app);

  return support::run_program(app, argc, argv, [&] {
    support::require_writable({out, options.json});
    support::require_forms(options.out_as, source_file, target_file);
    const auto source = support::read_stems(source_file), target = support::read_stems(target_file);
    for (const auto& [file, table] : {std::pair(source_file, source), std::pair(target_file, target)})
      support::print(support::warnings_of(table), file);
    matching_options matching_options = options.for_matching();
    if (options.dof == "6" && !(source.has_heights && target.has_heights))
      throw std::invalid_argument("--dof 6 needs a column z in both stem maps; use --dof auto");
    matching_options.horizontal |= !source.has_heights || !target.has_heights;
    support::stage_clock clock;
    const matching result = match_stems(source.stems, target.stems, matching_options, options.up_direction(),
                                        clock.listen(options.threads));
    const double seconds = clock.seconds();
    clock.leave();

    const auto target_from_source = support::with_scale(result);
    auto report = support::describe(result, target_from_source);
    report["source"] = {{"stems", source.stems.size()}};
    report["target"] = {{"stems", target.stems.size()}};
    report.update(support::describe_run(app, {argv, argv + argc}, clock));
    report["seconds"] = seconds;
    if (!options.json.empty()) report["inputs"] = support::describe_files({source_file, target_file});
    support::write_json(options.json, report);
    support::print(support::warnings_of(result));
    const bool lacks_height = options.require_height && result.vertical && !result.vertical->is_known();
    const auto trusted = lacks_height ? std::nullopt : target_from_source;
    support::write_or_remove_forms(options.out_as, trusted, support::first_stem(source.stems), source_file,
                                   std::cout);
    support::write_or_remove_transform(out, trusted);  // last: it stands for the whole run
    const bool registered = result.outcome == outcome::registered;
    (registered ? std::cout : std::cerr) << support::summary(result) << '\n';
    return registered && !lacks_height ? support::done : support::no_registration;
  });
}
