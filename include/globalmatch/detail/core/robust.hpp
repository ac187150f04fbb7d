// Robust estimation: what far away numbers count.
#pragma once

namespace globalmatch::detail {

/// Residuals larger than so many standard deviations have no weight: Tukey's usual constant, of 95 %
/// efficiency where the noise is Gaussian.
inline constexpr double tukey_constant = 4.685;

/// Standard deviations in the median magnitude of Gaussian numbers.
inline constexpr double deviation_of_median = 1.4826;

/// Tukey's weight, 1 to 0, of a residual whose square is given as a share of the square of the largest that
/// counts (Beaton and Tukey 1974, The fitting of power series, Technometrics 16(2)).
inline double tukey_weight(double squared_share) {
  const double rest = 1 - squared_share;
  return rest > 0 ? rest * rest : 0;
}

}  // namespace globalmatch::detail
