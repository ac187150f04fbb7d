// Null model of positions: could so many stems match at random? An a-contrario measure after [DMM] Desolneux,
// Moisan and Morel 2000, Meaningful alignments, Int. J. Computer Vision 40(1).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/matching/background_density.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/detail/matching/lattice_of_few.hpp"
#include "globalmatch/detail/matching/matching_context.hpp"

namespace globalmatch::detail {

/// What is expected of two unrelated maps. Refers to them.
class null_model {
 public:
  /// `thresholds` [m] are those that stems may be paired at. What is asked at them, and at `others`, is
  /// computed once. `target_background` is that of the target stems.
  null_model(const matching_context& context, std::shared_ptr<const background_density> target_background,
             std::span<const double> thresholds, std::span<const double> others = {})
      : context_(context),
        target_(std::move(target_background)),
        source_extent_(extent(context.source)),
        step_(step_of(std::min(context.source.cell_area, context.target.cell_area))),
        thresholds_(std::max<std::size_t>(1, thresholds.size())),
        least_(compute(min_residual)) {
    for (const auto& asked : {thresholds, others})
      for (const double inlier_threshold : asked) insert(compute(inlier_threshold));
  }

  /// The same when nothing is known of the target. Cost: linear in the stems.
  explicit null_model(const matching_context& context, std::span<const double> thresholds = {})
      : null_model(context, std::make_shared<background_density>(context.target, context.target_index),
                   thresholds) {}

  /// Probability that a source stem among the target stems is within `inlier_threshold` [m] of one under the
  /// null model.
  double inlier_probability(double inlier_threshold) const { return at(inlier_threshold).inlier_probability; }

  /// Where source stems stand much more densely than target stems, several of them are near the same target
  /// stem, and a clump of them is near all that stand there: from now on transforms are then scored both
  /// ways, and the larger tail counts. Before anything else. Cost: linear in the source stems.
  void include_reversed() {
    include_reversed(std::make_shared<background_density>(context_.source, context_.source_index));
  }

  /// The same where the background density of the source stems is known.
  void include_reversed(std::shared_ptr<const background_density> of_source) {
    constexpr double much_more_densely = 2;
    // At the smallest residual the probability is the mean density times an area.
    if (of_source->poisson_inlier_probability(min_residual + step_) <=
        much_more_densely * least_.poisson_inlier_probability)
      return;
    std::vector<double> thresholds;
    for (const probabilities& known : known_) thresholds.push_back(known.inlier_threshold);
    reversed_maps_ = std::make_unique<const matching_context>(context_.reversed());
    reversed_ = std::make_unique<null_model>(*reversed_maps_, std::move(of_source), thresholds);
  }

  /// From now on chance is at least as good as it is along the lattice of these stems, and of few others.
  void include_lattice_of(const background_density& plantation, const lattice_of_few& few) {
    if (is_lattice_left_out_) return;
    if (reversed_) reversed_->include_lattice_of(plantation, few);
    const auto include = [&](probabilities& known) {
      const double wider = known.inlier_threshold + step_;
      known.inlier_probability =
          std::max({known.inlier_probability, plantation.lattice_inlier_probability(wider),
                    few.inlier_probability(wider)});
    };
    include(least_);
    for (probabilities& known : known_) include(known);
  }

  /// From now on stems stand at random: a prior excludes all transforms that a lattice would explain but one.
  void leave_out_lattice() {
    is_lattice_left_out_ = true;
    if (reversed_) reversed_->leave_out_lattice();
    least_.inlier_probability = least_.poisson_inlier_probability;
    for (probabilities& known : known_) known.inlier_probability = known.poisson_inlier_probability;
  }

  /// Residuals of source stems under a transform.
  struct residual_set {
    double expected = 0;            ///< stems that target stems surround
    double prior_sigmas = 0;        ///< of the transform from the prior, if there is one
    std::vector<double> residuals;  ///< [m] from the nearest target stem, increasing, where one is near
    /// Sums of the probabilities of being as near under the null model, of the first residuals.
    std::vector<double> cumulative_probability;
    std::vector<residual_set> reversed;  ///< of the target stems, or none

