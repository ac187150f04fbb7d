// Surveys of made-up stations: what they cost, how many maps are placed, how many wrongly, how far stations
// are from the truth, beside full least squares with the true associations; with links made wrong on purpose.
#include <globalmatch/detail/verbs/solve_maps.hpp>
#include <globalmatch/survey.hpp>

#include "added_maps.hpp"
#include "growth.hpp"
#include "link_faults.hpp"
#include "normalised_errors.hpp"
#include "peak_memory.hpp"
#include "support/atomic_file.hpp"
#include "support/programs/command_line.hpp"
#include "support/stem_files.hpp"
#include "survey_layouts.hpp"
#include "survey_scenes.hpp"
#include "survey_scores.hpp"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <limits>
#include <map>
#include <optional>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

using namespace globalmatch;
using namespace globalmatch::detail;
using namespace globalmatch::benchmarks;

namespace {

struct parameters {
  std::vector<std::string> layouts = {"fitted"};
  std::vector<std::size_t> maps = {200};
  std::vector<std::uint64_t> seeds = {1};
  scene_options scene;
  double wrong_links = 0, coherent = 0;
  int repetitions = 1, threads = 0;
  std::size_t added = 0;
  std::filesystem::path csv = "survey_accuracy.csv", maps_folder;
};

/// CPU seconds of each stage, as the progress callback names them.
class stage_times {
 public:
  void start(std::string_view stage) {
    const double now = cpu_seconds();
    if (!stage_.empty()) seconds_[stage_] += now - since_;
    stage_ = stage;
    since_ = now;
  }
  double of(const std::string& stage) const {
    const auto found = seconds_.find(stage);
    return found == seconds_.end() ? 0 : found->second;
  }
  double total() const {
    double sum = 0;
    for (const auto& [stage, seconds] : seconds_) sum += seconds;
    return sum;
  }

 private:
  std::map<std::string, double> seconds_;
  std::string stage_;
  double since_ = 0;
};

/// A survey with what it cost.
struct survey_run {
  std::vector<prepared_stems> maps;
  local_survey local;
  survey found;
  stage_times times;
  double memory = 0;                ///< [MB]
  std::size_t tilted = 0;           ///< maps whose verticals are taken to lean: none does
  std::vector<std::size_t> misled;  ///< maps whose links were made wrong coherently
};

/// The maps as tables for the program register_survey, `LAYOUT_COUNT_SEED/mN.csv`.
void write_maps(const std::filesystem::path& folder, const std::string& layout, std::uint64_t seed,
                const std::vector<surveyed_map>& maps) {
  const auto own = folder / (layout + '_' + std::to_string(maps.size()) + '_' + std::to_string(seed));
  support::make_folder(own);
  for (std::size_t m = 0; m < maps.size(); ++m) {
    std::vector<support::stem_record> stems;
    for (const Eigen::Vector3d& p : maps[m].stems) stems.push_back({p.x(), p.y(), p.z()});
    support::write_stems(own / ("m" + std::to_string(m) + ".csv"), stems);
  }
}

/// As `register_survey`, with the links made wrong in between.
survey_run run_survey(const std::vector<surveyed_map>& maps, const parameters& given, std::uint64_t seed) {
  survey_run run;
  reset_peak_memory();
  execution exec;
  exec.threads = given.threads;
  exec.on_progress = [&](const progress& p) {
    run.times.start(p.stage);
    return true;
  };
  const parallel_scope scope(exec, "survey");
  report_progress(exec, "import", 0);
  std::vector<position_set> sets;
  for (const surveyed_map& m : maps) sets.push_back(positions_of(m.stems, "map", exec));
  run.maps = prepare_maps(std::move(sets), exec);
  const double max_log10_nfa = max_log10_nfa_of_survey({}, maps.size());
  std::optional<overlap_index> index(std::in_place, run.maps, overlap_cell, exec);
  std::vector<survey_link> links =
      find_links(run.maps, *index, max_log10_nfa, {}, run.found.candidates, exec);
  index.reset();
  report_progress(exec, "adjustment", 0);
  random_source random(seed, 1);
  if (given.wrong_links > 0) replace_links(links, run.maps, given.wrong_links, random);
  if (given.coherent > 0) run.misled = mislead_maps(links, maps.size(), given.coherent, random);
  if (given.wrong_links > 0 || given.coherent > 0) {
    keep_best_of_pairs(links);
    use_supported_links(links, maps.size(), max_log10_nfa);
  }
  run.local =
      solve_links(run.maps, std::move(links), std::numeric_limits<std::size_t>::max(), {}, max_log10_nfa);
  report_progress(exec, "verticals", 0);
  const auto verticals = tilts_of_links(run.maps, run.local.links, run.local.adjusted.poses, exec);
  run.tilted =
      std::size_t(std::ranges::count_if(find_tilts(run.local.links, verticals, run.local.placed.parts.of),
                                        [](const vec2& t) { return t.norm() > 0; }));
  report_progress(exec, "description", 0);
  describe(run.found, run.local);
  run.times.start("");
  run.memory = peak_memory();
  return run;
}

/// What became of maps whose links were made wrong coherently.
struct misled_counts {
  std::size_t right = 0, wrong = 0, ambiguous = 0, unplaced = 0;

