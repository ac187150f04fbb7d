// How often are maps registered that have nothing in common, and how often those that do, by the limit on the
// number of false alarms? Unrelated maps are of kinds that stem maps really are of.
#include <globalmatch/stem_matching.hpp>

#include "map_windows.hpp"
#include "stem_layouts.hpp"
#include "support/atomic_file.hpp"
#include "support/programs/command_line.hpp"
#include "support/programs/reports.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <iostream>
#include <limits>
#include <numbers>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

using namespace globalmatch;
using namespace globalmatch::detail;
using namespace globalmatch::benchmarks;

namespace {

constexpr double limits[] = {1e-3, 1e-4, 1e-5, 1e-6};

/// As many maps in each octave of stems.
unrelated of_rows(random_source& random, std::size_t min_stems, std::size_t max_stems, const relief& a,
                  const relief& b) {
  const double jitter = uniform(random, 0.05, 0.2), octaves = random.uniform();
  const auto stems =
      std::size_t(std::round(double(min_stems) * std::pow(double(max_stems) / double(min_stems), octaves)));
  const view_options noisy{.noise = any_of<double>({0.02, 0.1}, random)};
  return {overlapping_maps("rows", stems, 1, noisy, random, {.jitter = jitter, .ground = a}).source,
          overlapping_maps("rows", stems, 1, noisy, random, {.jitter = jitter, .ground = b}).target};
}

relief any_ground(random_source& random) {
  return {uniform(random, 10, 30), uniform(random, 10, 30), uniform(random, -3, 3), uniform(random, -3, 3)};
}

/// Noted in steps along both axes.
void round_to(positions& stems, double step) {
  for (Eigen::Vector3d& p : stems)
    for (int axis = 0; axis < 2; ++axis) p[axis] = step * std::round(p[axis] / step);
}

/// Noted in steps of an angle and of a distance from the middle, as by compass and tape, and written to the
/// centimetre.
void round_polar(positions& stems, double angle, double step) {
  for (Eigen::Vector3d& p : stems) {
    const double direction = angle * std::round(std::atan2(p.y(), p.x()) / angle),
                 distance = step * std::round(p.head<2>().norm() / step);
    p.x() = distance * std::cos(direction);
    p.y() = distance * std::sin(direction);
  }
  round_to(stems, 0.01);
}

void list_twice(positions& stems, double apart, random_source& random) {
  const std::size_t size = stems.size();
  for (std::size_t i = 0; i < size; ++i) stems.push_back(stems[i] + gaussian(random, apart));
}

struct kind {
  std::string_view name;
  std::function<unrelated(random_source&)> next;
};

std::vector<kind> kinds_of(const window_source& windows, std::size_t max_stems) {
  return {
      {"windows", [&windows](random_source& random) { return windows.pair(random); }},
      {"rows",
       [=](random_source& random) {
         return of_rows(random, 20, max_stems, any_ground(random), any_ground(random));
       }},
      {"few in rows",
       [](random_source& random) { return of_rows(random, 4, 20, any_ground(random), any_ground(random)); }},
      {"rows on equal ground", [=](random_source& random) { return of_rows(random, 20, max_stems, {}, {}); }},
      {"rounded",
       [&windows](random_source& random) {
         unrelated pair = windows.pair(random);
         const double step = any_of<double>({0.1, 0.25, 0.5, 1}, random);
         round_to(pair.source, step);
         round_to(pair.target, step);
         return pair;
       }},
      {"polar",
       [&windows](random_source& random) {
         unrelated pair = windows.pair(random);
         const double angle = any_of<double>({1, 2, 5}, random) * std::numbers::pi / 180,
                      step = any_of<double>({0.1, 0.5}, random);
         Eigen::Vector3d middle = Eigen::Vector3d::Zero();
         for (const Eigen::Vector3d& p : pair.target) middle += p / double(pair.target.size());
         for (Eigen::Vector3d& p : pair.target) p -= middle;
         round_polar(pair.source, angle, step);
         round_polar(pair.target, angle, step);
         return pair;
       }},
      {"mirrored",
       [&windows](random_source& random) {
         unrelated pair = windows.same(random);
         for (Eigen::Vector3d& p : pair.target) std::swap(p.x(), p.y());
         return pair;
       }},
      {"listed twice",
       [&windows](random_source& random) {
         unrelated pair = windows.pair(random);
         const double apart = any_of<double>({0, 0.05}, random);
         list_twice(pair.source, apart, random);
         list_twice(pair.target, apart, random);
         return pair;
       }},
  };
}

/// What became of the pairs of a kind.
struct tally {
  std::size_t pairs = 0, registered[std::size(limits)] = {}, ambiguous = 0;
  double smallest_log10_nfa = std::numeric_limits<double>::infinity(), largest_probability = 0, seconds = 0;