    double matched(double inlier_threshold) const {
      return double(std::lower_bound(residuals.begin(), residuals.end(), inlier_threshold) -
                    residuals.begin());
    }
  };

  /// Transforms source stems, some thousands from all over where both maps are large, and looks for target
  /// stems within `search_radius` [m] of them.
  residual_set residuals_under(const rigid& target_from_source, double search_radius) const {
    constexpr std::size_t max_sampled = 8192;
    const std::size_t smaller = std::min(context_.source.size(), context_.target.size());
    const std::size_t step = std::max<std::size_t>(1, (smaller + max_sampled - 1) / max_sampled);
    residual_set result;
    if (context_.prior) result.prior_sigmas = context_.prior->deviation(target_from_source).sigmas;
    std::size_t visited = 0;
    const auto look = [&](stem_index s) {
      if (visited++ % step != 0) return;
      matching_context::poll_cancelled_at(visited / step);
      const vec3 transformed = target_from_source * context_.source.at[s];
      if (target_->surrounds(transformed)) ++result.expected;
      double residual = search_radius;
      context_.for_each_inlier(transformed, search_radius, [&](stem_index, double distance) {
        if (distance < residual) residual = distance;
      });
      if (residual < search_radius) result.residuals.push_back(residual);
    };
    if (context_.source.size() > smaller && context_.horizontal_distances()) {  // those that may be near
      const disc around = disc_around_target(search_radius);
      context_.for_each_source_within(target_from_source.inverse() * around.center, around.radius, look);
    } else {
      for (stem_index s = 0; s < context_.source.size(); ++s) look(s);
    }
    sort_numbers(result.residuals);
    result.cumulative_probability =
        cumulative_probabilities(result.residuals, &probabilities::inlier_probability);
    if (reversed_)
      result.reversed.push_back(reversed_->residuals_under(target_from_source.inverse(), search_radius));
    return result;
  }

  /// Whether chance does as well as this transform for the source stems within `radius` [m horizontal] of
  /// `center`. Not where target stems surround few of them: those are no evidence.
  bool explains_around(const rigid& target_from_source, const vec3& center, double radius,
                       double inlier_threshold) const {
    constexpr double min_sample = 100, max_sample = 1000, significance_level = 1e-3;
    const double in_spacings = radius / context_.source_index->spacing();
    const double stems =
        std::min(double(context_.source.size()), std::numbers::pi * (in_spacings * in_spacings));
    const auto step = std::max<std::size_t>(1, std::size_t(stems / max_sample));
    double tested = 0, inliers = 0;
    std::size_t passed = 0;
    context_.for_each_source_within(center, radius, [&](stem_index s) {
      if (passed++ % step != 0) return;
      const vec3 transformed = target_from_source * context_.source.at[s];
      const bool is_inlier = context_.has_inlier(transformed, inlier_threshold);
      inliers += is_inlier;
      tested += is_inlier || target_->surrounds(transformed);
    });
    return tested > min_sample && log_binomial_tail(inliers, tested, inlier_probability(inlier_threshold)) >
                                      std::log(significance_level);
  }

  /// Logarithm to base 10 of the NFA at an inlier threshold [m]: transforms that are expected to place
  /// stems as near to others as `set`. An inlier counts by 1 less the probability, among random inliers,
  /// of being as near: 1 to 0, evenly, if it is a random one (the horizontal score of Torr and Zisserman
  /// 2000, MLESAC, Computer Vision and Image Understanding 78). The tests are all transforms that two pairs
  /// of stems fix (three in 6-DoF), at all thresholds; as many pairs are then no evidence. After Moisan and
  /// Stival 2004, A probabilistic criterion to detect rigid point matches, Int. J. Computer Vision 57(3).
  double log10_nfa(const residual_set& set, double inlier_threshold) const {
    return (log_number_of_tests(inlier_threshold, set.prior_sigmas) +
            log_tail(set, inlier_threshold, fixing_pairs(), &null_model::tail_as_known)) /
           std::numbers::ln10;
  }

