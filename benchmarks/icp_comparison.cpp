// Fine registration beside that of others: ICP of this library, of PCL (GLOBALMATCH_BENCHMARK_PCL) and of
// small_gicp (GLOBALMATCH_BENCHMARK_SMALL_GICP), on the same scans from the same coarse transform, in turn.
// Scans of the frozen scenes, each registered with the middle one, or two files whose true transform is
// known.
#include <globalmatch/detail/core/statistics.hpp>
#include <globalmatch/detail/verbs/refine_by_samples.hpp>
#include <globalmatch/evaluation.hpp>
#include <globalmatch/registration.hpp>

#include "icp_trial.hpp"
#include "pcl_icp_methods.hpp"
#include "small_gicp_methods.hpp"
#include "support/atomic_file.hpp"
#include "support/programs/command_line.hpp"
#include "support/scan_files.hpp"
#include "support/simulator/scenes.hpp"
#include "support/transform_files.hpp"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <map>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

using namespace globalmatch;
using namespace globalmatch::benchmarks;
using Eigen::Isometry3d;
using Eigen::Vector3d;

namespace {

/// The ICP of `register_maps`, whose transform is taken. Mapping both scans is its preparation, which the
/// coarse registration has needed already.
icp_method own_method(const std::string& name, icp_metric metric, int threads) {
  return {name, [=](const scan_pair& scans) {
            const execution exec{.threads = threads};
            icp_trial trial;
            stem_map source, target;
            trial.preparation = measure([&] {
              source = map_stems(scans.source, {}, Vector3d::UnitZ(), exec);
              target = map_stems(scans.target, {}, Vector3d::UnitZ(), exec);
            });
            registration_options options;
            options.icp.metric = metric;
            const registration result = register_maps(source, target, options, exec);
            if (!result.icp) return trial;
            const auto& vertical = *result.matching.vertical;
            const auto dof =
                vertical.kind == vertical_kind::rotated ? degrees_of_freedom::six : degrees_of_freedom::four;
            trial.refinement = measure([&] {
              detail::refine_by_samples(source, target, scans.coarse, dof, vertical.is_known(), options.icp,
                                        exec);
            });
            trial.target_from_source = *result.target_from_source;
            trial.iterations = result.icp->iterations;
            trial.converged = result.refined;
            return trial;
          }};
}

/// Peers with the settings that small_gicp recommends, and, called fine, with those of this library's ICP on
/// denser points.
std::vector<icp_method> all_methods(double fine_voxel, int threads) {
  const peer_settings usual{.threads = threads};
  const icp_options own;
  const peer_settings finer{.voxel = fine_voxel,
                            .max_distance = own.max_distance,
                            .max_iterations = own.max_iterations,
                            .min_step = own.convergence_threshold,
                            .min_turn = own.convergence_threshold,
                            .threads = threads};
  std::vector<icp_method> methods = {own_method("plane", icp_metric::point_to_plane, threads),
                                     own_method("point", icp_metric::point_to_point, threads)};
  for (const auto& [settings, label] : {std::pair(usual, ""), std::pair(finer, ", fine")})
    for (const auto& of : {methods_of_small_gicp(settings, label), methods_of_pcl(settings, label)})
      methods.insert(methods.end(), of.begin(), of.end());
  return methods;
}

/// What one method did on a pair, the best times of several runs.
struct method_score {
  registration_error error;
  icp_trial trial;
};

using pair_scores = std::map<std::string, method_score>;

pair_scores compare(const std::vector<icp_method>& methods, const scan_pair& scans, const Isometry3d& truth,
                    int repetitions) {
  constexpr std::size_t every = 50;  // point of the scan is looked at for e_p
  std::vector<Vector3d> sample;
  for (std::size_t i = 0; i < scans.source.size(); i += every) sample.push_back(scans.source[i]);
  const auto faster = [](const used_time& a, const used_time& b) { return a.cpu < b.cpu ? a : b; };
  pair_scores scores;
  for (int run = 0; run < repetitions; ++run)
    for (const icp_method& method : methods) {
      icp_trial trial = method.run(scans);
      if (const auto before = scores.find(method.name); before != scores.end()) {
        trial.preparation = faster(trial.preparation, before->second.trial.preparation);
        trial.refinement = faster(trial.refinement, before->second.trial.refinement);
      }
      scores[method.name] = {evaluate_registration(trial.target_from_source, truth, sample), trial};
    }
  scores["coarse"].error = evaluate_registration(scans.coarse, truth, sample);
  return scores;
}

/// The coarse transform of both scans; throws where there is none.
Isometry3d register_coarsely(const std::vector<Vector3d>& source, const std::vector<Vector3d>& target,
                             int threads) {
  const auto result = register_scans(source, target, {.icp = {.metric = icp_metric::none}}, Vector3d::UnitZ(),
                                     {.threads = threads});
  if (!result.registration.target_from_source)
    throw std::invalid_argument("the scans are not registered: " + result.registration.reason);
  return *result.registration.target_from_source;
}

struct comparison {
  std::vector<icp_method> methods;
  int repetitions = 3, threads = 1;
  std::size_t max_pairs = 4;  // of a scene
  std::uint64_t seed = 101;