  void add(const survey_run& run, const std::vector<bool>& is_wrong) {
    for (const std::size_t m : run.misled) {
      const survey::status status = run.found.scans[m].status;
      if (status == survey::status::placed)
        ++(is_wrong[m] ? wrong : right);
      else
        ++(status == survey::status::ambiguous ? ambiguous : unplaced);
    }
  }
};

/// All seeds of a layout and number of maps.
struct summary {
  survey_counts counts;
  misled_counts misled;
  normalised_errors normalised;
  double stems = 0, overlap = 0, total = 0, overlaps = 0, adjustment = 0, memory = 0;  // the largest of seeds
  std::vector<double> median_error, median_height, median_ratio, worst_ratio;
  station_errors worst, oracle;
};

/// Stems a map, and the median of those in common with the map that has most.
std::pair<double, double> describe_scene(const std::vector<surveyed_map>& maps) {
  double stems = 0, own = 0;
  std::vector<double> overlap;
  const auto common = stems_in_common(maps);
  for (std::size_t m = 0; m < maps.size(); ++m) {
    if (maps[m].stand != 0) continue;
    stems += double(maps[m].stems.size()), ++own;
    const std::size_t* nearest = nullptr;
    double distance = std::numeric_limits<double>::infinity();
    for (const auto& [other, count] : common[m]) {
      const double d =
          (maps[m].stand_from_scan.translation() - maps[other].stand_from_scan.translation()).norm();
      if (d < distance) distance = d, nearest = &count;
    }
    overlap.push_back(nearest ? double(*nearest) : 0);
  }
  return {stems / own, median(overlap)};
}

constexpr const char* csv_header =
    "layout,maps,seed,stems,overlap,maps_s,triangles_s,overlaps_s,adjustment_s,description_s,total_s,peak_mb,"
    "components,candidates,links,placed,reachable,reachable_placed,wrong,ambiguous,unplaced,mixed,placed_"
    "aliens,"
    "error_median,error_worst,height_median,height_worst,oracle_median,oracle_worst,oracle_height_median,"
    "oracle_height_worst\n";

void write_run(std::ostream& csv, const std::string& layout, std::uint64_t seed, const summary& all,
               const survey_run& run, const survey_score& score) {
  const stage_times& t = run.times;
  const survey_counts& c = score.counts;
  const station_errors &e = score.errors, &o = score.oracle;
  csv << layout << ',' << c.maps << ',' << seed << ',' << all.stems << ',' << all.overlap << ','
      << t.of("import") + t.of("maps") << ',' << t.of("triangles") + t.of("triangle cells") << ','
      << t.of("overlaps") << ',' << t.of("adjustment") << ',' << t.of("description") << ',' << t.total()
      << ',' << run.memory << ',' << run.found.components << ',' << run.found.candidates << ','
      << run.found.links.size() << ',' << c.placed << ',' << c.reachable << ',' << c.of_these << ','
      << c.wrong << ',' << c.ambiguous << ',' << c.unplaced << ',' << c.mixed << ',' << c.placed_aliens << ','
      << e.median << ',' << e.worst << ',' << e.height_median << ',' << e.height_worst << ',' << o.median
      << ',' << o.worst << ',' << o.height_median << ',' << o.height_worst << '\n';
}

void add_run(summary& all, const survey_run& run, const survey_score& score,
             const std::vector<surveyed_map>& maps) {
  const stage_times& t = run.times;
  all.counts.add(score.counts);
  all.misled.add(run, score.wrong);
  add_normalised_errors(run.found, run.local, maps, score.wrong, all.normalised);
  all.total = std::max(all.total, t.total());
  all.overlaps = std::max(all.overlaps, t.of("overlaps"));
  all.adjustment = std::max(all.adjustment, t.of("adjustment"));
  all.memory = std::max(all.memory, run.memory);
  const station_errors &e = score.errors, &o = score.oracle;
  all.median_error.push_back(e.median);
  all.median_height.push_back(e.height_median);
  all.median_ratio.push_back(e.median / o.median);
  all.worst_ratio.push_back(e.worst / o.worst);
  all.worst.worst = std::max(all.worst.worst, e.worst);
  all.worst.height_worst = std::max(all.worst.height_worst, e.height_worst);
  all.oracle.worst = std::max(all.oracle.worst, o.worst);
}

void print_header() {
  std::cout
      << "| layout | maps | stems a map, in common with the nearest | CPU s: total (overlaps, adjustment) "
         "| peak MB | placed | of those with 12 common stems [%] | wrong | ambiguous, unplaced | mixed "
         "| aliens placed | station error [mm]: median, worst | height [mm]: median, worst | times full "
         "least squares: median, worst | normalised errors in plan | in height | misled: right, wrong, "
         "ambiguous, unplaced |\n"
         "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
}

void print(const std::string& layout, std::size_t maps, summary& all) {
  const survey_counts& c = all.counts;
  std::cout << "| " << layout << " | " << maps << " | " << std::fixed << std::setprecision(0) << all.stems
            << ", " << all.overlap << " | " << std::setprecision(2) << all.total << " (" << all.overlaps
            << ", " << all.adjustment << ") | " << std::setprecision(0) << all.memory << " | " << c.placed
            << " of " << c.maps << " | " << std::setprecision(2)
            << 100 * double(c.of_these) / double(std::max<std::size_t>(1, c.reachable)) << " of "
            << c.reachable << " | " << c.wrong << " | " << c.ambiguous << ", " << c.unplaced << " | "
            << c.mixed << " | " << c.placed_aliens << " of " << c.aliens << " | " << std::setprecision(1)
            << 1e3 * median(all.median_error) << ", " << 1e3 * all.worst.worst << " | "
            << 1e3 * median(all.median_height) << ", " << 1e3 * all.worst.height_worst << " | "
            << std::setprecision(3) << median(all.median_ratio) << ", " << median(all.worst_ratio) << " | "
            << all.normalised << " | " << all.misled.right << ", " << all.misled.wrong << ", "
            << all.misled.ambiguous << ", " << all.misled.unplaced << " |" << std::endl;
}

/// One stand with all seeds.
summary measure(const std::string& layout, std::size_t count, const parameters& given,
                const survey_scenes& scenes, std::ostream& csv) {
  summary all;
  for (const std::uint64_t seed : given.seeds) {
    random_source random(seed);
    const std::vector<surveyed_map> maps = scenes.make(count, random);
    if (!given.maps_folder.empty()) write_maps(given.maps_folder, layout, seed, maps);
    const auto [stems, overlap] = describe_scene(maps);
    all.stems = stems, all.overlap = overlap;
    survey_run run = run_survey(maps, given, seed);
    for (int r = 1; r < given.repetitions; ++r)
      if (survey_run again = run_survey(maps, given, seed); again.times.total() < run.times.total())
        std::swap(run.times, again.times);
    const survey_score scored = score(run.found, run.local, maps, given.scene.survey.noise);
    write_run(csv, layout, seed, all, run, scored);
    add_run(all, run, scored, maps);
    if (given.added > 0) std::cout << added_maps(maps, given.added, given.threads) << '\n';
  }
  return all;
}

void print_fit(const fitted_stand& fitted) {
  std::cout << "fitted to bigwoods: " << std::setprecision(3) << 1e4 * fitted.density << " stems a hectare, "
            << 1e4 * fitted.clusters() << " clusters a hectare of " << fitted.spread
            << " m, pair correlation at 0.75 m " << fitted.kept[1] << " of that of clusters\n\n";
}

void add_options(CLI::App& app, parameters& given) {
  const auto list = [&](const char* name, auto& values, const char* help) {
    return app.add_option(name, values, help)->delimiter(',')->capture_default_str();
  };
  const auto value = [&](const char* name, auto& v, const char* help) {
    return app.add_option(name, v, help)->capture_default_str();
  };
  list("--layout", given.layouts,
       "bigwoods, plantation_utas: measured; fitted: like bigwoods; random, clumped, rows, spaced, gradient, "
       "staggered");
  list("--maps", given.maps, "in each survey, at most");
  list("--seeds", given.seeds, "of random numbers, a survey each");
  value("--aliens", given.scene.aliens, "maps from elsewhere");
  value("--data", given.scene.data, "folder of measured stem maps");
  value("--jitter", given.scene.stand.jitter, "of stems in rows [m]");
  value("--noise", given.scene.survey.noise, "of each coordinate of a stem [m]");
  value("--spacing", given.scene.survey.spacing, "of stations [m]");
  value("--wrong-links", given.wrong_links, "share of links replaced by wrong ones");
  value("--coherent", given.coherent, "share of maps half of whose links agree on a wrong place");
  value("--repetitions", given.repetitions, "of each survey; the least CPU time is reported");
  value("--threads", given.threads, "number of threads; 0: all");
  value("--add", given.added, "maps that are left out and added one by one, beside a new survey of all");
  value("--write-maps", given.maps_folder, "folder for the maps of each survey (CSV)");
  value("--csv", given.csv, "file with a line for each survey");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Accuracy and cost of surveys of made-up stations.", "survey_accuracy");
  parameters given;
  add_options(app, given);
  return support::run_program(app, argc, argv, [&] {
    support::atomic_file csv(given.csv);
    csv.stream() << std::setprecision(6) << csv_header;
    bool first = true;
    for (const std::string& layout : given.layouts) {
      given.scene.layout = layout;
      const survey_scenes scenes(given.scene);
      if (first) print_fit(scenes.fitted()), print_header();
      first = false;
      std::vector<std::pair<double, double>> times, memories;
      for (const std::size_t count : given.maps) {
        summary all = measure(layout, count, given, scenes, csv.stream());
        print(layout, count, all);
        times.push_back({double(count), all.total});
        memories.push_back({double(count), all.memory});
      }
      if (times.size() > 1)
        std::cout << "| " << layout << " | growth exponent | | " << std::setprecision(2)
                  << growth_exponent(times) << " | " << growth_exponent(memories) << " |\n";
    }
    csv.commit();
    return support::done;
  });
}