  /// Scores a hypothesis, whose residuals are `set`, at its threshold.
  void score(local_hypothesis& h, const residual_set& set) const {
    score(h, set, log_number_of_tests(h.inlier_threshold, set.prior_sigmas), fixing_pairs());
  }

  /// The same for a transform that was not searched for: the tests are the thresholds, and no pairs fix it.
  void score_given(local_hypothesis& h, const residual_set& set) const {
    score(h, set, std::log(double(thresholds_)), 0);
  }

 private:
  static constexpr double min_residual = 1e-4;  // [m] no position is known better

  /// What is known at a threshold [m].
  struct probabilities {
    double inlier_threshold, inlier_probability, poisson_inlier_probability;
  };

  void insert(const probabilities& asked) {
    known_.push_back(asked);
    for (std::size_t i = known_.size() - 1;
         i > 0 && known_[i].inlier_threshold < known_[i - 1].inlier_threshold; --i)
      std::swap(known_[i], known_[i - 1]);
  }

  probabilities at(double inlier_threshold) const {
    for (const probabilities& known : known_)
      if (known.inlier_threshold == inlier_threshold) return known;
    return compute(inlier_threshold);
  }

  probabilities compute(double inlier_threshold) const {
    const double wider = inlier_threshold + step_;
    const double at_random = target_->poisson_inlier_probability(wider);
    if (is_lattice_left_out_) return {inlier_threshold, at_random, at_random};
    return {inlier_threshold, std::max(at_random, target_->lattice_inlier_probability(wider)), at_random};
  }

  /// Sums of the probabilities of being as near, of the first residuals [m, increasing]. Between the
  /// thresholds that are known they grow with the area of the circle. Copied stems, whose residuals are 0,
  /// are as probable as others, and those of an exact lattice are certain.
  std::vector<double> cumulative_probabilities(const std::vector<double>& residuals,
                                               double probabilities::*of) const {
    const auto square = [](double d) { return d * d; };
    std::vector<double> sums;
    sums.reserve(residuals.size());
    probabilities below = least_;
    std::size_t above = 0;
    double sum = 0;
    for (const double given : residuals) {
      const double residual = std::max(given, min_residual);
      while (above < known_.size() && known_[above].inlier_threshold <= residual) below = known_[above++];
      if (above == known_.size()) {
        sum += compute(residual).*of;
      } else {
        const probabilities& next = known_[above];
        const double share = (square(residual) - square(below.inlier_threshold)) /
                             (square(next.inlier_threshold) - square(below.inlier_threshold));
        sum += below.*of + share * (next.*of - below.*of);
      }
      sums.push_back(sum);
    }
    return sums;
  }

  /// A disc that holds the target stems, and what is near or around them.
  struct disc {
    vec3 center;
    double radius = 0;  // [m]
  };
  disc disc_around_target(double search_radius) const {
    disc result;
    for (const vec3& p : context_.target.at) result.center += p / double(context_.target.size());
    for (const vec3& p : context_.target.at)
      result.radius = std::max(result.radius, (p - result.center).xy().norm());
    result.radius += std::max(search_radius, target_->surroundings());
    return result;
  }

  /// Pairs that fix a transform.
  double fixing_pairs() const { return context_.dof == degrees_of_freedom::four ? 2 : 3; }

  void score(local_hypothesis& h, const residual_set& set, double log_tests, double fixing) const {
    const auto scored = [&](auto tail) {
      return (log_tests + log_tail(set, h.inlier_threshold, fixing, tail)) / std::numbers::ln10;
    };
    h.log10_nfa = scored(&null_model::tail_as_known);
    h.log10_nfa_poisson = scored(&null_model::tail_at_random);
  }

