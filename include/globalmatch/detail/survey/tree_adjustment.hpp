// Poses in plan adjusted to trees and targets. In: maps with poses, which stems are one tree, targets, links.
// Out: adjusted poses, weights of stems and targets, covariances.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/matrices.hpp"
#include "globalmatch/detail/core/robust.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "globalmatch/detail/survey/adjust_links.hpp"
#include "globalmatch/detail/survey/block_system.hpp"
#include "globalmatch/detail/survey/plan_pose.hpp"
#include "globalmatch/detail/survey/stem_deviations.hpp"
#include "globalmatch/detail/survey/survey_link.hpp"
#include "globalmatch/detail/survey/survey_targets.hpp"
#include "globalmatch/detail/survey/survey_trees.hpp"
#include "globalmatch/matching.hpp"

namespace globalmatch::detail {

/// The pairs of unknowns that trees, targets or links connect.
inline std::vector<std::pair<std::uint32_t, std::uint32_t>> connected_pairs(
    const tree_observations& trees, const target_observations& targets, std::span<const survey_link> links,
    const unknown_poses& unknowns) {
  auto pairs = pairs_of_landmarks(trees, targets, unknowns);
  for (const survey_link& l : links)
    if (const std::uint32_t s = unknowns.of[l.source], t = unknowns.of[l.target];
        l.used && s != unknown_poses::fixed && t != unknown_poses::fixed)
      pairs.emplace_back(s, t);
  return pairs;
}

/// A landmark, a tree or a target, as a map shows it.
struct landmark_observation {
  std::uint32_t map;
  vec2 at;           ///< [m] the map's local frame
  double precision;  ///< 1 of a stem of a typical map; of targets at their own standard deviations
};

/// The adjustment of poses in plan to landmarks, whose places are eliminated: the trees, then the targets.
/// Refers to all that it is given, but not to the targets.
class tree_adjustment {
 public:
  /// `deviations` [m] of the stems of each map in plan, along each axis. Links that are used
  /// connect the maps; those whose stems are hardly any tree hold their maps themselves. `targets`: each of
  /// maps of one component.
  tree_adjustment(std::span<const prepared_stems> maps, const tree_observations& trees,
                  std::span<const survey_link> links, const unknown_poses& unknowns,
                  std::span<const double> deviations, const target_observations& targets = {})
      : links_(links),
        unknowns_(unknowns),
        trees_(trees.size()),
        first_(trees.first),
        sigmas_(targets),
        system_(unknowns.count, connected_pairs(trees, targets, links, unknowns)) {
    std::vector<double> sorted(deviations.begin(), deviations.end());
    sigma_ = sorted.empty() ? min_stem_deviation : std::max(min_stem_deviation, median(sorted));
    for (const stem_of_map& o : trees.stems) {
      const double d = std::max(deviations[o.map], min_stem_deviation);
      seen_.push_back({o.map, maps[o.map].stems.at[o.stem].xy(), sigma_ * sigma_ / (d * d)});
    }
    target_of_.resize(targets.seen.size());
    for (const target_of_map& o : targets.seen) {
      target_of_[o.given] = seen_.size();
      seen_.push_back({o.map, o.at.xy(), sigma_ * sigma_ / (o.sigma * o.sigma)});
      target_sigmas_.push_back(o.sigma);
    }
    for (std::size_t t = 0; t < targets.size(); ++t)
      first_.push_back(trees.stems.size() + targets.first[t + 1]);
    agreement_.assign(seen_.size(), 1);
    index_stems(maps, trees);
  }

  /// Starts from where an adjustment ended: from the agreement of the stems of all trees.
  void start_from(const std::vector<double>& agreement) {
    std::copy(agreement.begin(), agreement.end(), agreement_.begin());
    has_agreement_ = true;
  }

  /// Moves the poses until convergence; observations that do not fit their landmark lose their weight. False
  /// where landmarks and links do not determine all of them.
  bool adjust(std::span<plan_pose> poses, int max_iterations = 20) {
    constexpr double converged = 1e-5;  // [m]
    const int steps = sigmas_.steps();
    for (int iteration = -steps; iteration < max_iterations; ++iteration) {
      poll_cancelled();
      place_all(poses);
      reweight_trees(iteration == -steps && !has_agreement_);
      reweight_targets(iteration == -steps);
      fill(poses);
      if (unknowns_.count == 0) return true;
      if (!system_.factorize()) return false;
      if (move_poses(poses, unknowns_, system_.solve()) < converged && sigmas_.are_final()) break;
      sigmas_.narrow();
    }
    return true;
  }

  /// Standard deviation [m] of an observation of weight 1 along each axis.
  double sigma() const { return sigma_; }
  /// Of the observations of all trees, in their order: 0 for those that belong to none, about 1 for those of
  /// a typical map, more where stems are known better.
  std::vector<double> weights() const {
    std::vector<double> all;
    for (std::size_t i = 0; i < first_[trees_]; ++i) all.push_back(weight(i));
    return all;
  }
  /// Tukey weights of the observations of all trees, in their order.
  std::vector<double> agreement() const {
    return {agreement_.begin(), agreement_.begin() + std::ptrdiff_t(first_[trees_])};
  }
  /// Of the observations of all targets, in their order, beside their standard deviations: 0 to 1.
  std::vector<double> target_weights() const {
    return {agreement_.begin() + std::ptrdiff_t(first_[trees_]), agreement_.end()};
  }

