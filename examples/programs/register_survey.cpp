// Registers any number of scans, in no order, into one frame: maps each, links those whose stems agree, and
// adjusts all together.
#include <globalmatch/survey.hpp>

#include "support/atomic_file.hpp"
#include "support/programs/reports.hpp"
#include "support/programs/run_record.hpp"
#include "support/programs/survey_command.hpp"
#include "support/programs/survey_constraints.hpp"
#include "support/programs/survey_control.hpp"
#include "support/programs/survey_files.hpp"
#include "support/programs/survey_inputs.hpp"
#include "support/programs/survey_matching.hpp"
#include "support/programs/survey_posed_files.hpp"
#include "support/programs/survey_refinement.hpp"
#include "support/programs/survey_scans.hpp"
#include "support/programs/survey_work.hpp"
#include "support/report/survey_report.hpp"
#include "support/stage_lock.hpp"

#include <iostream>
#include <optional>

using namespace globalmatch;
using json = nlohmann::ordered_json;

namespace {

/// One stage at a time of those that work in the folder of the survey; the parts of a stage are apart.
support::stage_lock lock_stage(const support::survey_command& command, const std::string& stage) {
  const std::string part = "_" + support::name_of(support::parse_part(command.part));
  return support::stage_lock(command.out_dir / (stage + (stage == "solve" ? "" : part) + ".lock"));
}

/// Refines a part of the pairs of scans that the maps place beside each other.
void refine_part(const support::survey_work& work, const support::survey_command& command,
                 const survey_options& options, const execution& exec) {
  const auto lock = lock_stage(command, "refine");
  const survey placed = solve_survey(work.maps, support::kept_matches(work, command), options, exec);
  const survey_matches::part part = support::parse_part(command.part);
  const auto pairs =
      support::refine_pairs(placed, work, command.out_dir, command.options, exec, part.number, part.count);
  std::cout << support::name_of(part) << ": " << pairs.size() << " pairs refined\n";
}

/// Places the maps, writes all results but the drawing or page, and adds what is reported of them.
survey solve_and_write(support::survey_work& work, const support::survey_command& command,
                       const support::survey_constraints& constraints, const execution& exec, json& report) {
  const auto lock = lock_stage(command, "solve");
  const survey_options options = constraints.options_for(work, command.out_dir);
  survey result = solve_survey(work.maps, support::kept_matches(work, command), options, exec);
  support::leave_out_unseen_control(result, work);
  const json control = support::report_control(result, work);
  json refinement;
  if (!command.scans.empty())
    refinement = support::refine(result, work, command.out_dir, command.options, exec);
  const std::string reference = options.reference && options.fixed.empty()
                                    ? work.names[*options.reference]
                                    : support::reference_of(result, work.names);
  support::fill_statuses(work.rows, result);
  report = support::describe(work.rows, result);
  report["reference"] = reference;
  report["targets"] = support::describe_targets(result, work.names);
  report["refinement"] = refinement;
  if (work.control) report["control"] = control;
  support::write_survey(command.out_dir, work.rows, work.names, result, report);
  support::write_placed_scans(work, command, result);
  support::write_posed_files(work, command, result);
  support::report_constraints(result, options, work);
  report["all_placed"] = support::report_unplaced(work.rows, result);
  std::cout << support::summary(work.rows, result) << '\n';
  return result;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Registers any number of scans into one frame.", "register_survey");
  support::survey_command command;
  command.add_to(app);
  return support::run_program(app, argc, argv, [&] {
    command.require_consistent();
    auto inputs = support::named_inputs(command.inputs());
    auto constraints = support::survey_constraints::read(command);
    constraints.require_names(inputs);
    support::require_posed_files(inputs, command);
    command.prepare_folder();
    support::require_writable({command.picture, command.merged, command.options.json});
    support::stage_clock clock;
    const execution exec = clock.listen(command.options.threads);

    if (command.only == "map")  // no others are read then
      inputs = support::part_of(std::move(inputs), support::parse_part(command.part));
    support::hash_inputs(inputs, support::hash_notes(command.out_dir / "hashes"));
    support::survey_work work = [&] {
      const auto lock = lock_stage(command, "map");
      return support::map_inputs(inputs, command, exec);
    }();
    if (constraints.control && command.only != "map") support::add_control(work, *constraints.control);
    json report = json::object();
    std::optional<survey> placed;
    if (command.only == "match") {
      const auto lock = lock_stage(command, "match");
      support::match_part(work, command, constraints.options_for(work, command.out_dir), exec);
    } else if (command.only == "refine") {
      refine_part(work, command, constraints.options_for(work, command.out_dir), exec);
    } else if (command.only != "map") {
      placed = solve_and_write(work, command, constraints, exec, report);
    }
    clock.leave();
    if (work.maps.empty() && !work.rows.empty()) return int(support::unusable_input);
    report.update(support::describe_run(app, {argv, argv + argc}, clock));
    report.update(support::describe_inputs(inputs, work));
    support::write_json(command.options.json, report);
    if (placed) support::write_survey_report(command, work, *placed, report);
    return int(report.value("all_placed", true) ? support::done : support::no_registration);
  });
}
