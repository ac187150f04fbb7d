// Evaluates a folder of scans whose true places are known as [GM] 5 does, in one command: tables, figures,
// and the data behind them.
#include <globalmatch/detail/core/processors.hpp>

#include "dataset/figures.hpp"
#include "dataset/find_plots.hpp"
#include "dataset/matching_tables.hpp"
#include "dataset/registration_tables.hpp"
#include "dataset/results.hpp"
#include "dataset/stored_plots.hpp"
#include "dataset/success_tables.hpp"
#ifdef GLOBALMATCH_HAS_SIMULATOR
#include "dataset/frozen_plots.hpp"
#endif
#include "support/atomic_file.hpp"
#include "support/build_record.hpp"
#include "support/programs/command_line.hpp"
#include "support/programs/near_names.hpp"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <iostream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

using namespace globalmatch;
using namespace globalmatch::benchmarks;

namespace {

struct command {
  std::filesystem::path folder, out_dir;
  bool frozen = false, list = false, no_figures = false;
  std::vector<std::string> scenes;
  std::vector<std::uint64_t> seeds = {101, 102};
  double angular_step = 0;
  std::string line;  // the command as it was given
  std::string python = GLOBALMATCH_PYTHON;
  std::vector<int> tables = {2, 3, 4, 5, 6, 7};
  dataset_options dataset;
  evaluation_options evaluation;
};

void add_dataset_options(CLI::App& app, command& c) {
  app.add_option("FOLDER", c.folder, "scans of a plot, or a subfolder for each plot");
  app.add_option("--out-dir", c.out_dir, "for tables.md, scans.csv, pairs.csv, matching.csv and figures/");
  app.add_flag("--list", c.list, "say what was found and what is missing, and end");
  app.add_option("--scans", c.dataset.scans, "files of the scans, as \"*.ply\"; relative to a plot's folder")
      ->type_name("PATTERN");
  app.add_option(
         "--pose-files", c.dataset.truth.pose_files,
         "files of 4 x 4 poses, plot from scan, as \"poses/{name}.txt\"; {number} is the one that ends "
         "the name of the scan")
      ->type_name("PATTERN");
  app.add_option("--pair-files", c.dataset.truth.pair_files,
                 "files of 4 x 4 matrices from a scan to another, as \"truth/{source}-{target}.txt\"; also "
                 "{source_number}, {target_number}")
      ->type_name("PATTERN");
  app.add_option("--truth", c.dataset.truth.table,
                 "table of matrices by scan or by pair, relative to a plot's folder")
      ->type_name("FILE");
  app.add_flag("--header-poses", c.dataset.truth.headers, "the truth is in the headers of PTX or E57 files");
  app.add_flag("--inverse-truth", c.dataset.truth.inverse,
               "matrices are scan from plot, and from target to source");
  app.add_option(
         "--stems", c.dataset.stems,
         "CSV of true stems in the frame of the plot, or with {name} or {number} in that of each scan")
      ->type_name("PATTERN");
  app.add_option("--stems-in", c.dataset.truth.root,
                 "where the truth is of pairs: the scan whose frame that of the plot is")
      ->type_name("SCAN");
  app.add_option("--middle", c.dataset.middle,
                 "scan that others are registered with; the one nearest to all others if not given")
      ->type_name("SCAN");
}

void add_evaluation_options(CLI::App& app, command& c) {
  app.add_flag("--frozen", c.frozen, "evaluate the frozen scenes of docs/scenes.md in place of a folder");
  app.add_option("--scenes", c.scenes, "of --frozen; all if not given")->delimiter(',');
  app.add_option("--seeds", c.seeds, "of the scenes")->delimiter(',')->capture_default_str();
  app.add_option("--angular-step", c.angular_step, "of the scenes, instead of their own [deg]");
  app.add_option("--tables", c.tables, "of the paper; 6 maps each scan twice, 7 runs all methods")
      ->delimiter(',')
      ->check(CLI::Range(2, 7))
      ->capture_default_str();
  app.add_option("--methods", c.evaluation.methods, "of matching alone; all if not given")->delimiter(',');
  app.add_option("--sizes", c.evaluation.sizes, "stems of simplified maps, for matching alone")
      ->delimiter(',')
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--ranges", c.evaluation.ranges,
                 "[m] around the scanners, at which maps are cut off for success against common stems")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--max-seconds", c.evaluation.max_seconds,
                 "a method is stopped then, and not run again on as many stems, or more")
      ->capture_default_str();
  app.add_option("--python", c.python, "interpreter with matplotlib that draws")->capture_default_str();
  app.add_flag("--no-figures", c.no_figures, "draw nothing");
}

void require_methods(const std::vector<std::string>& methods) {
  std::vector<std::string> names;
  for (const matcher& method : all_matchers()) names.emplace_back(method.name);
  for (const std::string& method : methods)
    if (std::find(names.begin(), names.end(), method) == names.end())
      throw std::invalid_argument("--methods: there is no " + method + ": " +
                                  support::suggest_name(method, names));
}

