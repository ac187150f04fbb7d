// Statistics of numbers.
#pragma once

#include <algorithm>
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

}  // namespace globalmatch