  pair_scores run(const std::vector<Vector3d>& source, const std::vector<Vector3d>& target,
                  const Isometry3d& truth) const {
    return compare(methods, {source, target, register_coarsely(source, target, threads)}, truth, repetitions);
  }

  /// The scans of a scene, each with the middle one.
  std::vector<pair_scores> run(const std::string& scene) const {
    support::simulation_options options = support::find_scene(scene).options;
    options.seed = seed;
    support::simulation plot(options);
    const execution exec{.threads = threads};
    const auto& stations = plot.stations();
    const auto target = plot.scan(0, exec).points;
    std::vector<pair_scores> scores;
    for (std::size_t i = 1; i < std::min(stations.size(), max_pairs + 1); ++i)
      scores.push_back(run(plot.scan(i, exec).points, target,
                           stations[0].plot_from_scan.inverse() * stations[i].plot_from_scan));
    return scores;
  }
};

std::vector<Vector3d> finite_points(const std::filesystem::path& file) {
  std::vector<Vector3d> points;
  for (const Vector3d& p : support::open_scan(file))
    if (p.allFinite()) points.push_back(p);
  return points;
}

template <class Value>
double median_of(const std::vector<pair_scores>& scores, const std::string& method, const Value& value) {
  std::vector<double> values;
  for (const pair_scores& pair : scores) values.push_back(value(pair.at(method)));
  return detail::median(values);
}

/// Medians over the pairs, a row a method.
void print_table(std::ostream& out, const std::string& name, const std::vector<pair_scores>& scores,
                 const std::vector<icp_method>& methods) {
  out << "| `" << name << "`, " << scores.size() << " pairs | preparation CPU, wall [s] | ICP CPU, wall [s] "
      << "| iterations | converged | e_p [mm] | horizontal, vertical [mm] | worst e_p [mm] "
      << "|\n|---|---|---|---|---|---|---|---|\n"
      << std::fixed;
  std::vector<std::string> rows = {"coarse"};
  for (const icp_method& m : methods) rows.push_back(m.name);
  for (const std::string& method : rows) {
    const auto median = [&](const auto& value) { return median_of(scores, method, value); };
    double worst = 0;
    std::size_t converged = 0;
    for (const pair_scores& pair : scores) {
      worst = std::max(worst, pair.at(method).error.pointwise);
      converged += pair.at(method).trial.converged;
    }
    using score = const method_score&;
    out << "| " << method << " | " << std::setprecision(3)
        << median([](score s) { return s.trial.preparation.cpu; }) << ", "
        << median([](score s) { return s.trial.preparation.wall; }) << " | "
        << median([](score s) { return s.trial.refinement.cpu; }) << ", "
        << median([](score s) { return s.trial.refinement.wall; }) << " | " << std::setprecision(0)
        << median([](score s) { return s.trial.iterations; }) << " | " << converged << " | "
        << std::setprecision(2) << 1000 * median([](score s) { return s.error.pointwise; }) << " | "
        << 1000 * median([](score s) { return s.error.horizontal; }) << ", "
        << 1000 * median([](score s) { return s.error.vertical; }) << " | " << 1000 * worst << " |\n"
        << std::flush;
  }
  out << '\n';
}

constexpr const char* csv_head =
    "pair,source,method,preparation_cpu,preparation_wall,icp_cpu,icp_wall,iterations,converged,e_p,"
    "horizontal,vertical,e_R,e_t\n";

void print_csv(std::ostream& out, const std::string& name, const std::vector<pair_scores>& scores) {
  for (std::size_t i = 0; i < scores.size(); ++i)
    for (const auto& [method, s] : scores[i])
      out << name << ',' << i + 2 << ",\"" << method << "\"," << s.trial.preparation.cpu << ','
          << s.trial.preparation.wall << ',' << s.trial.refinement.cpu << ',' << s.trial.refinement.wall
          << ',' << s.trial.iterations << ',' << s.trial.converged << ',' << s.error.pointwise << ','
          << s.error.horizontal << ',' << s.error.vertical << ',' << s.error.rotation << ','
          << s.error.translation << '\n';
}

/// Whether the ICP of this library is ahead of small_gicp's: the fastest of its ICPs, and the most accurate.
struct standing {
  std::size_t pairs = 0, faster = 0, faster_in_all = 0, more_accurate = 0, most_accurate = 0, within_3_mm = 0;

