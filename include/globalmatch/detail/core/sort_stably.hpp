// A stable sort for values of any alignment.
#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

namespace globalmatch::detail {

/// Sorts by `before(a, b)`; equal values keep their order. `std::stable_sort` would move the values through a
/// buffer that libstdc++ 12 does not align as Eigen's fixed sizes ask when compiled for AVX.
template <class T, class Before>
void sort_stably(std::vector<T>& values, const Before& before) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return before(values[a], values[b]); });
  std::vector<T> sorted;
  sorted.reserve(values.size());
  for (const std::size_t i : order) sorted.push_back(std::move(values[i]));
  values = std::move(sorted);
}

}  // namespace globalmatch::detail
