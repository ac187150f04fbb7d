// A plot evaluated as in [GM] 5: its scans mapped, all pairs registered, its stem maps matched alone.
#pragma once

#include <globalmatch/registration.hpp>

#include "evaluated_pairs.hpp"
#include "evaluated_scans.hpp"
#include "matchers.hpp"
#include "results.hpp"
#include "stem_selection.hpp"
#include "true_transforms.hpp"
#include "truth_doubts.hpp"

#include <algorithm>
#include <cstddef>
#include <functional>
#include <iterator>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace globalmatch::benchmarks {

/// What to evaluate, and with which options.
struct evaluation_options {
  mapping_options mapping;
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  matching_options matching;
  icp_options icp;
  std::set<int> tables;                                ///< of the paper, 2 to 7
  std::vector<std::string> methods;                    ///< of `all_matchers`; empty: all
  std::vector<std::size_t> sizes = {50, 100, 200};     ///< of simplified stem maps
  std::vector<double> ranges = {5, 6, 8, 11, 15, 20};  ///< [m] of maps that are cut off there
  double max_seconds = 10;  ///< a method is stopped then, and not run again on as many stems
  int threads = 0;

  bool has(int table) const { return tables.contains(table); }
};

/// A scan mapped for the evaluation.
struct mapped_scan {
  evaluated_scan scan;
  std::optional<evaluated_scan> without = {};  ///< without the verticality constraint
  std::optional<true_stems> stems = {};        ///< and the returns that they got in this scan
  bool stems_are_of_plot = false;              ///< other scans have the same true stems
  std::size_t points = 0;
};

/// A plot, wherever its scans come from. `map(i)` is called once for each scan, in their order.
struct plot_to_evaluate {
  std::string name;
  std::vector<std::string> scans;
  true_transforms truth;
  std::size_t middle = 0;
  std::function<mapped_scan(std::size_t)> map;
};

/// Maps a scan once, or without the verticality constraint as well.
template <class Points>
mapped_scan map_for_evaluation(const Points& points, const Eigen::Isometry3d& plot_from_scan,
                               const evaluation_options& options) {
  const execution exec{.threads = options.threads};
  mapped_scan mapped{map_scan(points, plot_from_scan, options.mapping, options.up, exec)};
  mapped.points = points.size();
  if (options.has(6)) {
    mapping_options without = options.mapping;
    without.verticality.constraint = false;
    mapped.without = map_scan(points, plot_from_scan, without, options.up, exec);
  }
  return mapped;
}

class plot_evaluation {
 public:
  plot_evaluation(const plot_to_evaluate& plot, const evaluation_options& options, dataset_results& results)
      : plot_(plot), options_(options), results_(results) {}

  void run() {
    results_.plots.push_back(plot_.name);
    for (std::size_t i = 0; i < plot_.scans.size(); ++i) {
      scans_.push_back(plot_.map(i));
      add_scan(i);
    }
    if (const auto doubt = doubt_of_stems(plot_.name, scores_)) results_.doubts.push_back(*doubt);
    if (std::none_of(std::begin(pair_tables), std::end(pair_tables),
                     [&](int table) { return options_.has(table); }))
      return;
    for_each_pair([&](std::size_t source, std::size_t target) { add_pair(source, target); });
    add_doubts();
    if (options_.has(7)) match_alone();
  }

 private:
  static constexpr int pair_tables[] = {3, 4, 5, 6, 7};

  // Others are registered with the middle one, as in [GM] 5.2.2, and later ones with earlier ones.
  template <class Use>
  void for_each_pair(const Use& use) const {
    for (std::size_t target = 0; target < scans_.size(); ++target)
      for (std::size_t source = 0; source < scans_.size(); ++source) {
        const bool is_later = source > target && source != plot_.middle;
        if (target == plot_.middle ? source != target : is_later) use(source, target);
      }
  }

  void add_scan(std::size_t i) {
    const mapped_scan& mapped = scans_[i];
    scan_result result{.plot = plot_.name, .scan = plot_.scans[i], .points = mapped.points};
    result.stems = mapped.scan.map.stems.size();
    result.seconds = mapped.scan.seconds;
    if (mapped.stems) scores_.push_back(*(result.score = score_stems(mapped.scan, *mapped.stems)));
    if (mapped.without) {
      result.without_stems = mapped.without->map.stems.size();
      result.without_seconds = mapped.without->seconds;
    }
    results_.scans.push_back(result);
  }

  Eigen::Isometry3d truth(std::size_t source, std::size_t target) const {
    return plot_.truth.target_from_source(source, target);
  }

  // The plot's vertical in the frame of a scan.
  Eigen::Vector3d up_of(std::size_t scan) const {
    return plot_.truth.plot_from_scan(scan).linear().transpose().col(2);
  }

  std::size_t count_common(std::size_t source, std::size_t target) const {
    const mapped_scan &a = scans_[source], &b = scans_[target];
    if (!a.stems_are_of_plot || !b.stems_are_of_plot)
      return common_stems(a.scan, b.scan, truth(source, target)).size();
    const std::vector<std::size_t> of_a = found_stems(a.scan, *a.stems), of_b = found_stems(b.scan, *b.stems);
    std::vector<std::size_t> both;
    std::set_intersection(of_a.begin(), of_a.end(), of_b.begin(), of_b.end(), std::back_inserter(both));
    return both.size();
  }

