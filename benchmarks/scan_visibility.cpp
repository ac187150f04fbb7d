// What it helps that scanners see where no stem stands: pairs of simulated scans of which few common stems
// are left, and pairs that have nothing in common, registered with what the scanners saw and without.
#include <globalmatch/detail/core/random.hpp>
#include <globalmatch/registration.hpp>

#include "support/programs/command_line.hpp"
#include "support/simulator/scenes.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <iomanip>
#include <iostream>
#include <limits>
#include <string>
#include <vector>

using namespace globalmatch;
using detail::random_source;

namespace {

struct mapped_scan {
  std::string plot;
  Eigen::Isometry3d plot_from_scan;
  stem_map map;
};

double horizontal_distance(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::hypot(a.x() - b.x(), a.y() - b.y());
}

std::vector<mapped_scan> simulate(const std::vector<std::string>& scenes,
                                  const std::vector<std::uint64_t>& seeds, std::size_t stations, double step,
                                  const execution& exec) {
  std::vector<mapped_scan> scans;
  for (const std::string& scene : scenes)
    for (const std::uint64_t seed : seeds) {
      support::simulation_options options = support::find_scene(scene).options;
      // Plots of one seed have the same trees.
      options.seed = 1000 * seed + std::uint64_t(&scene - scenes.data());
      if (step > 0) options.scanner.angular_step = step;
      support::simulation plot(options);
      for (std::size_t i = 0; i < std::min(stations, plot.stations().size()); ++i)
        scans.push_back({scene + '/' + std::to_string(seed), plot.stations()[i].plot_from_scan,
                         map_stems(plot.scan(i, exec).points, {}, Eigen::Vector3d::UnitZ(), exec)});
    }
  return scans;
}

/// The map with `count` of the stems that the target has, too: some of those around one of them, at random.
struct few_common {
  stem_map map;
  std::vector<Eigen::Vector3d> common;  ///< frame of the source

  few_common(const mapped_scan& source, const mapped_scan& target, std::size_t count, random_source& random)
      : map(source.map) {
    constexpr double same = 0.3;       // [m]
    constexpr std::size_t around = 3;  // times as many
    const Eigen::Isometry3d truth = target.plot_from_scan.inverse() * source.plot_from_scan;
    const auto is_common = [&](const stem& s) {
      return std::any_of(target.map.stems.begin(), target.map.stems.end(), [&](const stem& t) {
        return horizontal_distance(truth * s.position, t.position) < same;
      });
    };
    const auto first = std::stable_partition(map.stems.begin(), map.stems.end(),
                                             [&](const stem& s) { return !is_common(s); });
    const auto found = std::size_t(map.stems.end() - first);
    if (found < count) return;
    const Eigen::Vector3d middle = (first + std::ptrdiff_t(random.below(std::uint32_t(found))))->position;
    std::sort(first, map.stems.end(), [&](const stem& a, const stem& b) {
      return horizontal_distance(a.position, middle) < horizontal_distance(b.position, middle);
    });
    for (std::size_t i = 0; i < count; ++i)
      std::swap(first[std::ptrdiff_t(i)],
                first[std::ptrdiff_t(i + random.below(std::uint32_t(std::min(found, around * count) - i)))]);
    map.stems.erase(first + std::ptrdiff_t(count), map.stems.end());
    for (auto at = map.stems.end() - std::ptrdiff_t(count); at != map.stems.end(); ++at)
      common.push_back(at->position);
  }
};

struct tally {
  std::size_t pairs = 0, right = 0, wrong = 0;
  double seconds = 0, smallest = std::numeric_limits<double>::infinity();

