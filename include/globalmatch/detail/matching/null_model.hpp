// Significance: could so many stems meet by chance? In: how the stems of the target stand. Out: the number of
// transforms that would do as well if the maps had nothing to do with each other. An a-contrario measure
// after [DMM] Desolneux, Moisan and Morel 2000, Meaningful alignments, Int. J. Computer Vision 40(1); as
// there, the fewer false alarms are expected, the less chance explains.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/matching/background_density.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::detail {

/// What chance can do between two maps. Refers to them.
class null_model {
 public:
  /// `thresholds` [m] are those that stems may be paired at. What is asked at them, and at `others`, is
  /// computed once. `target_background` is that of the target stems.
  null_model(const matching_context& context, std::shared_ptr<const background_density> target_background,
             std::span<const double> thresholds, std::span<const double> others = {})
      : context_(context),
        target_(std::move(target_background)),
        source_extent_(extent(context.source)),
        thresholds_(std::max<std::size_t>(1, thresholds.size())) {
    for (const auto& asked : {thresholds, others})
      for (const double inlier_threshold : asked) known_.push_back(compute(inlier_threshold));
    std::sort(known_.begin(), known_.end(), [](const probabilities& a, const probabilities& b) {
      return a.inlier_threshold < b.inlier_threshold;
    });
  }

  /// The same when nothing is known of the target. Cost: linear in the stems.
  explicit null_model(const matching_context& context, std::span<const double> thresholds = {})
      : null_model(context, std::make_shared<background_density>(context.target, context.target_index),
                   thresholds) {}

  /// Probability that a source stem laid among the target stems lies within `inlier_threshold` [m] of one by
  /// chance.
  double inlier_probability(double inlier_threshold) const { return at(inlier_threshold).inlier_probability; }

  /// From now on chance is at least as good as it is along the lattice of this stand.
  void include_lattice_of(const background_density& plantation) {
    for (probabilities& known : known_)
      known.inlier_probability =
          std::max(known.inlier_probability, plantation.lattice_inlier_probability(known.inlier_threshold));
  }

  /// What a motion makes of source stems.
  struct residual_set {
    double expected = 0;            ///< stems laid where target stems stand around
    std::vector<double> residuals;  ///< [m] from the nearest target stem, increasing, where one is near
    std::vector<double>
        cumulative_probability;  ///< sums of the chances of being as near, of the first residuals
    double vertical_offset = 0;  ///< [m] by how much the motion was raised
    double matched(double inlier_threshold) const {
      return double(std::lower_bound(residuals.begin(), residuals.end(), inlier_threshold) -
                    residuals.begin());
    }
  };

  /// Lays source stems, some thousands from all over where both maps are large, and looks for target stems
  /// within `search_radius` [m] of them: a sample is evidence enough, as long as it counts as no more than it
  /// is. In 4-DoF the motion is raised first to fit the heights of what lies within `inlier_threshold` [m]; a
  /// target stem of another height may then hide one behind it, which makes what is matched a lower bound.
  residual_set residuals_under(const rigid& target_from_source, double search_radius,
                               double inlier_threshold) const {
    constexpr std::size_t max_sampled = 8192;
    const std::size_t smaller = std::min(context_.source.size(), context_.target.size());
    const std::size_t step = std::max<std::size_t>(1, (smaller + max_sampled - 1) / max_sampled);
    std::vector<candidate> candidates;
    residual_set result;
    for (std::size_t s = 0; s < context_.source.size(); s += step) {
      const vec3 transformed = target_from_source * context_.source.at[s];
      candidate nearest{search_radius, 0};
      context_.target_index->for_each_within(
          transformed.x, transformed.y, search_radius, [&](stem_index t, double) {
            const vec3& at = context_.target.at[t];
            const double residual = stem_distance(transformed, at, context_.horizontal_distances());
            if (residual < nearest.residual) nearest = {residual, at.z - transformed.z};
          });
      if (target_->surrounds(transformed)) ++result.expected;
      if (nearest.residual < search_radius) candidates.push_back(nearest);
    }
    if (context_.uses_heights())
      result.vertical_offset = keep_consistent_heights(candidates, inlier_threshold);
    for (const candidate& m : candidates) result.residuals.push_back(m.residual);
    std::sort(result.residuals.begin(), result.residuals.end());
    result.cumulative_probability =
        cumulative_probabilities(result.residuals, &probabilities::inlier_probability);
    return result;
  }

