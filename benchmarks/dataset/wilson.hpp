// Intervals for shares that were counted.
#pragma once

#include <cmath>
#include <cstddef>

namespace globalmatch::benchmarks {

struct interval {
  double low = 0, high = 1;
};

/// The interval of 95 % confidence for a probability of which `right` of `count` trials came out (Wilson
/// 1927, score interval without continuity correction); [0, 1] without trials.
inline interval wilson_interval(std::size_t right, std::size_t count) {
  constexpr double z = 1.959963984540054;  // 97.5 % quantile of the normal distribution
  if (count == 0) return {};
  const double n = double(count), p = double(right) / n;
  const double center = (p + z * z / (2 * n)) / (1 + z * z / n);
  const double half = z / (1 + z * z / n) * std::sqrt(p * (1 - p) / n + z * z / (4 * n * n));
  return {std::fmax(0, center - half), std::fmin(1, center + half)};
}

}  // namespace globalmatch::benchmarks
