// Statistics of numbers.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

namespace globalmatch {

/// The middle one of some values, which it reorders, or the mean of the two in the middle; not a number when
/// there is none.
inline double median(std::span<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return (*middle + *std::max_element(values.begin(), middle)) / 2;
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

/// Natural logarithm of the probability that a gamma distributed number of the given mean, and of scale 1, is
/// at most `value`; 0 where so much is expected.
inline double log_gamma_tail(double value, double mean) {
  if (value >= mean || mean <= 0) return 0;
  if (value <= 0) return -std::numeric_limits<double>::infinity();
  constexpr int most_terms = 10000;
  constexpr double enough = 1e-12;
  double term = 1, sum = 1;
  for (int i = 1; i < most_terms && term > enough * sum; ++i) sum += term *= value / (mean + i);
  return std::min(0.0, mean * std::log(value) - value - std::lgamma(mean + 1) + std::log(sum));
}

/// Natural logarithm of the probability that the product of `count` independent numbers, uniform between 0
/// and 1, is at most exp(`log_product`): Fisher's combination of as many probabilities.
inline double log_product_tail(double log_product, int count) {
  if (std::isinf(log_product)) return log_product;
  double term = 1, sum = 1;
  for (int i = 1; i < count; ++i) sum += term *= -log_product / i;
  return std::min(0.0, log_product + std::log(sum));
}

}  // namespace globalmatch
