// Statistics of numbers.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

namespace globalmatch::detail {

/// The value that `n` others come before; reorders them.
inline double nth_smallest(std::span<double> values, std::size_t n) {
  double* const first = values.data();
  std::nth_element(first, first + n, first + values.size());
  return first[n];
}

/// Sorts numbers; not a template, so that one sort is compiled.
inline void sort_numbers(std::span<double> values) {
  std::sort(values.data(), values.data() + values.size());
}

/// The middle one of some values, which it reorders, or the mean of the two in the middle; not a number when
/// there is none.
inline double median(std::span<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const std::size_t half = values.size() / 2;
  const double middle = nth_smallest(values, half);
  if (values.size() % 2 == 1) return middle;
  double below = values[0];
  for (const double value : values.first(half)) below = below < value ? value : below;
  return (middle + below) / 2;
}

/// The middle one of some values, which it reorders: of an even number the upper of two. At least one.
inline double upper_median(std::vector<double>& values) {
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The value below which half of the weights are, of pairs of value and weight, which it sorts; the mean of
/// two where just half are. Not a number where there is none.
inline double weighted_median(std::span<std::pair<double, double>> weighted) {
  if (weighted.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(weighted.begin(), weighted.end());
  double half = 0, below = 0;
  for (const auto& [value, weight] : weighted) half += weight / 2;
  for (std::size_t i = 0; i + 1 < weighted.size(); ++i) {
    below += weighted[i].second;
    if (below > half) return weighted[i].first;
    if (below == half) return (weighted[i].first + weighted[i + 1].first) / 2;
  }
  return weighted.back().first;
}

/// Upper bound of the natural logarithm of the probability that of `tries` independent tries, each successful
/// with probability `p`, at least `successes` succeed: the first term of the tail, and a geometric series
/// that is above the others. 0 where so many are expected. Neither number need be whole.
inline double log_binomial_tail(double successes, double tries, double p) {
  if (successes <= tries * p || tries <= 0) return 0;
  if (p <= 0) return -std::numeric_limits<double>::infinity();
  const double k = std::min(successes, tries), misses = tries - k;
  const double first = std::lgamma(tries + 1) - std::lgamma(k + 1) - std::lgamma(misses + 1) +
                       k * std::log(p) + (misses > 0 ? misses * std::log1p(-p) : 0);
  const double ratio = misses * p / ((k + 1) * (1 - p));  // of a term and the one before; it falls further
  return std::min(0.0, first - std::log1p(-ratio));
}

/// Logarithm of the probability of at most `successes` in `tries` where the share of successes varies from
/// one lot of tries to another: a beta-binomial distribution with a mean share and the correlation of two
/// tries of a lot, both between 0 and 1.
inline double log_beta_binomial_tail(std::size_t successes, std::size_t tries, double mean,
                                     double correlation) {
  const double both = 1 / correlation - 1, a = mean * both, b = (1 - mean) * both, n = double(tries);
  double log_probability = 0;  // of none
  for (double j = 0; j < n; ++j) log_probability += std::log((b + j) / (both + j));
  double sum = 1, ratio = 1;  // over that of none
  for (double i = 0; i < double(successes); ++i) {
    ratio *= (n - i) * (a + i) / ((i + 1) * (b + n - i - 1));
    sum += ratio;
  }
  return std::min(0.0, log_probability + std::log(sum));
}

/// Natural logarithm of the probability that of `tries` independent numbers, each uniform between 0 and 1
/// with probability `p` and 0 otherwise, the sum is at least `sum`: the saddlepoint approximation of Robinson
/// 1982, Saddlepoint approximations for permutation tests and confidence intervals, J. Royal Statistical
/// Society B 44(1). 0 where so much is expected. `tries` need not be whole.
inline double log_uniform_sum_tail(double sum, double tries, double p) {
  if (p <= 0 && sum > 0) return -std::numeric_limits<double>::infinity();
  p = std::min(p, 1 - 1e-12);
  if (sum <= tries * p / 2 || tries <= 0) return 0;
  if (sum >= tries) return -std::numeric_limits<double>::infinity();
  // The cumulant generating function of one number, less what is sought, and its derivatives, at `t`.
  struct cumulants {
    double log_generating, mean, variance;
  };
  const auto tilted = [p](double t) -> cumulants {
    constexpr double small = 1e-2;
    const double left = std::exp(-t), rest = 1 - left;
    const double log_uniform = t < small ? t / 2 : t + std::log(rest / t);
    const double mean = t < small ? 0.5 + t / 12 : 1 / rest - 1 / t;
    const double variance = t < small ? 1.0 / 12 : 1 / (t * t) - left / (rest * rest);
    const double not_zero = 1 / (1 + (1 - p) / p * std::exp(-log_uniform));
    return {std::log(p / not_zero) + log_uniform, not_zero * mean,
            not_zero * (variance + (1 - not_zero) * mean * mean)};
  };
  constexpr int max_iterations = 50;
  constexpr double near = 1e-4;
  const double target_mean = sum / tries;
  double lower = 0, upper = std::numeric_limits<double>::infinity(), t = 1 / (1 - target_mean);
  cumulants at = tilted(t);
  for (int iteration = 0; iteration < max_iterations && std::abs(at.mean - target_mean) > near * target_mean;
       ++iteration) {
    (at.mean < target_mean ? lower : upper) = t;
    t += (target_mean - at.mean) / at.variance;
    if (!(t > lower && t < upper))
      t = upper < std::numeric_limits<double>::infinity() ? (lower + upper) / 2 : 2 * lower;
    at = tilted(t);
  }
  const double steps = t * std::sqrt(tries * at.variance);
  constexpr double far = 20;
  const double log_mills = steps > far
                               ? -std::log(steps * std::sqrt(2 * std::numbers::pi))
                               : steps * steps / 2 + std::log(std::erfc(steps / std::numbers::sqrt2) / 2);
  return std::min(0.0, tries * (at.log_generating - t * target_mean) + log_mills);
}

/// Natural logarithm of the probability that the product of `count` independent numbers, uniform between 0
/// and 1, is at most exp(`log_product`): Fisher's combination of as many probabilities.
inline double log_product_tail(double log_product, int count) {
  if (std::isinf(log_product)) return log_product;
  double term = 1, sum = 1;
  for (int i = 1; i < count; ++i) sum += term *= -log_product / i;
  return std::min(0.0, log_product + std::log(sum));
}

}  // namespace globalmatch::detail