  /// Whether chance does as well as this motion for the source stems within `radius` [m in plan] of `center`.
  /// Not where few of them are laid among target stems: those tell nothing.
  bool explains_around(const rigid& target_from_source, const vec3& center,
                       double radius, double inlier_threshold) const {
    constexpr double min_sample = 100, max_sample = 1000, significance_level = 1e-3;
    const double stems = std::min(double(context_.source.size()),
                                  std::numbers::pi * std::pow(radius / context_.source_index->spacing(), 2));
    const auto step = std::max<std::size_t>(1, std::size_t(stems / max_sample));  // some tell enough of many
    double tested = 0, inliers = 0;
    std::size_t passed = 0;
    context_.for_each_source_within(center, radius, [&](stem_index s) {
      if (passed++ % step != 0) return;
      const vec3 transformed = target_from_source * context_.source.at[s];
      bool is_inlier = false;
      context_.for_each_inlier(transformed, inlier_threshold, [&](stem_index, double) { is_inlier = true; });
      inliers += is_inlier;
      tested += is_inlier || target_->surrounds(transformed);
    });
    return tested > min_sample && log_binomial_tail(inliers, tested, inlier_probability(inlier_threshold)) >
                                      std::log(significance_level);
  }

  /// Logarithm to base 10 of the expected number of false alarms: motions that would, by chance, lay stems as
  /// near to others as `set`, at a tolerance [m]. A stem that meets another counts by 1 less the share
  /// that chance has, of all meetings, in those as close: 1 to 0, evenly, if it meets by chance (in plan the
  /// score of Torr and Zisserman 2000, MLESAC, Computer Vision and Image Understanding 78). Looked at are all
  /// motions that two pairs of stems fix (three in 6-DoF), at all tolerances; as many pairs then tell
  /// nothing. After Moisan and Stival 2004, A probabilistic criterion to detect rigid point matches, Int. J.
  /// Computer Vision 57(3), who count alike. Below 0 chance is an unlikely explanation.
  double log10_nfa(const residual_set& set, double inlier_threshold) const {
    return log10_nfa(set, set.cumulative_probability, inlier_threshold,
                     at(inlier_threshold).inlier_probability);
  }

  /// Judges a hypothesis, of which `set` is what its motion makes of the stems, at its tolerance.
  void score(local_hypothesis& h, const residual_set& set) const {
    h.log10_nfa = log10_nfa(set, h.inlier_threshold);
    h.log10_nfa_poisson =
        log10_nfa(set, cumulative_probabilities(set.residuals, &probabilities::poisson_inlier_probability),
                  h.inlier_threshold, at(h.inlier_threshold).poisson_inlier_probability);
  }

 private:
  /// What is known of a tolerance [m].
  struct probabilities {
    double inlier_threshold, inlier_probability, poisson_inlier_probability;
  };

  probabilities at(double inlier_threshold) const {
    for (const probabilities& known : known_)
      if (known.inlier_threshold == inlier_threshold) return known;
    return compute(inlier_threshold);
  }

  probabilities compute(double inlier_threshold) const {
    const double at_random = target_->poisson_inlier_probability(inlier_threshold);
    return {inlier_threshold, std::max(at_random, target_->lattice_inlier_probability(inlier_threshold)),
            at_random};
  }

  /// Sums of the chances of being as near, of the first residuals [m, increasing]. Between the tolerances
  /// that are known they grow with the area within reach. Copied stems, which meet exactly, are met by chance
  /// as well as others.
  std::vector<double> cumulative_probabilities(const std::vector<double>& residuals,
                                               double probabilities::*of) const {
    constexpr double min_residual = 1e-4;  // [m] no stem's place is known better
    const auto square = [](double d) { return d * d; };
    std::vector<double> sums;
    probabilities below = {0, 0, 0};
    auto above = known_.begin();
    double sum = 0;
    for (const double given : residuals) {
      const double residual = std::max(given, min_residual);
      while (above != known_.end() && above->inlier_threshold <= residual) below = *above++;
      if (above == known_.end()) {
        sum += compute(residual).*of;
      } else {
        const double share = (square(residual) - square(below.inlier_threshold)) /
                             (square(above->inlier_threshold) - square(below.inlier_threshold));
        sum += below.*of + share * ((*above).*of - below.*of);
      }
      sums.push_back(sum);
    }
    return sums;
  }