  void add(const pair_scores& scores) {
    const method_score* fastest = nullptr;
    double min_cpu = 0, min_error = 0;
    for (const auto& [name, s] : scores) {
      if (!name.starts_with("small_gicp")) continue;
      const double cpu = s.trial.preparation.cpu + s.trial.refinement.cpu;
      min_cpu = fastest ? std::min(min_cpu, cpu) : cpu;
      min_error = fastest ? std::min(min_error, s.error.pointwise) : s.error.pointwise;
      if (!fastest || s.trial.refinement.cpu < fastest->trial.refinement.cpu) fastest = &s;
    }
    const auto own = scores.find("plane");
    if (!fastest || own == scores.end()) return;
    const auto& [error, trial] = own->second;
    ++pairs;
    faster += trial.refinement.cpu < fastest->trial.refinement.cpu;
    faster_in_all += trial.preparation.cpu + trial.refinement.cpu < min_cpu;
    more_accurate += error.pointwise <= fastest->error.pointwise;
    most_accurate += error.pointwise <= min_error;
    within_3_mm += error.pointwise <= 0.003;
  }

  friend std::ostream& operator<<(std::ostream& out, const standing& s) {
    return out << "Of " << s.pairs << " pairs `plane` takes less CPU than the fastest of small_gicp in "
               << s.faster << ", with preparation in " << s.faster_in_all
               << "; is at least as accurate as that in " << s.more_accurate << ", as the most accurate in "
               << s.most_accurate << "; e_p is 3 mm at most in " << s.within_3_mm << ".\n";
  }
};

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "ICP of this library beside those of PCL and small_gicp, from the same coarse transform: errors, "
      "processor and wall time. Times are the best of the repetitions, rows medians over the pairs of a "
      "scene.",
      "icp_comparison");
  comparison compared;
  std::vector<std::string> names, left_out;
  double fine_voxel = 0.1;
  std::vector<std::filesystem::path> scans;
  std::filesystem::path truth, csv_file = "icp_comparison.csv";
  app.add_option("--scenes", names, "names of scenes")->delimiter(',');
  app.add_option("--scene-seed", compared.seed, "of the scenes")->capture_default_str();
  app.add_option("--pairs", compared.max_pairs, "of a scene at most")->capture_default_str();
  app.add_option("--repetitions", compared.repetitions, "of each method")->capture_default_str();
  app.add_option("--threads", compared.threads, "of each method")->capture_default_str();
  app.add_option("--fine-voxel", fine_voxel, "of peers that are called fine [m]")->capture_default_str();
  app.add_option("--without", left_out, "methods whose names begin so")->delimiter(',');
  auto* files = app.add_option("--scans", scans, "source and target")->expected(2);
  app.add_option("--truth", truth, "transform of the source to the target")->needs(files);
  files->needs("--truth");
  app.add_option("--csv", csv_file, "a line for each method and pair")->capture_default_str();

  return support::run_program(app, argc, argv, [&] {
    compared.methods = all_methods(fine_voxel, compared.threads);
    for (const std::string& begin : left_out)
      std::erase_if(compared.methods, [&](const icp_method& m) { return m.name.starts_with(begin); });
    support::atomic_file csv(csv_file);
    csv.stream() << csv_head;
    standing ahead;
    const auto report = [&](const std::string& name, const std::vector<pair_scores>& scores) {
      print_table(std::cout, name, scores, compared.methods);
      print_csv(csv.stream(), name, scores);
      for (const pair_scores& pair : scores) ahead.add(pair);
    };
    for (const std::string& name : names) report(name, compared.run(name));
    if (!scans.empty())
      report(scans[0].stem().string(), {compared.run(finite_points(scans[0]), finite_points(scans[1]),
                                                     support::read_transform(truth))});
    std::cout << ahead;
    csv.commit();
    return support::done;
  });
}
