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
    std::vector<double> factors, shares;
    for (const auto& residuals : of_transforms) {
      if (residuals.size() < min_pairs) continue;
      const double pairs = double(residuals.size()), off = surprisal_of(residuals) - pairs;
      const double variance = off * off / median_of_chi_squared;
      factors.push_back(variance / pairs);
      shares.push_back((variance - pairs) / (pairs * pairs));
    }
    if (factors.empty()) return;
    factor_ = std::max(1.0, median(factors));
    share_ = std::max(0.0, median(shares));
  }

  /// Whether there was something to learn from.
  bool is_known() const { return factor_ > 0; }

  /// Natural logarithm of the probability under the null model that pairs fit as well. A residual counts by
  /// the logarithm of the share of all residuals that are larger; the sum over the pairs is gamma distributed
  /// whatever the residuals are like, and wider by as much as the sums of the known transforms are, where
  /// stems near each other fit together or not. `fitted` pairs' worth of noise was taken away by a fit to
  /// these pairs. 0 for fewer than a dozen pairs.
  double log_probability(std::span<const float> residuals, double fitted) const {
    const double pairs = double(residuals.size());
    if (!is_known() || residuals.size() < min_pairs) return 0;
    const double wider = std::max(factor_, 1 + share_ * pairs);
    return log_gamma_tail(surprisal_of(residuals) / wider, (pairs - fitted) / wider);
  }

  static constexpr std::size_t min_pairs = 12;

 private:
  static constexpr double median_of_chi_squared = 0.455;  // of one degree of freedom

  /// On average as much as there are residuals, under the null model: the sum of -log of the shares that are
  /// smaller.
  double surprisal_of(std::span<const float> residuals) const {
    // Among equals a residual counts as their mean: that of -log(u) over their shares u.
    const auto integral = [](double u) { return u > 0 ? u - u * std::log(u) : 0; };
    const double all = double(known_.size()) + 1;
    double sum = 0;
    for (const float residual : residuals) {
      const auto equal = std::lower_bound(known_.begin(), known_.end(), double(residual));
      const auto larger = std::upper_bound(known_.begin(), known_.end(), double(residual));
      const double above = double(known_.end() - larger) / all;
      const double not_below = (double(known_.end() - equal) + 1) / all;
      sum += (integral(not_below) - integral(above)) / (not_below - above);
    }
    return sum;
  }

  std::vector<double> known_;  // residuals, increasing
  double factor_ = 0;          // variance of a sum over that of independent pairs
  double share_ = 0;           // of pairs that go together
};

}  // namespace globalmatch::detail
