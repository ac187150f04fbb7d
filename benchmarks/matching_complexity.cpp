// How time, memory and success of matching depend on the stems: their number, the overlap, false stems, noise
// and layout. Ours, the exact path, and the baselines, each up to the size that takes it longer than is
// allowed.
#include <globalmatch/detail/core/position_index.hpp>
#include <globalmatch/detail/core/statistics.hpp>
#include <globalmatch/detail/matching/triangle_index.hpp>
#include <globalmatch/stem_matching.hpp>

#include "growth.hpp"
#include "matchers.hpp"
#include "peak_memory.hpp"
#include "stem_layouts.hpp"
#include "support/atomic_file.hpp"
#include "support/programs/command_line.hpp"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <iostream>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

using namespace globalmatch;
using namespace globalmatch::detail;
using namespace globalmatch::benchmarks;

namespace {

/// One kind of pair of maps.
struct setting {
  std::string layout;
  std::size_t stems;
  double overlap;
  view_options view;
};

/// Whether every stem ends less than 0.3 m, or three standard deviations of the noise, from its true place.
bool is_right(const match_run& run, const two_maps& maps, double noise) {
  return run.target_from_source &&
         max_error(*run.target_from_source, maps.target_from_source, maps.source) < std::max(0.3, 3 * noise);
}

/// What came of some pairs of one kind.
struct summary {
  std::vector<double> seconds, errors;  // errors [m] of those registered
  double peak_memory = 0;               // [MB] of the worst
  matching_funnel funnel;               // of the last one
  std::size_t right = 0, wrong = 0, refused = 0;
  bool stopped = false;  // one of them, by the limits

  void add(const match_run& run, const two_maps& maps, double noise) {
    seconds.push_back(run.seconds);
    peak_memory = std::max(peak_memory, run.peak_memory);
    funnel = run.funnel;
    if (!run.target_from_source) {
      ++refused;
      return;
    }
    errors.push_back(mean_error(*run.target_from_source, maps.target_from_source, maps.source));
    ++(is_right(run, maps, noise) ? right : wrong);
  }
};

void write_run(std::ostream& csv, std::string_view matcher, const setting& s, std::size_t repetition,
               const match_run& run, const two_maps& maps) {
  const auto& f = run.funnel;
  csv << matcher << ',' << s.layout << ',' << s.stems << ',' << s.overlap << ',' << s.view.false_stems << ','
      << s.view.noise << ',' << repetition << ',' << maps.source.size() << ',' << maps.target.size() << ','
      << f.source_triangles << ',' << f.target_triangles << ',' << f.local_pairs << ',' << f.tested << ','
      << run.seconds << ',' << run.peak_memory << ',';
  if (run.target_from_source)
    csv << mean_error(*run.target_from_source, maps.target_from_source, maps.source);
  csv << ',' << is_right(run, maps, s.view.noise) << ',';
  for (const auto& [stage, seconds] : run.stages.items())
    csv << stage << ':' << seconds.template get<double>() << ';';
  csv << '\n';
}

void print(std::string_view matcher, const setting& s, summary& all) {
  std::cout << "| " << matcher << " | " << s.layout << " | " << s.stems << " | " << s.overlap << " | "
            << s.view.false_stems << " | " << s.view.noise << " | " << std::setprecision(3)
            << 1000 * median(all.seconds) << " | " << all.peak_memory << " | " << all.funnel.source_triangles
            << ", " << all.funnel.target_triangles << " | " << all.funnel.local_pairs << " | "
            << all.funnel.tested << " | " << all.right << ", " << all.wrong << ", " << all.refused << " | ";
  if (!all.errors.empty()) std::cout << 100 * median(all.errors);
  std::cout << " |\n" << std::flush;
}

void print_stopped(std::string_view matcher, const setting& s, const run_limits& limits) {
  std::cout << "| " << matcher << " | " << s.layout << " | " << s.stems << " | " << s.overlap << " | "
            << s.view.false_stems << " | " << s.view.noise << " | stopped at " << std::setprecision(3)
            << limits.seconds << " s or " << limits.memory / 1e9 << " GB | | | | | | |\n"
            << std::flush;
}

/// [GM] Eqs. (2) and (3): triangles that all triplets give, and each stem with its K nearest, beside those
/// that are distinct and those of the index.
void print_triangle_counts(const std::vector<std::string>& layouts, const std::vector<std::size_t>& sizes,
                           int threads) {
  constexpr std::size_t max_stems = 100000;
  std::cout
      << "| layout | stems N_l | N_e | N_K | built, distinct | of the index |\n|---|---|---|---|---|---|\n";
  for (const std::string& layout : layouts)
    for (const std::size_t size : sizes) {
      if (size > max_stems) continue;
      random_source random(size);
      const auto maps = overlapping_maps(layout, size, 1, {}, random);
      const position_set stems = import_positions(maps.source, Eigen::Vector3d::UnitZ(), "stems");
      const double n = double(stems.size()), k = triangle_options{}.neighbors;
      const execution exec{.threads = threads};
      const triangle_index indexed(stems, position_index(stems, exec), true, stems.size() <= 100 ? 20 : 5,
                                   exec);
      std::cout << "| " << layout << " | " << stems.size() << " | " << std::setprecision(4)
                << n * n * n / 6 - n * n / 2 + n / 3 << " | " << (k * k - k) / 2 * n << " | "
                << build_triangles(stems, false).size() << " | " << indexed.size() << " |\n";
    }
}

/// Stems of a forest around one of them.
positions cut_plot(positions forest, std::size_t stems, random_source& random) {
  const Eigen::Vector3d center = forest[random.below(static_cast<std::uint32_t>(forest.size()))];
  const auto nearer = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return (a - center).head<2>().norm() < (b - center).head<2>().norm();
  };
  stems = std::min(stems, forest.size());
  std::partial_sort(forest.begin(), forest.begin() + std::ptrdiff_t(stems), forest.end(), nearer);
  forest.resize(stems);
  return forest;
}

