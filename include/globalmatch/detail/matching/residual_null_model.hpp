// Null model of residuals, of positions or radii: those of stems that were paired though they are
// not one. In: residuals under many transforms, hardly any of which is right. Out: how improbable it is that
// pairs fit as well as they do.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/core/threads.hpp"

namespace globalmatch::detail {

/// Learnt from residuals, whatever their distribution.
class residual_null_model {
 public:
  residual_null_model() = default;

  /// Learns from the residuals under each of several transforms. Cost: linear in them.
  explicit residual_null_model(std::span<const std::vector<float>> of_transforms) {
    constexpr std::size_t enough = 4096;  // residuals that others are compared with
    std::size_t all = 0, passed = 0;
    for (const auto& residuals : of_transforms) all += residuals.size();
    const std::size_t step = (all + enough - 1) / enough;
    for (const auto& residuals : of_transforms)
      for (const float residual : residuals)
        if (passed++ % step == 0) known_.push_back(double(residual));
    sort_numbers(known_);
    learn_variances(of_transforms);
  }

  /// Whether there was something to learn from.
  bool is_known() const { return !factors_.empty(); }

  /// Natural logarithm of the probability under the null model that pairs fit as well. A residual counts by
  /// how much smaller it is than the median of all, evenly from 0 to 1 under the null model, and a larger one
  /// for nothing: a stem that the other map does not show may be paired with any. The sum over the pairs is
  /// wider by as much as the sums of known transforms of as many pairs are, where stems near each other fit
  /// together or not. 0 for fewer pairs than `min_pairs`, and where too few transforms are known.
  double log_probability(std::span<const float> residuals) const {
    const double pairs = double(residuals.size());
    if (!is_known() || residuals.size() < min_pairs) return 0;
    const double factor = variance_factor(doublings(pairs));
    return log_uniform_sum_tail(nearness_of(residuals) / factor, pairs / factor, half);
  }

  static constexpr std::size_t min_pairs = 6;
  /// Of which the residuals are smaller than usual: as many again are larger.
  static constexpr std::size_t min_transforms = 10;

 private:
  // A share that the right transform, one of all, does not change; of one degree of freedom.
  static constexpr double most = 0.8, chi_squared_of_most = 1.642;
  static constexpr double half = 0.5, mean_nearness = half / 2,  // of one pair, under the null model
      variance_of_nearness = half / 3 - mean_nearness * mean_nearness;

  static std::size_t doublings(double pairs) { return std::size_t(std::ilogb(pairs)); }

  /// Learns from transforms of 1, 2, 4, ... pairs and more by what factor the variance of their sums is
  /// larger than that of independent pairs, as far as there are enough: not by less where there are more.
  void learn_variances(std::span<const std::vector<float>> of_transforms) {
    std::vector<std::vector<double>> known;
    for (const auto& residuals : of_transforms) {
      poll_cancelled();
      if (residuals.size() < min_pairs) continue;
      const double pairs = double(residuals.size()), excess = nearness_of(residuals) - mean_nearness * pairs;
      known.resize(std::max(known.size(), doublings(pairs) + 1));
      if (excess < 0) continue;  // how far sums are below the mean says nothing of how far they are above
      for (std::size_t i = 0; i <= doublings(pairs); ++i)
        known[i].push_back(excess * excess / (pairs * variance_of_nearness * chi_squared_of_most));
    }
    for (std::vector<double>& factors : known) {
      if (factors.size() < min_transforms) break;
      factors_.push_back(std::max(factors_.empty() ? 1 : factors_.back(), quantile(factors, most)));
    }
  }

  /// Beyond what is known the excess doubles with the pairs, as if all went together.
  double variance_factor(std::size_t doublings) const {
    double factor = factors_[std::min(doublings, factors_.size() - 1)];
    for (std::size_t i = factors_.size(); i <= doublings; ++i) factor = 2 * factor - 1;
    return factor;
  }

  /// What a share of the numbers does not exceed. Reorders them.
  static double quantile(std::vector<double>& numbers, double share) {
    const auto rank = std::size_t(std::ceil(share * double(numbers.size() + 1)));
    const auto at = numbers.begin() + std::ptrdiff_t(std::min(rank, numbers.size()) - 1);
    std::nth_element(numbers.begin(), at, numbers.end());
    return *at;
  }

  /// Sum of 1 less the share of known residuals that are smaller, in halves of them; 0 for the larger half.
  double nearness_of(std::span<const float> residuals) const {
    // Among equals a residual counts as their mean: that of 1 - u / half over their shares u.
    const auto integral = [](double u) { return u < half ? u - u * u / (2 * half) : half / 2; };
    const double all = double(known_.size()) + 1;
    double sum = 0;
    for (const float residual : residuals) {
      const auto equal = std::lower_bound(known_.begin(), known_.end(), double(residual));
      const auto larger = std::upper_bound(known_.begin(), known_.end(), double(residual));
      const double below = double(equal - known_.begin()) / all;
      const double not_above = (double(larger - known_.begin()) + 1) / all;
      sum += (integral(not_above) - integral(below)) / (not_above - below);
    }
    return sum;
  }

  std::vector<double> known_;    // residuals, increasing
  std::vector<double> factors_;  // of variances, by the doublings of the pairs
};

}  // namespace globalmatch::detail
