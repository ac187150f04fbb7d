// Windows cut from real stem maps, two at a time, that share half of their trees or fewer: how often are they
// registered rightly, by the number of stems that both show and by the limit on the number of false alarms?
#include <globalmatch/stem_matching.hpp>

#include "map_windows.hpp"
#include "stem_layouts.hpp"
#include "support/atomic_file.hpp"
#include "support/programs/command_line.hpp"
#include "support/programs/reports.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <iterator>
#include <limits>
#include <map>
#include <string>
#include <vector>

using namespace globalmatch;
using namespace globalmatch::detail;
using namespace globalmatch::benchmarks;

namespace {

constexpr double limits[] = {1e-3, 1e-4, 1e-5, 1e-6};  // on the NFA; the first one is the default

/// Outcomes of pairs that share as many stems.
struct tally {
  std::size_t pairs = 0, best_right = 0;                                     // best hypothesis
  std::size_t right[std::size(limits)] = {}, wrong[std::size(limits)] = {};  // registered

  void add(const tally& other) {
    pairs += other.pairs, best_right += other.best_right;
    for (std::size_t i = 0; i < std::size(limits); ++i)
      right[i] += other.right[i], wrong[i] += other.wrong[i];
  }
};

tally decide_pair(const matching& result, const two_maps& maps, double noise) {
  tally t{.pairs = 1};
  t.best_right =
      !result.hypotheses.empty() && is_right(result.hypotheses.front().target_from_source, maps, noise);
  if (!result.target_from_source) return t;
  const bool right = is_right(*result.target_from_source, maps, noise);
  for (std::size_t i = 0; i < std::size(limits); ++i)
    (right ? t.right : t.wrong)[i] = result.hypotheses.front().log10_nfa <= std::log10(limits[i]);
  return t;
}

void print_bins(std::ostream& out, const std::map<std::size_t, tally>& by_common, std::size_t limit) {
  constexpr std::size_t starts[] = {0, 4, 6, 10, 15, std::numeric_limits<std::size_t>::max()};
  for (std::size_t b = 0; b + 1 < std::size(starts); ++b) {
    tally bin;
    for (const auto& [common, t] : by_common)
      if (common >= starts[b] && common < starts[b + 1]) bin.add(t);
    const auto share = [&](std::size_t count) {
      return bin.pairs > 0 ? 100 * double(count) / double(bin.pairs) : 0;
    };
    out << " | " << bin.pairs << ": " << share(bin.best_right) << ", " << share(bin.right[limit]) << ", "
        << bin.wrong[limit];
  }
}

void print_limit(std::ostream& out, double limit) {
  out << " | " << std::defaultfloat << limit << std::fixed << std::setprecision(1);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Registers windows of real stem maps with each other. By stems that both show: pairs, then the share "
      "[%] whose best hypothesis is right, the share registered rightly, and the number registered wrongly.",
      "matching_windows");
  std::vector<std::filesystem::path> files;
  std::vector<std::size_t> trees = {60, 30};
  std::vector<double> noises = {0.02, 0.10};
  std::size_t windows = 1000;
  std::uint64_t seed = 1;
  view_options view;
  std::string proposal_name = "index";
  double inlier_threshold = 0;
  std::filesystem::path csv_file = "matching_windows.csv";
  app.add_option("MAP", files, "stem maps (CSV); windows are cut from one of them at random")->required();
  app.add_option("--trees", trees, "of each window")->delimiter(',')->capture_default_str();
  app.add_option("--noise", noises, "of each coordinate [m]")->delimiter(',')->capture_default_str();
  app.add_option("--windows", windows, "pairs for each size and noise")->capture_default_str();
  app.add_option("--seed", seed, "of all that is random")->capture_default_str();
  app.add_option("--proposal", proposal_name, "index or algorithm_1")
      ->check(CLI::IsMember({"index", "algorithm_1"}))
      ->capture_default_str();
  app.add_option("--tolerance", inlier_threshold, "of matching [m]; 0: from the stems")
      ->capture_default_str();
  app.add_option("--csv", csv_file, "file with a line for each number of common stems")
      ->capture_default_str();

  return support::run_program(app, argc, argv, [&] {
    const std::vector<positions> maps = read_maps(files);
    matching_options options;
    if (proposal_name == "algorithm_1") options.proposal = proposal::algorithm_1;
    if (inlier_threshold > 0) options.inlier_threshold = inlier_threshold;
    support::atomic_file csv(csv_file);
    csv.stream() << "trees,noise,limit,common,pairs,best_right,registered_right,registered_wrong\n";
    std::cout << "| trees | noise [m] | limit | 0-3 common | 4-5 | 6-9 | 10-14 | 15 and more | mean [ms] |\n"
                 "|---|---|---|---|---|---|---|---|---|\n"
              << std::fixed << std::setprecision(1);
    for (const std::size_t count : trees)
      for (const double noise : noises) {
        view.noise = noise;
        random_source random(seed);
        std::map<std::size_t, tally> by_common;
        double seconds = 0;
        for (std::size_t i = 0; i < windows; ++i) {
          const positions& map = maps[random.below(static_cast<std::uint32_t>(maps.size()))];
          if (map.empty()) continue;
          const window_pair pair = cut_pair(map, count, view, random);
          const support::stage_clock clock;
          const matching result = match_stems(pair.maps.source, pair.maps.target, options);
          seconds += clock.seconds();
          by_common[pair.common].add(decide_pair(result, pair.maps, noise));
        }
        for (std::size_t limit = 0; limit < std::size(limits); ++limit) {
          std::cout << "| " << count << " | " << std::setprecision(2) << noise;
          print_limit(std::cout, limits[limit]);
          print_bins(std::cout, by_common, limit);
          std::cout << " | " << 1000 * seconds / double(windows) << " |\n" << std::flush;
          for (const auto& [common, t] : by_common)
            csv.stream() << count << ',' << noise << ',' << limits[limit] << ',' << common << ',' << t.pairs
                         << ',' << t.best_right << ',' << t.right[limit] << ',' << t.wrong[limit] << '\n';
        }
      }
    csv.commit();
    return support::done;
  });
}