  double log10_nfa(const residual_set& set, const std::vector<double>& cumulative_probability,
                   double inlier_threshold, double inlier_probability) const {
    const double fixing = context_.dof == degrees_of_freedom::four ? 2 : 3;
    const double matched = set.matched(inlier_threshold);
    double tail = 0;
    if (matched > fixing) {
      const double near = matched - cumulative_probability[std::size_t(matched) - 1] / inlier_probability;
      tail =
          log_uniform_sum_tail(near - fixing, std::max(set.expected, matched) - fixing, inlier_probability);
    }
    return (std::log(number_of_tests(inlier_threshold)) + tail) / std::numbers::ln10;
  }

  /// A laid source stem and the target stem nearest to it.
  struct candidate {
    double residual, vertical_offset;  // [m]
  };

  /// Removes meetings whose heights are too far from those of most within `inlier_threshold` [m]; returns the
  /// rise [m] of these.
  double keep_consistent_heights(std::vector<candidate>& candidates, double inlier_threshold) const {
    std::vector<double> vertical_offsets;
    for (const candidate& m : candidates)
      if (m.residual < inlier_threshold) vertical_offsets.push_back(m.vertical_offset);
    const double vertical_offset = vertical_offsets.empty() ? 0 : median(vertical_offsets);
    std::erase_if(candidates, [&](const candidate& m) {
      return std::abs(m.vertical_offset - vertical_offset) >= context_.vertical_threshold;
    });
    return vertical_offset;
  }

  /// Motions that two pairs of stems fix (three in 6-DoF), at each of the tolerances: any two source stems,
  /// and target stems as far from each other as these are.
  double number_of_tests(double inlier_threshold) const {
    const double sources = double(context_.source.size()), targets = double(context_.target.size());
    const double apart = std::min(source_extent_, target_->extent()) / 2;  // [m] two stems, typically
    // Stems of the ring of 2 pi `apart` by 2 `inlier_threshold`, where one stands on pi `radius`^2.
    const double radius = target_->stem_radius();
    const double as_far =
        radius > 0 ? std::min(targets, 4 * apart * inlier_threshold / (radius * radius)) : targets;
    const double by_two = targets * as_far * sources * sources / 2;
    const double by_all = context_.dof == degrees_of_freedom::four ? by_two : by_two * sources * as_far;
    return std::max(1.0, by_all) * double(thresholds_);
  }

  const matching_context& context_;
  std::shared_ptr<const background_density> target_;
  double source_extent_ = 0;    // [m]
  std::size_t thresholds_ = 1;  // that stems may be paired at
  std::vector<probabilities> known_;
};

/// Judges a hypothesis, in the frames of `context`, against chance, and pairs and fits it anew at the
/// tolerance [m] among `thresholds`, increasing, at which chance explains least. Cost: linear in the stems.
inline void score_hypothesis(local_hypothesis& h, const matching_context& context, const null_model& null,
                             std::span<const double> thresholds) {
  constexpr int max_iterations = 4;
  constexpr double relative_convergence_threshold = 0.1;  // of the tolerance
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    const double before = h.inlier_threshold;
    const null_model::residual_set set =
        null.residuals_under(h.target_from_source, thresholds.back(), h.inlier_threshold);
    h.target_from_source.translation.z += set.vertical_offset;
    h.log10_nfa = std::numeric_limits<double>::infinity();
    for (const double inlier_threshold : thresholds) {
      const double log10_nfa = null.log10_nfa(set, inlier_threshold);
      if (log10_nfa < h.log10_nfa) {
        h.log10_nfa = log10_nfa;
        h.inlier_threshold = inlier_threshold;
      }
    }
    null.score(h, set);
    const auto pairs = context.pair_stems(h.target_from_source, h.inlier_threshold);
    const auto transform = context.fit(pairs);
    if (!transform) break;
    double mean_displacement = 0;
    for (const correspondence& c : pairs) {
      const vec3& p = context.source.at[c.source];
      mean_displacement +=
          stem_distance(*transform * p, h.target_from_source * p, context.horizontal_distances()) /
          double(pairs.size());
    }
    h.target_from_source = *transform;
    if (mean_displacement < relative_convergence_threshold * h.inlier_threshold &&
        h.inlier_threshold == before)
      break;
  }
  h.correspondences = context.pair_stems(h.target_from_source, h.inlier_threshold);
  h.rms = context.rms(h.target_from_source, h.correspondences);
}

}  // namespace globalmatch::detail