  /// The larger of the tails both ways, if there are two; `tail` is one of those below.
  template <class Tail>
  double log_tail(const residual_set& set, double inlier_threshold, double fixing, Tail tail) const {
    const double found = (this->*tail)(set, inlier_threshold, fixing);
    if (set.reversed.empty()) return found;
    return std::max(found, (*reversed_.*tail)(set.reversed[0], inlier_threshold, fixing));
  }

  /// With all that is known of the maps.
  double tail_as_known(const residual_set& set, double inlier_threshold, double fixing) const {
    return log_tail(set, set.cumulative_probability, inlier_threshold,
                    at(inlier_threshold).inlier_probability, fixing);
  }
  /// If stems stood at random.
  double tail_at_random(const residual_set& set, double inlier_threshold, double fixing) const {
    return log_tail(set, cumulative_probabilities(set.residuals, &probabilities::poisson_inlier_probability),
                    inlier_threshold, at(inlier_threshold).poisson_inlier_probability, fixing);
  }

  /// Logarithm of the probability under the null model that as many stems are as near, but for the pairs that
  /// fix the transform.
  double log_tail(const residual_set& set, const std::vector<double>& cumulative_probability,
                  double inlier_threshold, double inlier_probability, double fixing) const {
    const double matched = set.matched(inlier_threshold);
    if (matched <= fixing) return 0;
    const double near = matched - cumulative_probability[std::size_t(matched) - 1] / inlier_probability;
    return log_uniform_sum_tail(near - fixing, std::max(set.expected, matched) - fixing, inlier_probability);
  }

  /// Logarithm of the number of transforms that two pairs of stems fix (three in 6-DoF), at each of the
  /// thresholds: any two source stems, and target stems as far from each other as these are. A prior
  /// shares the level out by its density: each transform counts for as many as there would be if the prior
  /// were as dense everywhere (weighted tests: Genovese, Roeder and Wasserman 2006, Biometrika 93(3)).
  double log_number_of_tests(double inlier_threshold, double prior_sigmas = 0) const {
    const double sources = double(context_.source.size()), targets = double(context_.target.size());
    const double apart = std::min(source_extent_, target_->extent()) / 2;  // [m] two stems, typically
    // Stems of the ring of 2 pi `apart` by 2 `inlier_threshold`, where one stands on pi `radius`^2.
    const double radius = target_->stem_radius();
    const double as_far =
        radius > 0 ? std::min(targets, 4 * apart * (inlier_threshold + step_) / (radius * radius)) : targets;
    const double by_two = targets * as_far * sources * sources / 2;
    const double by_all = context_.dof == degrees_of_freedom::four ? by_two : by_two * sources * as_far;
    const double all = std::log(std::max(1.0, by_all)), at_each = std::log(double(thresholds_));
    if (!context_.prior || !(radius > 0) || !(by_all > 0)) return all + at_each;
    const double allowed =
        std::min(1.0, context_.prior->effective_area() / (std::numbers::pi * radius * radius * targets));
    const double restricted = std::log(by_all * allowed * context_.prior->effective_share_of_yaws()) +
                              prior_sigmas * prior_sigmas / 2;
    return std::min(all, restricted) + at_each;
  }

  const matching_context& context_;
  std::shared_ptr<const background_density> target_;
  double source_extent_ = 0;    // [m]
  double step_ = 0;             // [m] of both maps, see `step_of`
  std::size_t thresholds_ = 1;  // that stems may be paired at
  bool is_lattice_left_out_ = false;
  probabilities least_;               // at the smallest residual
  std::vector<probabilities> known_;  // by increasing threshold
  std::unique_ptr<const matching_context> reversed_maps_;
  std::unique_ptr<null_model> reversed_;  // of these
};

}  // namespace globalmatch::detail