  void add_pair(std::size_t source, std::size_t target) {
    registration_options registering{{}, options_.matching, options_.icp};
    if (target != plot_.middle) registering.icp.metric = icp_metric::none;
    const evaluated_scan &a = scans_[source].scan, &b = scans_[target].scan;
    pair_result pair{register_pair(a, b, truth(source, target), up_of(target), registering, options_.threads,
                                   normalised_)};
    if (pair.target_from_source) registered_.push_back({source, target, *pair.target_from_source});
    pair.plot = plot_.name;
    pair.source = plot_.scans[source];
    pair.target = plot_.scans[target];
    pair.with_middle = target == plot_.middle;
    pair.distance = truth(source, target).translation().norm();
    pair.common = count_common(source, target);
    pair.mapping_seconds = a.seconds + b.seconds;
    const auto run = [&](const evaluated_scan& of, const evaluated_scan& on, degrees_of_freedom dof) {
      matching_options matching = options_.matching;
      matching.dof = dof;
      return coarse(of, on, source, target, matching);
    };
    pair.four_dof = run(a, b, degrees_of_freedom::four);
    pair.six_dof = run(a, b, degrees_of_freedom::six);
    if (const auto& c = scans_[source].without, &d = scans_[target].without; c && d)
      pair.without_verticality = coarse(*c, *d, source, target, options_.matching);
    results_.pairs.push_back(pair);
  }

  void add_doubts() {
    const auto agrees = [&](const true_transforms& truth, const true_pair& pair) {
      const Eigen::Isometry3d by_truth = truth.target_from_source(pair.source, pair.target);
      const auto& sample = scans_[pair.source].scan.sample;
      return evaluate_registration(pair.target_from_source, by_truth, sample, up_of(pair.target)).success();
    };
    const truth_doubts found = doubts_of(plot_.name, plot_.scans, plot_.truth, registered_, agrees);
    results_.doubts.insert(results_.doubts.end(), found.texts.begin(), found.texts.end());
    results_.truth_is_refuted |= found.is_refuted;
  }

  // The points that e_p is measured on are those of the source, however that was mapped.
  coarse_run coarse(const evaluated_scan& source_map, const evaluated_scan& target_map, std::size_t source,
                    std::size_t target, const matching_options& matching) {
    registration_options registering{{}, matching, {}};
    registering.icp.metric = icp_metric::none;
    const evaluated_pair pair = register_pair(source_map, target_map, truth(source, target), up_of(target),
                                              registering, options_.threads, normalised_);
    return {pair.outcome == outcome::registered, pair.coarse};
  }

  // The others turn maps about the vertical alone; ours, too, unless it is said.
  matching_options levelled() const {
    matching_options matching = options_.matching;
    if (!matching.dof) matching.dof = degrees_of_freedom::four;
    return matching;
  }

  // Few stems first, so that it is known which method is too slow before it meets many.
  void match_alone() {
    std::vector<stem_selection> selections;
    for (const double range : options_.ranges) selections.push_back({.count = 0, .range = range});
    for (const std::size_t size : options_.sizes) selections.push_back({.count = size, .range = 0});
    selections.push_back({});
    for (const matcher& method : all_matchers(levelled())) {
      const auto& wanted = options_.methods;
      if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), method.name) == wanted.end()) continue;
      std::size_t max_stems = std::numeric_limits<std::size_t>::max();
      for (const stem_selection& selection : selections)
        for_each_pair([&](std::size_t source, std::size_t target) {
          match_alone(method, source, target, selection, max_stems);
        });
    }
  }

  void match_alone(const matcher& method, std::size_t source, std::size_t target,
                   const stem_selection& selection, std::size_t& max_stems) {
    const evaluated_scan &a = scans_[source].scan, &b = scans_[target].scan;
    const two_maps maps = select_stems(a, b, truth(source, target), selection);
    // Where that are the whole maps they are not matched again, but for table 7.
    const bool is_of_table = !options_.sizes.empty() && selection.count == options_.sizes[0];
    const bool is_whole =
        maps.source.size() == a.map.stems.size() && maps.target.size() == b.map.stems.size();
    if (is_whole && !selection.is_whole() && !is_of_table) return;
    const std::size_t stems = std::max(maps.source.size(), maps.target.size());
    if (stems > max_stems || maps.source.empty() || maps.target.empty()) return;
    const match_run run = method.run(maps, {.threads = options_.threads, .seconds = options_.max_seconds});
    if (run.stopped) {
      max_stems = stems - 1;
      return;
    }
    matching_result result{.plot = plot_.name, .source = plot_.scans[source], .target = plot_.scans[target]};
    result.with_middle = target == plot_.middle;
    result.method = method.name;
    result.selection = selection;
    result.source_stems = maps.source.size();
    result.target_stems = maps.target.size();
    result.common = maps.common;
    result.seconds = run.seconds;
    if (run.target_from_source)
      result.error =
          evaluate_registration(*run.target_from_source, maps.target_from_source, a.sample, up_of(target));
    results_.matchings.push_back(result);
  }

  const plot_to_evaluate& plot_;
  const evaluation_options& options_;
  dataset_results& results_;
  std::vector<mapped_scan> scans_;
  std::vector<map_score> scores_;
  std::vector<true_pair> registered_;  // as found
  normalised_errors normalised_;       // of no interest here
};

}  // namespace globalmatch::benchmarks