  void add(const matching& result) {
    ++pairs;
    ambiguous += result.outcome == outcome::ambiguous;
    if (result.outcome != outcome::registered) return;
    const double log10_nfa = result.hypotheses.front().log10_nfa;
    for (std::size_t i = 0; i < std::size(limits); ++i) registered[i] += log10_nfa <= std::log10(limits[i]);
    smallest_log10_nfa = std::min(smallest_log10_nfa, log10_nfa);
    largest_probability = std::max(largest_probability, result.probability);
  }

  void print(std::string_view name) const {
    std::cout << "| " << name << " | " << pairs;
    for (const std::size_t count : registered) std::cout << " | " << count;
    std::cout << " | " << ambiguous << " | " << smallest_log10_nfa << " | " << largest_probability << " | "
              << 1000 * seconds / double(pairs) << " |\n"
              << std::flush;
  }
};

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Matches stem maps that have nothing in common.", "false_registrations");
  std::vector<std::filesystem::path> files;
  std::vector<std::string> chosen;
  std::size_t pairs = 2000, max_stems = 300;
  std::uint64_t seed = 1;
  std::filesystem::path csv_file = "false_registrations.csv";
  app.add_option("MAP", files, "stem maps (CSV) that windows are cut from")->required();
  app.add_option("--kinds", chosen, "of pairs; all if not given")->delimiter(',');
  app.add_option("--pairs", pairs, "of each kind")->capture_default_str();
  app.add_option("--max-stems", max_stems, "of a map")->capture_default_str();
  app.add_option("--seed", seed, "of all that is random")->capture_default_str();
  app.add_option("--csv", csv_file, "file with a line for each pair")->capture_default_str();

  return support::run_program(app, argc, argv, [&] {
    const std::vector<positions> maps = read_maps(files);
    const window_source windows(maps, max_stems);
    support::atomic_file csv(csv_file);
    csv.stream() << "kind,pair,source,target,outcome,log10_nfa,pairs,inlier_threshold,probability,seconds\n";
    std::cout << "| unrelated maps | pairs | registered at 1e-3 | 1e-4 | 1e-5 | 1e-6 | ambiguous | smallest "
                 "log10 NFA | largest probability | mean [ms] |\n|---|---|---|---|---|---|---|---|---|---|\n";
    for (const kind& k : kinds_of(windows, max_stems)) {
      if (!chosen.empty() && std::find(chosen.begin(), chosen.end(), k.name) == chosen.end()) continue;
      random_source random(seed);
      tally of_kind;
      for (std::size_t i = 0; i < pairs; ++i) {
        const unrelated pair = k.next(random);
        const support::stage_clock clock;
        const matching result = match_stems(pair.source, pair.target);
        const double seconds = clock.seconds();
        of_kind.seconds += seconds;
        of_kind.add(result);
        const hypothesis best = result.hypotheses.empty() ? hypothesis{} : result.hypotheses.front();
        csv.stream() << k.name << ',' << i << ',' << pair.source.size() << ',' << pair.target.size() << ','
                     << to_string(result.outcome) << ',' << best.log10_nfa << ','
                     << best.correspondences.size() << ',' << best.inlier_threshold << ','
                     << result.probability << ',' << seconds << '\n';
      }
      of_kind.print(k.name);
    }
    csv.commit();
    return support::done;
  });
}
