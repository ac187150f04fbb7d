// Registers each scan of the simulated scenes with every earlier one, and compares everything with the truth:
// stem maps by precision and recall, pairs by right, wrong and refused, transforms by e_p, e_R and e_t.
#include <globalmatch/detail/core/statistics.hpp>
#include <globalmatch/evaluation.hpp>
#include <globalmatch/registration.hpp>

#include "normalised_errors.hpp"
#include "support/atomic_file.hpp"
#include "support/programs/command_line.hpp"
#include "support/programs/reports.hpp"
#include "support/simulator/scenes.hpp"

#include <algorithm>
#include <iomanip>
#include <iostream>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

using namespace globalmatch;
using benchmarks::normalised_errors;
using namespace globalmatch::detail;
using Eigen::Isometry3d;
using Eigen::Vector3d;

namespace {

constexpr std::uint32_t min_returns = 10, required_returns = 400;  // of a true find; of a stem to be found

/// What is kept of a scan once its points are gone.
struct mapped_scan {
  stem_map map;
  double seconds = 0;  // of mapping
  map_score score;
  std::vector<Vector3d> sample;  // of the scan, for e_p
  Isometry3d plot_from_scan;
};

mapped_scan map_scan(support::simulation& plot, std::size_t i, bool weighted, const execution& exec) {
  constexpr std::size_t every = 50;  // point of the scan goes into the sample
  const auto scan = plot.scan(i, exec);
  mapped_scan result;
  result.plot_from_scan = plot.stations()[i].plot_from_scan;
  for (std::size_t k = 0; k < scan.points.size(); k += every) result.sample.push_back(scan.points[k]);
  const support::stage_clock clock;
  result.map = map_stems(scan.points, {}, Vector3d::UnitZ(), exec);
  result.seconds = clock.seconds();
  if (!weighted)
    for (stem& s : result.map.stems) s.position_sigma = 0;  // not known

  std::vector<Vector3d> found, truth;
  std::vector<std::uint32_t> returns;
  for (const stem& s : result.map.stems) found.push_back(result.plot_from_scan * s.position);
  for (std::size_t s = 0; s < plot.plot().stems.size(); ++s)
    if (scan.returns_per_stem[s] >= min_returns) {
      truth.push_back(plot.plot().stems[s].position);
      returns.push_back(scan.returns_per_stem[s]);
    }
  result.score = score_map(found, truth, 0.25, [&](std::size_t s) { return returns[s] >= required_returns; });
  return result;
}

/// Two scans registered.
struct registered_pair {
  std::string scene;
  std::uint64_t seed = 0;
  std::size_t source = 0, target = 0;  // stations
  bool neighbors = false;  // one of them is the first station, or they are next to each other around it
  globalmatch::outcome outcome = outcome::not_registered;
  std::size_t matches = 0, source_stems = 0, target_stems = 0;
  std::optional<registration_error> coarse, fine;  // of the best hypothesis; after ICP, where it ran
  double matching_seconds = 0, icp_seconds = 0;

  /// Of the transform that was returned.
  const std::optional<registration_error>& returned() const { return fine ? fine : coarse; }
  bool right() const { return outcome == outcome::registered && returned()->success(); }
  bool wrong() const { return outcome == outcome::registered && !returned()->success(); }
};

registered_pair register_pair(const mapped_scan& source, const mapped_scan& target,
                              const registration_options& options, int threads, normalised_errors& errors) {
  const Isometry3d truth = target.plot_from_scan.inverse() * source.plot_from_scan;
  const Vector3d up = target.plot_from_scan.linear().transpose().col(2);
  const auto error = [&](const Isometry3d& transform) {
    return evaluate_registration(transform, truth, source.sample, up);
  };
  support::stage_clock clock;
  const registration result = register_maps(source.map, target.map, options, clock.listen(threads));
  registered_pair pair;
  const auto stages = clock.stages();
  if (stages.contains("icp")) pair.icp_seconds = stages["icp"].get<double>();
  pair.matching_seconds = clock.seconds() - pair.icp_seconds;
  pair.outcome = result.outcome;
  pair.matches = result.matching.funnel.correspondences;
  pair.source_stems = source.map.stems.size();
  pair.target_stems = target.map.stems.size();
  if (!result.matching.hypotheses.empty())
    pair.coarse = error(result.matching.hypotheses.front().target_from_source);
  if (result.icp && result.icp->converged) pair.fine = error(*result.target_from_source);
  if (const auto& matched = result.matching; matched.uncertainty && pair.coarse->success())
    errors.add(*matched.target_from_source, truth, *matched.uncertainty, matched.vertical->is_known());
  return pair;
}

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
  std::vector<mapped_scan> scans;
  for (std::size_t i = 0; i < plot.stations().size(); ++i) {
    scans.push_back(map_scan(plot, i, weighted, exec));
    result.scores.push_back(scans.back().score);
    result.mapping_seconds.push_back(scans.back().seconds);
  }
  const std::size_t around = scans.size() - 1;  // stations around the first
  for (std::size_t target = 0; target < scans.size(); ++target)
    for (std::size_t source = target + 1; source < scans.size(); ++source) {
      // As in [GM] 5.2.2 the scans are registered with the middle one for good; the other pairs show how
      // robust that is.
      registration_options for_pair = registering;
      if (target != 0) for_pair.icp.metric = icp_metric::none;
      registered_pair pair =
          register_pair(scans[source], scans[target], for_pair, exec.threads, result.errors);
      pair.scene = scene.name;
      pair.seed = seed;
      pair.source = source + 1;
      pair.target = target + 1;
      const std::size_t apart = source - target;
      pair.neighbors = target == 0 || apart == 1 || apart == around - 1;
      result.pairs.push_back(pair);
    }
}

constexpr const char* csv_head =
    "scene,seed,source,target,neighbors,outcome,source_stems,target_stems,matches,matching_seconds,"
    "icp_seconds,coarse_e_p,coarse_e_R,coarse_e_t,fine_e_p,fine_horizontal,fine_vertical,fine_e_R,fine_e_t\n";

/// One line of the CSV; what there is not stays empty.
void print_pair(std::ostream& out, const registered_pair& p) {
  out << p.scene << ',' << p.seed << ',' << p.source << ',' << p.target << ',' << p.neighbors << ','
      << to_string(p.outcome) << ',' << p.source_stems << ',' << p.target_stems << ',' << p.matches << ','
      << p.matching_seconds << ',' << p.icp_seconds;
  if (const auto& e = p.coarse)
    out << ',' << e->pointwise << ',' << e->rotation << ',' << e->translation;
  else
    out << ",,,";
  if (const auto& e = p.fine)
    out << ',' << e->pointwise << ',' << e->horizontal << ',' << e->vertical << ',' << e->rotation << ','
        << e->translation;
  else
    out << ",,,,,";
  out << '\n';
}

/// Sums of finds, means of errors over the true finds of all maps.
map_score sum_of(const std::vector<map_score>& scores) {
  map_score sum;
  for (const map_score& s : scores) {
    sum.found += s.found;
    sum.true_finds += s.true_finds;
    sum.required += s.required;
    sum.required_found += s.required_found;
    sum.horizontal_error += s.horizontal_error * double(s.true_finds);
    sum.height_error += s.height_error * double(s.true_finds);
  }
  for (double* mean : {&sum.horizontal_error, &sum.height_error})
    if (sum.true_finds > 0) *mean /= double(sum.true_finds);
  return sum;
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
    csv.stream() << csv_head;
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
