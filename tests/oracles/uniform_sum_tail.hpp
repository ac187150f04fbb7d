// The tail of a sum of numbers that are uniform or 0, by repeated convolution: the oracle of
// `log_uniform_sum_tail`.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

namespace globalmatch::oracles {

/// Natural logarithm of the probability that of `tries` numbers, each uniform between 0 and 1 with
/// probability `p` and 0 otherwise, the sum is at least `sum`. Rounding leaves nothing below some -60.
inline double log_uniform_sum_tail(double sum, int tries, double p) {
  constexpr std::size_t cells = 500;  // of the unit interval, each as a mass in its middle
  std::vector<double> density = {1};
  double tail = 0;
  for (int k = 1; k <= tries; ++k) {
    std::vector<double> next(density.size() + cells - 1);
    double window = 0;
    for (std::size_t i = 0; i < next.size(); ++i) {
      if (i < density.size()) window += density[i];
      if (i >= cells) window -= density[i - cells];
      next[i] = window / cells;
    }
    density = next;
    double share = 0;
    for (std::size_t i = 0; i < density.size(); ++i)
      if (double(i) + 0.5 * k >= sum * cells) share += density[i];
    tail += share * std::exp(std::lgamma(tries + 1) - std::lgamma(k + 1) - std::lgamma(tries - k + 1) +
                             k * std::log(p) + (tries - k) * std::log1p(-p));
  }
  return std::log(tail);
}

}  // namespace globalmatch::oracles
