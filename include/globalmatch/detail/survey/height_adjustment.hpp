// Heights of maps adjusted to those of the trees and targets that they have in common.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/disjoint_sets.hpp"
#include "globalmatch/detail/core/robust.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "globalmatch/detail/survey/block_system.hpp"
#include "globalmatch/detail/survey/survey_targets.hpp"
#include "globalmatch/detail/survey/survey_trees.hpp"

namespace globalmatch::detail {

struct survey_heights {
  std::vector<double> of_map;       ///< [m] by which each is raised
  std::vector<double> sigma;        ///< [m] of these, against the datum of the component
  std::vector<std::uint8_t> known;  ///< by landmarks in common with the datum, or with maps that have some
  double stem_sigma = 0;            ///< [m] of a stem's height
  std::vector<double> weights;      ///< of the observations of the trees
  std::vector<double> target_weights = {};  ///< of those of targets, beside their standard deviations
};

/// The adjustment of heights to those of landmarks, which are eliminated: the trees, then the targets. Refers
/// to all that it is given, but not to trees and targets.
class height_adjustment {
 public:
  /// `targets`: each of maps of one component.
  height_adjustment(std::span<const prepared_stems> maps, const tree_observations& trees,
                    const target_observations& targets, const unknown_poses& unknowns,
                    survey_heights& heights)
      : trees_(trees.size()),
        first_(trees.first),
        unknowns_(unknowns),
        heights_(heights),
        sigmas_(targets),
        system_(unknowns.count, pairs_of_landmarks(trees, targets, unknowns)) {
    for (const stem_of_map& o : trees.stems)
      seen_.push_back(
          {o.map, maps[o.map].stems.at[o.stem].z, 0, maps[o.map].stems.has_heights && heights.known[o.map]});
    for (const target_of_map& o : targets.seen)
      seen_.push_back({o.map, o.at.z, o.sigma, heights.known[o.map] != 0});
    for (std::size_t t = 0; t < targets.size(); ++t)
      first_.push_back(trees.stems.size() + targets.first[t + 1]);
    for (const observation& o : seen_) agreement_.push_back(o.counts ? 1 : 0);
  }

  /// False where the landmarks do not determine all heights; those that they do not are not known any more.
  bool adjust(int max_iterations) {
    constexpr double converged = 1e-5;  // [m]
    for (int iteration = -sigmas_.steps(); iteration < max_iterations; ++iteration) {
      poll_cancelled();
      reweight_trees();
      reweight_targets();
      if (unknowns_.count == 0) break;
      if (forget_unconnected()) return false;
      fill();
      if (!system_.factorize()) {
        for (std::size_t m = 0; m < unknowns_.of.size(); ++m)
          if (unknowns_.of[m] != unknown_poses::fixed) heights_.known[m] = false;
        return false;
      }
      const Eigen::VectorXd change = system_.solve();
      for (std::size_t m = 0; m < unknowns_.of.size(); ++m)
        if (unknowns_.of[m] != unknown_poses::fixed)
          heights_.of_map[m] += change[Eigen::Index(unknowns_.of[m])];
      if (change.cwiseAbs().maxCoeff() < converged && sigmas_.are_final()) break;
      sigmas_.narrow();
    }
    note_results();
    return true;
  }

 private:
  struct observation {
    std::uint32_t map;
    double z;      // [m] in its map
    double sigma;  // [m] of a target; 0 of stems
    bool counts;   // its map has heights, and that of the map is known
  };
  /// [m] Of heights of stems that agree to the bit, and where there are none.
  static constexpr double min_sigma = 1e-3;

  double placed(std::size_t i) const { return seen_[i].z + heights_.of_map[seen_[i].map]; }
  double unit_sigma() const { return std::max(min_sigma, heights_.stem_sigma); }
  double precision(std::size_t i) const {
    if (i < first_[trees_]) return 1;
    const double share = unit_sigma() / sigmas_(seen_[i].sigma);
    return share * share;
  }
  double weight(std::size_t i) const { return agreement_[i] * precision(i); }

  void note_results() {
    const auto of_targets = agreement_.begin() + std::ptrdiff_t(first_[trees_]);
    heights_.weights.assign(agreement_.begin(), of_targets);
    heights_.target_weights.assign(of_targets, agreement_.end());
    if (unknowns_.count == 0) return;
    const auto variances = system_.inverse_blocks();
    for (std::size_t m = 0; m < unknowns_.of.size(); ++m)
      if (unknowns_.of[m] != unknown_poses::fixed)
        heights_.sigma[m] = unit_sigma() * std::sqrt(variances[unknowns_.of[m]](0, 0));
  }

  /// Mean height [m] of a landmark, and the sum of its weights.
  std::pair<double, double> mean(std::size_t landmark) const {
    double sum = 0, total = 0;
    for (std::size_t i = first_[landmark]; i < first_[landmark + 1]; ++i)
      sum += weight(i) * placed(i), total += weight(i);
    return {total > 0 ? sum / total : 0, total};
  }
  /// Median height [m] of those of its observations that count, and their number.
  std::pair<double, std::size_t> middle(std::size_t landmark) const {
    std::vector<double> of_landmark;
    for (std::size_t i = first_[landmark]; i < first_[landmark + 1]; ++i)
      if (seen_[i].counts) of_landmark.push_back(placed(i));
    return {median(of_landmark), of_landmark.size()};
  }