  /// `max_error` [m] on average, at some places that `truth` moves. None: nothing is right.
  void add(stem_map source, stem_map target, bool with, const Eigen::Isometry3d& truth,
           const std::vector<Eigen::Vector3d>& places) {
    constexpr double max_error = 0.3;  // [m]
    if (!with) source.visible = {}, target.visible = {};
    const auto start = std::chrono::steady_clock::now();
    const registration result =
        register_maps(source, target, {.icp = {.metric = icp_metric::none}}, {.threads = 1});
    seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    ++pairs;
    if (!result.matching.hypotheses.empty())
      smallest = std::min(smallest, result.matching.hypotheses.front().log10_nfa);
    if (!result.target_from_source) return;
    double error = places.empty() ? 2 * max_error : 0;
    for (const Eigen::Vector3d& p : places)
      error += horizontal_distance(*result.target_from_source * p, truth * p) / double(places.size());
    ++(error < max_error ? right : wrong);
  }
  void print(const std::string& name) const {
    std::cout << "| " << name << " | " << pairs << " | " << std::fixed << std::setprecision(1)
              << 100 * double(right) / double(pairs) << " | " << wrong << " | " << std::setprecision(2)
              << smallest << " | " << std::setprecision(1) << 1000 * seconds / double(pairs) << " |\n"
              << std::flush;
  }
};

void print_related(const std::vector<mapped_scan>& scans, std::uint64_t seed) {
  constexpr std::size_t min_common = 4, max_common = 8;
  for (std::size_t count = min_common; count <= max_common; ++count) {
    random_source random(seed);
    tally without, with;
    for (const mapped_scan& source : scans)
      for (const mapped_scan& target : scans) {
        if (&source == &target || source.plot != target.plot) continue;
        const few_common few(source, target, count, random);
        if (few.common.empty()) continue;
        const Eigen::Isometry3d truth = target.plot_from_scan.inverse() * source.plot_from_scan;
        without.add(few.map, target.map, false, truth, few.common);
        with.add(few.map, target.map, true, truth, few.common);
      }
    if (with.pairs == 0) continue;
    without.print(std::to_string(count) + " common, without");
    with.print(std::to_string(count) + " common, with");
  }
}

void print_unrelated(const std::vector<mapped_scan>& scans) {
  tally without, with;
  for (const mapped_scan& source : scans)
    for (const mapped_scan& target : scans) {
      if (source.plot == target.plot) continue;
      without.add(source.map, target.map, false, Eigen::Isometry3d::Identity(), {});
      with.add(source.map, target.map, true, Eigen::Isometry3d::Identity(), {});
    }
  if (with.pairs == 0) return;
  without.print("unrelated, without");
  with.print("unrelated, with");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Registers simulated scans by their stems, with and without what the scanners saw.",
               "scan_visibility");
  std::vector<std::string> scenes = {"plot_1", "thicket", "sparse_far", "underwood", "slope_28"};
  std::vector<std::uint64_t> seeds(std::begin(support::tuning_seeds), std::end(support::tuning_seeds));
  std::size_t stations = 3;
  double step = 0.15;
  support::shared_options shared;
  app.add_option("--scenes", scenes, "names of scenes")->delimiter(',');
  app.add_option("--seeds", seeds, "of the scenes")->delimiter(',')->capture_default_str();
  app.add_option("--stations", stations, "of each plot")->capture_default_str();
  app.add_option("--angular-step", step, "between rays [deg]; 0: the scenes' own")->capture_default_str();
  shared.add_threads_to(app);

  return support::run_program(app, argc, argv, [&] {
    const auto scans = simulate(scenes, seeds, stations, step, {.threads = shared.threads});
    const auto unknown =
        std::count_if(scans.begin(), scans.end(), [](const mapped_scan& s) { return s.map.visible.empty(); });
    std::cout
        << scans.size() << " scans; of " << unknown << " it is not known what the scanner saw\n\n"
        << "| pairs | number | right [%] | wrong | smallest log10 NFA | ms |\n|---|---|---|---|---|---|\n";
    print_related(scans, seeds.front());
    print_unrelated(scans);
    return 0;
  });
}
