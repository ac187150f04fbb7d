// The adjustment of poses to trees beside Ceres Solver: the same observations from the same start, without
// the links that no trees stand for. With the weights of our last iteration Ceres is an oracle of the poses,
// with its own robust loss a measure of time.
#include <globalmatch/detail/survey/adjust_to_trees.hpp>
#include <globalmatch/detail/verbs/solve_maps.hpp>
#include <globalmatch/survey.hpp>

#include "support/programs/command_line.hpp"
#include "survey_layouts.hpp"
#include "survey_scenes.hpp"

#include <ceres/ceres.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <iomanip>
#include <iostream>
#include <optional>
#include <utility>
#include <vector>

using namespace globalmatch;
using namespace globalmatch::detail;
using namespace globalmatch::benchmarks;

namespace {

double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// How far a pose places a stem from its tree, in standard deviations.
struct stem_residual {
  double x, y, information;  // [m] in the map; square root [1/m]

  template <class T>
  bool operator()(const T* pose, const T* tree, T* residual) const {
    using std::cos, std::sin;
    const T cosine = cos(pose[2]), sine = sin(pose[2]);
    residual[0] = information * (cosine * x - sine * y + pose[0] - tree[0]);
    residual[1] = information * (sine * x + cosine * y + pose[1] - tree[1]);
    return true;
  }
};

/// All that an adjustment is given.
struct adjustment_input {
  std::span<const prepared_stems> maps;
  const local_survey& solved;
  const tree_observations& trees;
  const unknown_poses& unknowns;
  std::vector<double> deviations;  ///< [m] of stems, for each map
};

struct adjustment_result {
  std::vector<plan_pose> poses;
  std::vector<double> weights;  ///< of the observations
  double sigma = 0;             ///< [m] of one of weight 1
  double seconds = 0;
};

adjustment_result adjust_by_us(const adjustment_input& given) {
  adjustment_result result;
  const double start = wall_seconds();
  tree_adjustment adjustment(given.maps, given.trees, {}, given.unknowns, given.deviations);
  result.poses = given.solved.placed.poses;
  if (!adjustment.adjust(result.poses)) std::cerr << "the trees do not determine all poses\n";
  result.seconds = wall_seconds() - start;
  result.weights = adjustment.weights();
  result.sigma = adjustment.sigma();
  return result;
}

/// By Ceres, with these weights; without any by its own Tukey loss.
adjustment_result adjust_by_ceres(const adjustment_input& given, const adjustment_result& ours,
                                  bool by_our_weights, int threads) {
  adjustment_result result;
  const double start = wall_seconds();
  std::vector<std::array<double, 3>> poses;
  for (const plan_pose& p : given.solved.placed.poses) poses.push_back({p.shift.x, p.shift.y, p.yaw});
  std::vector<std::array<double, 2>> trees(given.trees.size());
  ceres::Problem problem;
  auto* ordering = new ceres::ParameterBlockOrdering;
  ceres::Solver::Options options;
  options.linear_solver_ordering.reset(ordering);
  for (std::size_t t = 0; t < given.trees.size(); ++t) {
    const auto seen = given.trees.of(t);
    if (seen.size() < 2) continue;
    vec2 mean{0, 0};
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const std::size_t observation = given.trees.first[t] + i;
      const vec2 at = given.maps[seen[i].map].stems.at[seen[i].stem].xy();
      mean += given.solved.placed.poses[seen[i].map] * at / double(seen.size());
      const double deviation = std::max(given.deviations[seen[i].map], min_stem_deviation),
                   information =
                       by_our_weights ? std::sqrt(ours.weights[observation]) / ours.sigma : 1 / deviation;
      if (!(information > 0)) continue;
      problem.AddResidualBlock(
          new ceres::AutoDiffCostFunction<stem_residual, 2, 3, 2>(new stem_residual{at.x, at.y, information}),
          by_our_weights ? nullptr : new ceres::TukeyLoss(tukey_constant), poses[seen[i].map].data(),
          trees[t].data());
      ordering->AddElementToGroup(poses[seen[i].map].data(), 1);
    }
    trees[t] = {mean.x, mean.y};
    if (problem.HasParameterBlock(trees[t].data())) ordering->AddElementToGroup(trees[t].data(), 0);
  }
  for (std::size_t m = 0; m < poses.size(); ++m)
    if (given.unknowns.of[m] == unknown_poses::fixed && problem.HasParameterBlock(poses[m].data()))
      problem.SetParameterBlockConstant(poses[m].data());
  options.linear_solver_type = ceres::SPARSE_SCHUR;
  options.num_threads = threads;
  options.max_num_iterations = 100;
  options.function_tolerance = by_our_weights ? 1e-16 : 1e-6;  // its default
  options.parameter_tolerance = by_our_weights ? 1e-14 : 1e-8;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  for (const auto& p : poses) result.poses.push_back({{p[0], p[1]}, p[2]});
  result.seconds = wall_seconds() - start;
  return result;
}