  void reweight_trees() {
    std::vector<double> off(first_[trees_], 0), sample;
    double redundancy = 0;
    for (std::size_t t = 0; t < trees_; ++t) {
      const auto [height, number] = middle(t);
      if (number < 2) continue;
      const auto count = double(number);
      std::optional<double> before;
      for (std::size_t i = first_[t]; i < first_[t + 1]; ++i) {
        if (!seen_[i].counts) continue;
        off[i] = (placed(i) - height) * std::sqrt(count / (count - 1));
        // From differences: of an odd number of heights one is the median, and 0 off.
        if (before) sample.push_back(std::abs(placed(i) - *before) / std::numbers::sqrt2);
        before = placed(i);
      }
      redundancy += count - 1;
    }
    if (sample.empty()) return;
    heights_.stem_sigma = std::max(min_sigma, deviation_of_median * median(sample) *
                                                  growth_of_residuals(redundancy, double(unknowns_.count)));
    const double largest = tukey_constant * heights_.stem_sigma;
    for (std::size_t i = 0; i < off.size(); ++i)
      if (seen_[i].counts) agreement_[i] = tukey_weight(off[i] * off[i] / (largest * largest));
  }

  /// As `tree_adjustment` does in plan: by the residuals from the others of a target, or from the median.
  void reweight_targets() {
    constexpr double negligible = 1e-6;
    const double largest = tukey_constant * unit_sigma();
    for (std::size_t t = trees_; t + 1 < first_.size(); ++t) {
      const auto [height, count] = middle(t);
      if (count < 2) continue;
      const auto [weighted, total] = mean(t);
      double all = 0;
      for (std::size_t i = first_[t]; i < first_[t + 1]; ++i)
        if (seen_[i].counts) all += precision(i);
      for (std::size_t i = first_[t]; i < first_[t + 1]; ++i) {
        if (!seen_[i].counts) continue;
        const double own = weight(i), rest = (all - precision(i)) / all;
        const bool has_others = !is_first_ && total - own > negligible * all;
        const double off =
            placed(i) - (has_others ? (total * weighted - own * placed(i)) / (total - own) : height);
        const double square =
            off * off * precision(i) * (has_others ? rest : 1 / rest) * sigmas_.leniency(seen_[i].sigma);
        agreement_[i] = tukey_weight(square / (largest * largest));
      }
    }
    is_first_ = false;
  }

  /// Takes the heights for unknown that no landmarks connect with a fixed one, and says whether there are
  /// any.
  bool forget_unconnected() {
    constexpr double min_weight = 1e-3;
    const std::size_t maps = unknowns_.of.size();
    disjoint_sets connected(maps);
    for (std::size_t t = 0; t + 1 < first_.size(); ++t) {
      const observation* first = nullptr;
      for (std::size_t i = first_[t]; i < first_[t + 1]; ++i) {
        if (!(agreement_[i] > min_weight)) continue;
        if (first) connected.join(seen_[i].map, first->map);
        first = &seen_[i];
      }
    }
    std::vector<std::uint8_t> is_fixed(maps);
    for (std::uint32_t m = 0; m < maps; ++m)
      if (unknowns_.of[m] == unknown_poses::fixed && heights_.known[m]) is_fixed[connected.find(m)] = true;
    bool any = false;
    for (std::uint32_t m = 0; m < maps; ++m)
      if (heights_.known[m] && !is_fixed[connected.find(m)]) heights_.known[m] = false, any = true;
    return any;
  }

  void fill() {
    system_.set_zero();
    for (std::size_t t = 0; t + 1 < first_.size(); ++t) {
      const auto [middle, total] = mean(t);
      if (!(total > 0)) continue;
      for (std::size_t i = first_[t]; i < first_[t + 1]; ++i) {
        const std::uint32_t own = unknowns_.of[seen_[i].map];
        if (own == unknown_poses::fixed || !(weight(i) > 0)) continue;
        add_right(own, -weight(i) * (placed(i) - middle));
        for (std::size_t k = first_[t]; k < first_[t + 1]; ++k) {
          const std::uint32_t other = unknowns_.of[seen_[k].map];
          if (other == unknown_poses::fixed || other > own || !(weight(k) > 0)) continue;
          add(own, other, (k == i ? weight(i) : 0) - weight(i) * weight(k) / total);
        }
      }
    }
  }
  void add_right(std::size_t row, double summand) {
    system_.add_right(row, block_system<1>::vector::Constant(summand));
  }
  void add(std::size_t row, std::size_t column, double summand) {
    system_.add(row, column, block_system<1>::block::Constant(summand));
  }

  std::size_t trees_;               // number of those, which are the first landmarks
  std::vector<std::size_t> first_;  // observation of each landmark; one more than landmarks
  std::vector<observation> seen_;   // landmark by landmark
  const unknown_poses& unknowns_;
  survey_heights& heights_;
  narrowing_sigmas sigmas_;
  std::vector<double> agreement_;  // Tukey weight of each observation
  bool is_first_ = true;           // iteration
  block_system<1> system_;
};

}  // namespace globalmatch::detail