/// The same maps for every matcher.
summary measure(const matcher& by, const setting& s, std::size_t repetitions, const run_limits& limits,
                std::ostream& csv) {
  summary all;
  random_source random(s.stems);
  for (std::size_t r = 0; r < repetitions; ++r) {
    const two_maps maps = overlapping_maps(s.layout, s.stems, s.overlap, s.view, random);
    reset_peak_memory();
    match_run run = by.run(maps, limits);
    run.peak_memory = peak_memory();
    all.stopped = run.stopped;
    if (run.stopped) break;
    all.add(run, maps, s.view.noise);
    write_run(csv, by.name, s, r, run, maps);
  }
  return all;
}

/// Plots of so many stems, each matched against one prepared map.
summary measure_prepared(std::size_t plot_stems, const setting& s, std::size_t repetitions,
                         const run_limits& limits, std::ostream& csv) {
  summary all;
  random_source random(s.stems);
  const two_maps forest = overlapping_maps(s.layout, s.stems, 1, s.view, random);
  const prepared_map prepared =
      prepare_map(forest.target, {}, Eigen::Vector3d::UnitZ(), {.threads = limits.threads});
  for (std::size_t r = 0; r < repetitions; ++r) {
    two_maps maps;
    maps.source = cut_plot(forest.source, plot_stems, random);
    maps.target = forest.target;
    maps.target_from_source = forest.target_from_source;
    reset_peak_memory();
    match_run run = run_match_stems(maps.source, prepared, {}, limits);
    run.peak_memory = peak_memory();
    all.stopped = run.stopped;
    if (run.stopped) break;
    all.add(run, maps, s.view.noise);
    write_run(csv, "prepared", s, r, run, maps);
  }
  return all;
}

/// Names of all matchers, in their order.
std::vector<std::string> matcher_names() {
  std::vector<std::string> names;
  for (const matcher& by : all_matchers()) names.emplace_back(by.name);
  return names;
}