/// The command line and this build, then all tables.
std::string tables_of(const command& c, const dataset_results& results) {
  std::ostringstream out;
  out << "# " << (c.frozen ? "Frozen scenes" : c.folder.string())
      << ", evaluated as [GM] 5\n\n[GM] is Wang et al. (2023); rows in italics are its own, of its data. "
         "Made by "
      << support::this_build().name() << " with " << detail::thread_count({.threads = c.evaluation.threads})
      << " threads:\n\n```\n"
      << c.line << "\n```\n";
  for (const std::string& doubt : results.doubts) out << "\n**Doubtful:** " << doubt << '\n';
  registration_tables(out, results).print(c.evaluation.tables);
  if (c.evaluation.has(7)) matching_tables(out, results).print();
  success_tables(out, results).print();
  return out.str();
}

void write_files(const command& c, const dataset_results& results) {
  if (c.out_dir.empty()) return;
  const auto write = [&](const char* name, const auto& fill) {
    support::atomic_file file(c.out_dir / name);
    fill(file.stream());
    file.commit();
  };
  write("tables.md", [&](std::ostream& out) { out << tables_of(c, results); });
  write("scans.csv", [&](std::ostream& out) { write_scans(out, results.scans); });
  write("pairs.csv", [&](std::ostream& out) { write_pairs(out, results.pairs); });
  write("matching.csv", [&](std::ostream& out) { write_matchings(out, results.matchings); });
}

/// Files are written after each plot: a run may take hours.
void evaluate(const command& c, const plot_to_evaluate& plot, dataset_results& results) {
  plot_evaluation(plot, c.evaluation, results).run();
  write_files(c, results);
}

void evaluate_frozen([[maybe_unused]] const command& c, [[maybe_unused]] dataset_results& results) {
#ifdef GLOBALMATCH_HAS_SIMULATOR
  std::vector<std::string> names = c.scenes;
  if (names.empty())
    for (const auto& scene : support::frozen_scenes()) names.push_back(scene.name);
  for (const std::string& name : names) support::find_scene(name);
  for (const std::string& name : names)
    for (const std::uint64_t seed : c.seeds) {
      std::cerr << name << ", seed " << seed << '\n';
      evaluate(c, frozen_plot(name, seed, c.angular_step, c.evaluation), results);
    }
#else
  throw std::invalid_argument("--frozen needs the simulator: build with Embree (Debian: libembree-dev)");
#endif
}

void evaluate_folder(const command& c, const support::scan_options& reading, dataset_results& results) {
  const std::vector<stored_plot> plots = find_plots(c.folder, c.dataset);
  for (const stored_plot& plot : plots) {
    std::cerr << plot.name << ": " << plot.scans.size() << " scans, truth: " << plot.truth_form << '\n';
    for (const std::string& note : plot.notes) std::cerr << "  " << note << '\n';
    evaluate(c, to_evaluate(plot, reading, c.evaluation), results);
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Evaluates scans whose true places are known, as section 5 of the paper does: stem mapping, "
      "registration "
      "of all pairs, matching alone; tables.md, CSV files and figures.",
      "evaluate_dataset");
  command c;
  support::shared_options shared;
  add_dataset_options(app, c);
  add_evaluation_options(app, c);
  shared.add_mapping_to(app);
  shared.add_matching_to(app);
  shared.add_icp_to(app);
  shared.add_threads_to(app);

  return support::run_program(app, argc, argv, [&] {
    for (int i = 0; i < argc; ++i) c.line += i == 0 ? "evaluate_dataset" : std::string(" ") + argv[i];
    if (c.frozen != c.folder.empty()) throw std::invalid_argument("give a FOLDER, or --frozen");
    if (c.list && c.frozen)
      throw std::invalid_argument("--list is of a FOLDER; scenes are in docs/scenes.md");
    if (shared.tiles) throw std::invalid_argument("--tiles: join the tiles of each scan into one file");
    if (c.list) return list_plots(c.folder, c.dataset, std::cout) ? support::done : support::unusable_input;
    require_methods(c.evaluation.methods);
    if (!c.out_dir.empty()) {
      support::make_folder(c.out_dir);
      support::require_writable({c.out_dir / "tables.md"});
    }
    c.evaluation.tables = {c.tables.begin(), c.tables.end()};
    c.evaluation.mapping = shared.for_mapping();
    c.evaluation.up = shared.up_direction();
    c.evaluation.matching = shared.for_matching();
    c.evaluation.icp = shared.for_icp();
    c.evaluation.threads = shared.threads;
    std::sort(c.evaluation.sizes.begin(), c.evaluation.sizes.end());
    std::sort(c.evaluation.ranges.begin(), c.evaluation.ranges.end());
    dataset_results results;
    if (c.frozen)
      evaluate_frozen(c, results);
    else
      evaluate_folder(c, shared.for_reading(), results);
    std::cout << tables_of(c, results);
    if (!c.out_dir.empty() && !c.no_figures) draw_figures(c.python, c.out_dir);
    for (const std::string& doubt : results.doubts)
      std::cerr << "evaluate_dataset: doubtful: " << doubt << '\n';
    return results.truth_is_refuted ? support::unusable_input : support::done;
  });
}
