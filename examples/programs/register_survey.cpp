// Registers any number of scans, in no order, into one frame: maps each, links those whose stems agree, and
// adjusts all together.
#include <globalmatch/survey.hpp>

#include "support/atomic_file.hpp"
#include "support/reports.hpp"
#include "support/survey_command.hpp"
#include "support/survey_constraints.hpp"
#include "support/survey_files.hpp"
#include "support/survey_inputs.hpp"
#include "support/survey_picture.hpp"
#include "support/survey_work.hpp"

#include <iostream>

using namespace globalmatch;

namespace {

/// Writes all results, and returns the exit status.
int write_results(const support::survey_command& command, support::survey_work& work, const survey& result,
                  const std::string& reference, support::stage_clock& clock) {
  support::fill_statuses(work.rows, result);
  auto report = support::describe(work.rows, result);
  report["reference"] = reference;
  report["stages"] = clock.stages();
  if (!command.picture.empty()) support::write_survey_picture(command.picture, work.rows, work.names, result);
  support::write_survey(command.out_dir, work.rows, work.names, result, report);
  const bool all_placed = support::report_unplaced(work.rows, result);
  std::cout << support::summary(work.rows, result) << '\n';
  if (work.maps.empty()) return support::unusable_input;
  return all_placed ? support::done : support::no_registration;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Registers any number of scans into one frame.", "register_survey");
  support::survey_command command;
  command.add_to(app);
  return support::run_program(app, argc, argv, [&] {
    const auto paths = command.inputs();
    const auto constraints = support::survey_constraints::read(command);
    support::make_folder(command.out_dir);
    support::require_writable({command.picture});
    support::stage_clock clock;
    const execution exec = clock.listen(command.options.threads);

    auto inputs = support::survey_inputs(paths);
    if (!command.part.empty()) inputs = support::part_of(std::move(inputs), command.part);
    support::survey_work work = support::map_inputs(inputs, command, exec);
    if (command.only == "map")
      return int(work.maps.empty() && !inputs.empty() ? support::unusable_input : support::done);

    const survey_options options = constraints.options_for(work, command.out_dir);
    survey result = register_survey(work.maps, options, exec);
    clock.leave();
    const std::string reference =
        options.reference ? work.names[*options.reference] : support::reference_of(result, work.names);
    constraints.apply_to(result, options);
    return write_results(command, work, result, reference, clock);
  });
}
