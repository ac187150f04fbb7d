// Registers each scan of the simulated scenes with every earlier one, and compares everything with the truth:
// stem maps by precision and recall, pairs by right, wrong and refused, transforms by e_p, e_R and e_t.
#include <globalmatch/detail/core/statistics.hpp>
#include <globalmatch/registration.hpp>

#include "evaluated_pairs.hpp"
#include "evaluated_scans.hpp"
#include "normalised_errors.hpp"
#include "support/atomic_file.hpp"
#include "support/programs/command_line.hpp"
#include "support/simulator/scenes.hpp"

#include <iomanip>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

using namespace globalmatch;
using namespace globalmatch::benchmarks;
using namespace globalmatch::detail;
using Eigen::Isometry3d;
using Eigen::Vector3d;

namespace {

/// A station's scan, and its score.
struct mapped_station {
  evaluated_scan scan;
  map_score score;
};

mapped_station map_station(support::simulation& plot, std::size_t i, bool weighted, const execution& exec) {
  const auto scan = plot.scan(i, exec);
  mapped_station result;
  result.scan = map_scan(scan.points, plot.stations()[i].plot_from_scan, {}, Vector3d::UnitZ(), exec);
  if (!weighted)
    for (stem& s : result.scan.map.stems) s.position_sigma = 0;  // not known
  true_stems truth{{}, scan.returns_per_stem};
  for (const auto& s : plot.plot().stems) truth.positions.push_back(s.position);
  result.score = score_stems(result.scan, truth);
  return result;
}

/// Two scans of a scene.
struct registered_pair : evaluated_pair {
  std::string scene = {};
  std::uint64_t seed = 0;
  std::size_t source = 0, target = 0;  // stations
  bool neighbors = false;  // one of them is the first station, or they are next to each other around it
};

/// All that was measured on a scene with some seeds.
struct scene_result {
  std::vector<map_score> scores;
  std::vector<double> mapping_seconds;  // of each scan
  std::vector<registered_pair> pairs;
  normalised_errors errors;  // of the coarse transforms that are right
};

void run_scene(const support::named_scene& scene, std::uint64_t seed, double angular_step, bool weighted,
               const registration_options& registering, const execution& exec, scene_result& result) {
  support::simulation_options options = scene.options;
  options.seed = seed;
  if (angular_step > 0) options.scanner.angular_step = angular_step;
  support::simulation plot(options);
  std::vector<evaluated_scan> scans;
  for (std::size_t i = 0; i < plot.stations().size(); ++i) {
    mapped_station station = map_station(plot, i, weighted, exec);
    result.scores.push_back(station.score);
    result.mapping_seconds.push_back(station.scan.seconds);
    scans.push_back(std::move(station.scan));
  }
  const std::size_t around = scans.size() - 1;  // stations around the first
  for (std::size_t target = 0; target < scans.size(); ++target)
    for (std::size_t source = target + 1; source < scans.size(); ++source) {
      // As in [GM] 5.2.2 the scans are registered with the middle one for good; the other pairs show how
      // robust that is.
      registration_options for_pair = registering;
      if (target != 0) for_pair.icp.metric = icp_metric::none;
      const Isometry3d scan_from_plot = scans[target].plot_from_scan.inverse();
      registered_pair pair{
          register_pair(scans[source], scans[target], scan_from_plot * scans[source].plot_from_scan,
                        scan_from_plot.linear().col(2), for_pair, exec.threads, result.errors)};
      pair.scene = scene.name;
      pair.seed = seed;
      pair.source = source + 1;
      pair.target = target + 1;
      const std::size_t apart = source - target;
      pair.neighbors = target == 0 || apart == 1 || apart == around - 1;
      result.pairs.push_back(pair);
    }
}

void print_pair(std::ostream& out, const registered_pair& p) {
  out << p.scene << ',' << p.seed << ',' << p.source << ',' << p.target << ',' << p.neighbors << ',';
  write_fields(out, p);
  out << '\n';
}

constexpr const char* table_head =
    "| scene | seeds | precision | recall | F1 [%] | horizontal, height error [cm] | pairs right, wrong, "
    "refused | "
    "neighbours right | normalised errors in plan | in height | coarse e_p [cm] | fine e_p [cm] "
    "| e_R [mrad] | e_t [cm] | seconds: mapping a scan, "
    "matching, ICP a pair |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";

/// One row of the table.
void print_row(std::ostream& out, const std::string& name, const std::string& seeds, scene_result& r) {
  const map_score sum = sum_of(r.scores);
  std::size_t right = 0, wrong = 0, neighbors = 0, neighbors_right = 0;
  std::vector<double> coarse, fine, rotation, translation, matching, refining;
  for (const registered_pair& p : r.pairs) {
    right += p.right();
    wrong += p.wrong();
    neighbors += p.neighbors;
    neighbors_right += p.neighbors && p.right();
    matching.push_back(p.matching_seconds);
    if (p.right()) coarse.push_back(100 * p.coarse->pointwise);
    if (!p.right() || !p.fine) continue;
    refining.push_back(p.icp_seconds);
    fine.push_back(100 * p.fine->pointwise);
    rotation.push_back(1000 * p.fine->rotation);
    translation.push_back(100 * p.fine->translation);
  }
  out << std::fixed << std::setprecision(1) << "| `" << name << "` | " << seeds << " | "
      << 100 * sum.precision() << " | " << 100 * sum.recall() << " | " << 100 * sum.f1() << " | "
      << 100 * sum.horizontal_error << ", " << 100 * sum.height_error << " | " << right << ", " << wrong
      << ", " << r.pairs.size() - right - wrong << " | " << neighbors_right << " of " << neighbors << " | "
      << r.errors << " | " << std::setprecision(2) << median(coarse) << " | " << median(fine) << " | "
      << median(rotation) << " | " << median(translation) << " | " << median(r.mapping_seconds) << ", "
      << std::setprecision(3) << median(matching) << ", " << median(refining) << " |\n"
      << std::flush;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Registers the scenes of docs/scenes.md and prints a row for each. Coarse e_p over all pairs that are "
      "right, fine ones over the scans registered with the middle one; medians.",
      "registration_accuracy");
  std::vector<std::string> names;
  for (const auto& scene : support::frozen_scenes()) names.push_back(scene.name);
  std::vector<std::uint64_t> seeds(std::begin(support::tuning_seeds), std::end(support::tuning_seeds));
  std::filesystem::path pairs_file = "registration_accuracy.csv";
  double angular_step = 0;
  bool unweighted = false;
  support::shared_options shared;
  app.add_option("--scenes", names, "names of scenes")->delimiter(',');
  app.add_option("--seeds", seeds, "of the scenes")->delimiter(',')->capture_default_str();
  app.add_option("--pairs", pairs_file, "CSV with a line for each pair")->capture_default_str();
  app.add_option("--angular-step", angular_step, "instead of the scenes' own [deg]");
  app.add_flag("--unweighted", unweighted, "ignore position_sigma");
  shared.add_matching_to(app);
  shared.add_icp_to(app);
  shared.add_threads_to(app);

  return support::run_program(app, argc, argv, [&] {
    support::atomic_file csv(pairs_file);
    csv.stream() << "scene,seed,source,target,neighbors," << evaluated_pair_columns << '\n';
    std::string all_seeds;
    for (const std::uint64_t seed : seeds)
      all_seeds += (all_seeds.empty() ? "" : ", ") + std::to_string(seed);
    const registration_options registering = {{}, shared.for_matching(), shared.for_icp()};
    const execution exec{.threads = shared.threads};
    std::cout << table_head;
    for (const std::string& name : names) {
      scene_result result;
      for (const std::uint64_t seed : seeds)
        run_scene(support::find_scene(name), seed, angular_step, !unweighted, registering, exec, result);
      print_row(std::cout, name, all_seeds, result);
      for (const registered_pair& pair : result.pairs) print_pair(csv.stream(), pair);
    }
    csv.commit();
    return support::done;
  });
}
