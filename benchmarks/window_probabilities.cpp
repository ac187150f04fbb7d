// How probable is a match of real stem maps said to be, and how often is it right? Windows of real maps, of
// which half overlap and half have nothing in common.
#include <globalmatch/stem_matching.hpp>

#include "calibration.hpp"
#include "map_windows.hpp"
#include "support/atomic_file.hpp"
#include "support/programs/command_line.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <iostream>
#include <utility>
#include <vector>

using namespace globalmatch;
using namespace globalmatch::benchmarks;

namespace {

/// Pairs of maps with so much in common.
struct success {
  std::size_t pairs = 0, best_right = 0, registered = 0, wrong = 0;
};

bool is_best_right(const matching& result, const two_maps& maps, double noise) {
  return !result.hypotheses.empty() && is_right(result.hypotheses.front().target_from_source, maps, noise);
}

/// What a best hypothesis was.
struct observed {
  double log10_nfa = 0;
  bool is_right = false;
};

/// Coefficients of the probability that make the outcomes most likely: Newton's method, with hardly any
/// penalty.
Eigen::Vector2d fit_logistic(const std::vector<observed>& outcomes) {
  constexpr double penalty = 1e-6, min_log10_nfa = -6;
  Eigen::Vector2d w = Eigen::Vector2d::Zero();
  for (int iteration = 0; iteration < 50; ++iteration) {
    Eigen::Matrix2d curvature = penalty * Eigen::Matrix2d::Identity();
    Eigen::Vector2d slope = -penalty * w;
    for (const observed& o : outcomes) {
      const Eigen::Vector2d x(1, std::max(o.log10_nfa, min_log10_nfa));
      const double p = 1 / (1 + std::exp(-w.dot(x)));
      curvature += p * (1 - p) * x * x.transpose();
      slope += (double(o.is_right) - p) * x;
    }
    w += curvature.ldlt().solve(slope);
  }
  return w;
}

void write_line(std::ostream& csv, std::size_t common, double noise, const matching& m, bool right) {
  const auto& h = m.hypotheses;
  constexpr double none = 99;
  csv << common << ',' << noise << ',' << to_string(m.outcome) << ',' << right << ','
      << (h.empty() ? none : h[0].log10_nfa) << ',' << (h.size() < 2 ? none : h[1].log10_nfa) << ','
      << m.funnel.correspondences << ',' << m.inlier_threshold << ',' << m.probability << '\n';
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Calibration of probabilities on windows of real stem maps, half of them unrelated.",
               "window_probabilities");
  std::vector<std::filesystem::path> files;
  std::size_t pairs = 2000, max_stems = 120, min_common = 8;
  std::uint64_t seed = 1;
  std::filesystem::path csv_file = "window_probabilities.csv";
  app.add_option("MAP", files, "stem maps (CSV) that windows are cut from")->required();
  app.add_option("--pairs", pairs, "related and unrelated ones, each")->capture_default_str();
  app.add_option("--max-stems", max_stems, "of a window")->capture_default_str();
  app.add_option("--min-common", min_common, "of the pairs whose success is printed")->capture_default_str();
  app.add_option("--seed", seed, "of all that is random")->capture_default_str();
  app.add_option("--csv", csv_file, "file with a line for each pair")->capture_default_str();

  return support::run_program(app, argc, argv, [&] {
    const std::vector<positions> maps = read_maps(files);
    const window_source windows(maps, max_stems);
    random_source random(seed);
    support::atomic_file csv(csv_file);
    csv.stream()
        << "common,noise,outcome,best_right,log10_nfa,second_log10_nfa,pairs,threshold,probability\n";
    std::vector<prediction> said;
    std::vector<observed> outcomes;
    const auto observe = [&](const matching& m, bool right) {
      said.push_back({m.probability, right});
      if (m.hypotheses.empty() || m.outcome == outcome::ambiguous) return;
      if (m.funnel.correspondences >= std::size_t(decision_options{}.min_correspondences))
        outcomes.push_back({m.hypotheses.front().log10_nfa, right});
    };
    success enough_common;
    double max_of_unrelated = 0;
    for (std::size_t i = 0; i < pairs; ++i) {
      const double noise = any_of<double>({0.02, 0.05, 0.1}, random);
      const window_pair related = windows.overlapping(noise, random);
      const matching found = match_stems(related.maps.source, related.maps.target);
      const bool right = is_best_right(found, related.maps, noise);
      observe(found, right);
      write_line(csv.stream(), related.common, noise, found, right);
      if (related.common >= min_common) {
        ++enough_common.pairs;
        enough_common.best_right += right;
        enough_common.registered += found.target_from_source && right;
        enough_common.wrong += found.target_from_source && !right;
      }
      const unrelated other = windows.pair(random);
      const matching nothing = match_stems(other.source, other.target);
      observe(nothing, false);
      write_line(csv.stream(), 0, noise, nothing, false);
      max_of_unrelated = std::max(max_of_unrelated, nothing.probability);
    }
    csv.commit();
    print_calibration(std::move(said));
    std::cout << "\nconstant, coefficient of log10 NFA: " << fit_logistic(outcomes).transpose() << "\n";
    std::cout << "\nlargest probability of unrelated maps " << max_of_unrelated << "\nwith " << min_common
              << " common stems or more: " << enough_common.pairs << ", best hypothesis right "
              << enough_common.best_right << ", registered " << enough_common.registered << ", wrongly "
              << enough_common.wrong << "\n";
    return support::done;
  });
}