bool is_among(const std::vector<std::string>& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Time, memory and success of stem matching, over all combinations of what is asked for.",
               "matching_complexity");
  std::vector<std::string> matchers = {"index"}, layouts = {"random", "rows", "clumped"};
  std::vector<std::size_t> sizes = {200, 1000, 10000, 100000};
  std::vector<double> overlaps = {0.5}, false_shares = {0.1}, noises = {0.01};
  std::size_t repetitions = 5, prepared_plot = 0;
  bool triangle_counts = false;
  run_limits limits{.seconds = 60};
  std::optional<double> radius_noise;
  std::filesystem::path csv_file = "matching_complexity.csv";
  const auto list = [&](const char* name, auto& values, const char* help) {
    return app.add_option(name, values, help)->delimiter(',')->capture_default_str();
  };
  list("--matchers", matchers, "ways to match")->check(CLI::IsMember(matcher_names()));
  list("--layouts", layouts, "random, rows, clumped")->check(CLI::IsMember({"random", "rows", "clumped"}));
  list("--sizes", sizes, "stems in each map");
  list("--overlap", overlaps, "share of the area that both maps show");
  list("--false-stems", false_shares, "added to each map, as a share of its stems");
  list("--noise", noises, "of coordinates [m]");
  app.add_option("--radius-noise", radius_noise, "of radii [m]; not given: radii are not measured");
  app.add_option("--repetitions", repetitions, "random pairs of maps of each kind")->capture_default_str();
  app.add_option("--prepared", prepared_plot,
                 "match plots of so many stems against a prepared map, and time that alone");
  app.add_flag("--triangle-counts", triangle_counts, "only print the number of triangles");
  app.add_option("--time-limit", limits.seconds,
                 "seconds; a matcher that takes longer is stopped, and not tried at larger sizes")
      ->capture_default_str();
  app.add_option("--threads", limits.threads, "number of threads; 0: all")->capture_default_str();
  app.add_option("--csv", csv_file, "file with a line for each pair of maps")->capture_default_str();

  return support::run_program(app, argc, argv, [&] {
    if (triangle_counts) {
      print_triangle_counts(layouts, sizes, limits.threads);
      return support::done;
    }
    support::atomic_file csv(csv_file);
    csv.stream()
        << std::setprecision(6)
        << "matcher,layout,stems,overlap,false_stems,noise,repetition,source_stems,target_stems,"
           "source_triangles,target_triangles,local_pairs,tested,seconds,peak_mb,error,right,stages\n";
    std::cout << "| matcher | layout | stems | overlap | false | noise [m] | median [ms] | peak [MB] | N_t | "
                 "N_u | tested | right, wrong, refused | error [cm] |\n"
                 "|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";

    for (const matcher& by : all_matchers()) {
      const std::string_view name = prepared_plot > 0 ? "prepared" : by.name;
      if (prepared_plot > 0 ? by.name != "index" : !is_among(matchers, by.name)) continue;
      for (const std::string& layout : layouts)
        for (const double overlap : overlaps)
          for (const double false_stems : false_shares)
            for (const double noise : noises) {
              std::vector<std::pair<double, double>> times, memories;
              for (const std::size_t stems : sizes) {
                const setting s{layout,
                                stems,
                                overlap,
                                {.noise = noise, .false_stems = false_stems, .radius_noise = radius_noise}};
                summary all = prepared_plot > 0
                                  ? measure_prepared(prepared_plot, s, repetitions, limits, csv.stream())
                                  : measure(by, s, repetitions, limits, csv.stream());
                if (all.stopped) {
                  print_stopped(name, s, limits);
                  break;
                }
                print(name, s, all);
                times.push_back({double(stems), median(all.seconds)});
                memories.push_back({double(stems), all.peak_memory});
              }
              if (times.size() > 1)
                std::cout << "| " << name << " | " << layout << " | growth exponent | | | | "
                          << std::setprecision(3) << growth_exponent(times) << " | "
                          << growth_exponent(memories) << " | | | | | |\n";
            }
    }
    csv.commit();
    return support::done;
  });
}