  /// Covariances of shift and yaw of the poses, along the axes of the survey; 0 of fixed ones. After
  /// `adjust`.
  std::vector<mat3> covariances() const {
    std::vector<mat3> result(unknowns_.of.size());
    if (unknowns_.count == 0) return result;
    const auto blocks = system_.inverse_blocks();
    for (std::size_t m = 0; m < result.size(); ++m)
      if (unknowns_.of[m] != unknown_poses::fixed)
        for (int c = 0; c < 3; ++c)
          for (int r = 0; r < 3; ++r) result[m](r, c) = blocks[unknowns_.of[m]](r, c) * sigma_ * sigma_;
    return result;
  }

 private:
  void place_all(std::span<const plan_pose> poses) {
    placed_.resize(seen_.size());
    for (std::size_t i = 0; i < seen_.size(); ++i) placed_[i] = poses[seen_[i].map] * seen_[i].at;
  }

  /// Weighted mean [m] of where maps show a landmark.
  vec2 place_of(std::size_t landmark) const {
    vec2 sum = vec2{};
    double total = 0;
    for (std::size_t i = first_[landmark]; i < first_[landmark + 1]; ++i) {
      sum += weight(i) * placed_[i];
      total += weight(i);
    }
    return total > 0 ? sum / total : placed_[first_[landmark]];
  }
  /// Of the weights of a landmark's observations.
  double total_weight(std::size_t landmark) const {
    double total = 0;
    for (std::size_t i = first_[landmark]; i < first_[landmark + 1]; ++i) total += weight(i);
    return total;
  }

  double precision(std::size_t i) const {
    if (i < first_[trees_]) return seen_[i].precision;
    const double sigma = target_sigmas_[i - first_[trees_]];
    const double share = sigma / sigmas_(sigma);
    return seen_[i].precision * share * share;
  }
  double weight(std::size_t i) const { return agreement_[i] * precision(i); }
  double leniency(std::size_t i) const { return sigmas_.leniency(target_sigmas_[i - first_[trees_]]); }

  /// Notes which observation each stem is, and which tree's.
  void index_stems(std::span<const prepared_stems> maps, const tree_observations& trees) {
    first_stem_.assign(1, 0);
    for (const prepared_stems& map : maps) first_stem_.push_back(first_stem_.back() + map.stems.size());
    observation_of_.assign(first_stem_.back(), none);
    tree_of_.resize(trees.stems.size());
    for (std::size_t t = 0; t < trees.size(); ++t)
      for (std::size_t i = trees.first[t]; i < trees.first[t + 1]; ++i) {
        tree_of_[i] = t;
        observation_of_[first_stem_[trees.stems[i].map] + trees.stems[i].stem] = i;
      }
  }

  /// Trees that stems paired by the link are, by how they agree.
  double trees_of_link(const survey_link& l) const {
    double shared = 0;
    for (const correspondence& c : l.correspondences) {
      const std::size_t i = observation_of_[first_stem_[l.source] + c.source],
                        k = observation_of_[first_stem_[l.target] + c.target];
      if (i != none && k != none && tree_of_[i] == tree_of_[k])
        shared += std::min(agreement_[i], agreement_[k]);
    }
    return shared;
  }
  /// Whether landmarks hold the maps of a link together: targets by themselves, or else trees.
  bool has_landmarks(const survey_link& l) const {
    constexpr double min_trees = 3, min_agreement = 0.01;
    if (!l.is_of_targets()) return trees_of_link(l) >= min_trees;
    return std::count_if(l.targets.begin(), l.targets.end(), [&](const correspondence& c) {
             return std::min(agreement_[target_of_[c.source]], agreement_[target_of_[c.target]]) >
                    min_agreement;
           }) >= 2;
  }

  /// Medians of where maps show a landmark, along both axes, each counted by its precision; of two the mean.
  vec2 median_place_of(std::size_t landmark) const {
    if (first_[landmark + 1] - first_[landmark] == 2) return place_of(landmark);
    std::vector<std::pair<double, double>> x, y;  // with precision
    for (std::size_t i = first_[landmark]; i < first_[landmark + 1]; ++i) {
      const vec2 at = placed_[i];
      x.emplace_back(at.x, precision(i));
      y.emplace_back(at.y, precision(i));
    }
    return {weighted_median(x), weighted_median(y)};
  }

  /// Agreement of observations follows the residuals, at first those from the median: one stem that is off
  /// would have the mean of three refuse all.
  void reweight_trees(bool first) {
    const double largest = sigma_ * tukey_constant;
    for (std::size_t t = 0; t < trees_; ++t) {
      const std::size_t begin = first_[t], end = first_[t + 1];
      if (end - begin < 2) continue;
      const vec2 place = first ? median_place_of(t) : place_of(t);
      double total = 0;
      for (std::size_t i = begin; i < end; ++i) total += precision(i);
      for (std::size_t i = begin; i < end; ++i) {
        const double of_mean = total / (total - precision(i));  // which is nearer to its stems than the tree
        const double square = (placed_[i] - place).squared_norm() * of_mean * precision(i);
        agreement_[i] = tukey_weight(square / (largest * largest));
      }
    }
  }