/// Distances [m] between poses of the same maps: the largest, and the median.
std::pair<double, double> distances(const adjustment_input& given, const adjustment_result& a,
                                    const adjustment_result& b) {
  std::vector<double> all;
  for (std::size_t m = 0; m < a.poses.size(); ++m)
    if (given.unknowns.of[m] != unknown_poses::fixed)
      all.push_back((a.poses[m].shift - b.poses[m].shift).norm());
  return {all.empty() ? 0 : *std::max_element(all.begin(), all.end()), all.empty() ? 0 : median(all)};
}

void compare(const survey_scenes& scenes, std::size_t count, std::uint64_t seed, int repetitions,
             int threads) {
  random_source random(seed);
  const std::vector<surveyed_map> made = scenes.make(count, random);
  const execution exec;
  const parallel_scope scope(exec, "survey");
  std::vector<position_set> sets;
  for (const surveyed_map& m : made) sets.push_back(positions_of(m.stems, "map", exec));
  std::vector<prepared_stems> maps = prepare_maps(std::move(sets), exec);
  std::optional<overlap_index> index;
  const survey_solution solution = solve_maps(maps, {}, {}, index, false, exec);
  const local_survey& solved = solution.solved;
  const unknown_poses unknowns = unknown_poses_of(solved.placed, solved.members, {});
  const adjustment_input given{maps, solved, solved.adjusted.trees, unknowns,
                               deviations_by_links(maps, solved.links)};
  double ours_best = 1e300, robust_best = 1e300, plain_best = 1e300;
  adjustment_result ours, robust, plain;
  for (int r = 0; r < repetitions; ++r) {  // in turn
    ours = adjust_by_us(given);
    plain = adjust_by_ceres(given, ours, true, threads);
    robust = adjust_by_ceres(given, ours, false, threads);
    ours_best = std::min(ours_best, ours.seconds);
    plain_best = std::min(plain_best, plain.seconds);
    robust_best = std::min(robust_best, robust.seconds);
  }
  const auto [worst, middle] = distances(given, ours, plain);
  const auto [worst_robust, middle_robust] = distances(given, ours, robust);
  std::cout << std::setw(5) << made.size() << std::setw(6) << seed << std::setw(9) << given.trees.size()
            << std::fixed << std::setprecision(3) << std::setw(9) << ours_best << std::setw(9) << plain_best
            << std::setw(9) << robust_best << std::setprecision(5) << std::setw(11) << worst * 1e3
            << std::setw(10) << middle * 1e3 << std::setprecision(2) << std::setw(11) << worst_robust * 1e3
            << std::setw(9) << middle_robust * 1e3 << std::endl;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("The adjustment of poses to trees beside Ceres Solver.", "ceres_adjustment");
  scene_options scene;
  std::vector<std::size_t> maps = {100};
  std::vector<std::uint64_t> seeds = {1};
  int repetitions = 3, threads = 1;
  app.add_option("--layout", scene.layout, "as of survey_accuracy")->capture_default_str();
  app.add_option("--maps", maps, "numbers of maps")->capture_default_str();
  app.add_option("--seeds", seeds, "seeds")->capture_default_str();
  app.add_option("--repetitions", repetitions, "of each, in turn; the best counts")->capture_default_str();
  app.add_option("--threads", threads, "of Ceres; ours has one here")->capture_default_str();
  app.add_option("--data", scene.data, "folder of stem maps")->capture_default_str();
  return support::run_program(app, argc, argv, [&] {
    scene.aliens = 0;
    const survey_scenes scenes(scene);
    std::cout << "                      seconds: wall             ours to weighted [mm]  to robust [mm]\n"
                 " maps  seed    trees     ours weighted   robust      worst    median      worst   median\n";
    for (const std::size_t count : maps)
      for (const std::uint64_t seed : seeds) compare(scenes, count, seed, repetitions, threads);
    return support::done;
  });
}
