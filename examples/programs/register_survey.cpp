// Registers any number of scans, in no order, into one frame: maps each, links those whose stems agree,
// adjusts all together, and refines them by samples of ground and stems.
#include <globalmatch/survey.hpp>

#include "support/atomic_file.hpp"
#include "support/command_line.hpp"
#include "support/reports.hpp"
#include "support/scan_sets.hpp"
#include "support/survey_files.hpp"
#include "support/survey_inputs.hpp"
#include "support/survey_maps.hpp"
#include "support/survey_picture.hpp"
#include "support/survey_refinement.hpp"
#include "support/transform_files.hpp"

#include <algorithm>
#include <iostream>
#include <optional>
#include <vector>

using namespace globalmatch;
namespace fs = std::filesystem;

namespace {

/// A scan whose place in the survey's frame is known.
struct fixed_scan {
  std::string name;
  Eigen::Isometry3d survey_from_scan;
};

std::optional<fixed_scan> read_fixed(const std::string& given) {
  if (given.empty()) return std::nullopt;
  const std::size_t equals = given.rfind('=');
  if (equals == std::string::npos || equals == 0)
    throw std::invalid_argument("--fix " + given + ": NAME=T.txt is needed, the scan's name and its matrix");
  return fixed_scan{given.substr(0, equals), support::read_transform(given.substr(equals + 1))};
}

/// The maps of a survey, and what becomes of all its inputs.
struct survey_work {
  std::vector<support::survey_row> rows;  // of all inputs
  std::vector<std::string> names;         // of those with maps
  std::vector<stem_map> maps;

  void add(const support::survey_input& input, support::survey_map mapped) {
    if (input.same_as) {
      rows.push_back({input.name, "unplaced", "same as " + *input.same_as, {}});
    } else if (!mapped.error.empty()) {
      rows.push_back({input.name, "unreadable", mapped.error, {}});
    } else {
      std::cout << input.name << ": " << mapped.map.stems.size() << " stems"
                << (mapped.was_kept ? ", mapped before\n" : "\n");
      rows.push_back({input.name, "", "", maps.size()});
      names.push_back(input.name);
      maps.push_back(std::move(mapped.map));
    }
  }
};

std::optional<std::size_t> index_of(const std::vector<std::string>& names, const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) return std::nullopt;
  return std::size_t(found - names.begin());
}

/// Registers, writes all results, and returns the exit status. `refinement`: null for maps without samples.
int register_and_write(survey_work& work, const fs::path& out_dir, const fs::path& picture,
                       const std::optional<fixed_scan>& fixed, const support::shared_options* refinement,
                       support::stage_clock& clock, const execution& exec) {
  survey_options options{.reference =
                             index_of(work.names, support::recorded_reference(out_dir / "survey.json"))};
  if (fixed) {
    options.reference = index_of(work.names, fixed->name);
    if (!options.reference)
      throw std::invalid_argument("--fix " + fixed->name + ": no scan of that name was mapped");
  }
  survey result = register_survey(work.maps, options, exec);
  nlohmann::ordered_json refined;
  if (refinement) refined = support::refine(result, work.names, out_dir, *refinement, exec);
  clock.leave();
  const std::string reference =
      options.reference ? work.names[*options.reference] : support::reference_of(result, work.names);
  if (fixed)
    support::transform_survey(result, result.scans[*options.reference].component, fixed->survey_from_scan);
  support::fill_statuses(work.rows, result);
  auto report = support::describe(work.rows, result);
  report["reference"] = reference;
  report["refinement"] = refined;
  report["stages"] = clock.stages();
  if (!picture.empty()) support::write_survey_picture(picture, work.rows, work.names, result);
  support::write_survey(out_dir, work.rows, work.names, result, report);
  const bool all_placed = support::report_unplaced(work.rows, result);
  std::cout << support::summary(work.rows, result) << '\n';
  if (work.maps.empty()) return support::unusable_input;
  return all_placed ? support::done : support::no_registration;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Registers any number of scans into one frame.", "register_survey");
  std::vector<fs::path> scans, stem_maps;
  fs::path out_dir, picture;
  std::string fix, only, part;
  support::shared_options options;
  auto* scans_given =
      app.add_option("SCAN", scans, "scans, or folders of them; name#K: scan K of a file of several");
  auto* maps_given = app.add_option("--stem-maps", stem_maps, "stem maps (CSV) in place of scans")
                         ->excludes(scans_given)
                         ->type_name("CSV");
  app.add_option("--out-dir", out_dir, "folder for poses.csv, links.csv, trees.csv, T_<scan>.txt, maps/")
      ->required()
      ->type_name("DIR");
  app.add_option("--fix", fix, "a scan whose matrix survey_from_scan is known")->type_name("NAME=T.txt");
  auto* mapping_only = app.add_option("--only", only, "map: map the scans, and register them another time")
                           ->check(CLI::IsMember({"map"}));
  app.add_option("--part", part, "with --only map: every N-th of the scans, to be shared out over machines")
      ->needs(mapping_only)
      ->excludes(maps_given)
      ->type_name("I/N");
  app.add_option("--report", picture, "drawing of scans, links and trees (SVG)")->type_name("FILE");
  options.add_mapping_to(app);
  options.add_icp_to(app);
  options.add_threads_to(app);

  return support::run_program(app, argc, argv, [&] {
    if (scans.empty() && stem_maps.empty())
      throw std::invalid_argument("SCAN: name scans, a folder of them, or --stem-maps");
    const std::optional<fixed_scan> fixed = read_fixed(fix);
    support::make_folder(out_dir);
    support::require_writable({picture});
    support::stage_clock clock;
    const execution exec = clock.listen(options.threads);
    auto inputs =
        support::survey_inputs(scans.empty() ? stem_maps : support::find_scans(scans, options.tiles));
    if (!part.empty()) inputs = support::part_of(std::move(inputs), part);
    survey_work work;
    if (scans.empty()) {
      for (const support::survey_input& input : inputs) work.add(input, support::read_positions(input));
    } else {
      const support::survey_mapper mapper(out_dir / "maps", options);
      for (const support::survey_input& input : inputs) work.add(input, mapper.map(input, exec));
    }
    if (only != "map")
      return register_and_write(work, out_dir, picture, fixed, scans.empty() ? nullptr : &options, clock,
                                exec);
    return int(work.maps.empty() && !inputs.empty() ? support::unusable_input : support::done);
  });
}