  /// That of targets, of which there are few, follows the residuals from the others of each: from a mean that
  /// holds the target itself those that have lost weight would seem further off. At first, and where the
  /// others have no weight, from the median.
  void reweight_targets(bool first) {
    constexpr double negligible = 1e-6;
    const double largest = sigma_ * tukey_constant;
    for (std::size_t t = trees_; t + 1 < first_.size(); ++t) {
      const std::size_t begin = first_[t], end = first_[t + 1];
      if (end - begin < 2) continue;
      const vec2 middle = median_place_of(t);
      vec2 sum = vec2{};
      double total = 0, all = 0;
      for (std::size_t i = begin; i < end; ++i) {
        sum += weight(i) * placed_[i];
        total += weight(i);
        all += precision(i);
      }
      for (std::size_t i = begin; i < end; ++i) {
        const double own = weight(i), rest = (all - precision(i)) / all;
        const bool has_others = !first && total - own > negligible * all;
        const vec2 place = has_others ? (sum - own * placed_[i]) / (total - own) : middle;
        const double square =
            (placed_[i] - place).squared_norm() * precision(i) * (has_others ? rest : 1 / rest) * leniency(i);
        agreement_[i] = tukey_weight(square / (largest * largest));
      }
    }
  }

  /// Adds the links that landmarks do not stand for: a map that was placed less well than others may be too
  /// far off for its stems to be theirs, and nothing else would hold it.
  void add_links_without_landmarks(std::span<const plan_pose> poses) {
    constexpr double min_weight = 1e-6;
    for (const survey_link& l : links_) {
      if (!l.used || has_landmarks(l)) continue;
      const double weight =
          std::max(min_weight, weight_of(l, link_residual(l, poses[l.source], poses[l.target])));
      add_link(system_, unknowns_, l, poses[l.source], poses[l.target],
               (l.covariance / (weight * sigma_ * sigma_)).inverse());
    }
  }

  void fill(std::span<const plan_pose> poses) {
    using matrix = block_system<3>::block;
    using jacobian = Eigen::Matrix<double, 2, 3>;
    system_.set_zero();
    add_links_without_landmarks(poses);
    std::vector<jacobian> of_pose;
    for (std::size_t t = 0; t + 1 < first_.size(); ++t) {
      const std::size_t begin = first_[t], end = first_[t + 1];
      if (end - begin < 2) continue;
      const double total = total_weight(t);
      if (!(total > 0)) continue;
      const vec2 place = place_of(t);
      of_pose.clear();
      for (std::size_t i = begin; i < end; ++i) {
        const vec2 at = placed_[i], lever = quarter_turned(at - poses[seen_[i].map].shift);
        jacobian j;
        j << 1, 0, lever.x, 0, 1, lever.y;
        of_pose.push_back(j);
      }
      for (std::size_t i = begin; i < end; ++i) {
        const std::uint32_t own = unknowns_.of[seen_[i].map];
        if (own == unknown_poses::fixed || !(weight(i) > 0)) continue;
        const jacobian& j = of_pose[i - begin];
        const vec2 off = placed_[i] - place;
        system_.add_right(own, -weight(i) * (j.transpose() * Eigen::Vector2d(off.x, off.y)));
        for (std::size_t k = begin; k < end; ++k) {
          const std::uint32_t other = unknowns_.of[seen_[k].map];
          if (other == unknown_poses::fixed || other > own || !(weight(k) > 0)) continue;
          const double factor = (k == i ? weight(i) : 0) - weight(i) * weight(k) / total;
          const matrix product = j.transpose() * of_pose[k - begin];
          system_.add(own, other, factor * product);
        }
      }
    }
  }

  static constexpr std::size_t none = ~std::size_t(0);

  std::span<const survey_link> links_;
  const unknown_poses& unknowns_;
  std::size_t trees_;                       // number of those, which are the first landmarks
  std::vector<std::size_t> first_;          // observation of each landmark; one more than landmarks
  std::vector<landmark_observation> seen_;  // landmark by landmark
  std::vector<double> target_sigmas_;       // [m] of the observations of targets
  narrowing_sigmas sigmas_;
  double sigma_ = 0;                         // deviation of a typical map
  std::vector<double> agreement_;            // Tukey weight of each observation
  bool has_agreement_ = false;               // from another adjustment
  std::vector<vec2> placed_;                 // [m] each observation
  std::vector<std::size_t> first_stem_;      // of each map, among the stems of all
  std::vector<std::size_t> observation_of_;  // each stem of all; `none` where it is of no tree
  std::vector<std::size_t> tree_of_;         // each observation of a tree
  std::vector<std::size_t> target_of_;       // observation that each target of the options is
  block_system<3> system_;
};

}  // namespace globalmatch::detail
