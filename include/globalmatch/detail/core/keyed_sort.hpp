// Sorting by a number. All that is sorted in matching is one type, so that one sort is compiled.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "globalmatch/detail/core/threads.hpp"

namespace globalmatch::detail {

/// Ordered by key, then by value.
struct keyed {
  std::uint64_t key, value;

  bool operator<(const keyed& other) const {
    return key < other.key || (key == other.key && value < other.value);
  }
};

/// Keys in the order of numbers, which must not be NaN or -0.
inline std::uint64_t key_of(double number) {
  const auto bits = std::bit_cast<std::uint64_t>(number);
  constexpr std::uint64_t sign = std::uint64_t(1) << 63;
  return bits & sign ? ~bits : bits | sign;
}

/// The number of a key.
inline double number_of(std::uint64_t key) {
  constexpr std::uint64_t sign = std::uint64_t(1) << 63;
  return std::bit_cast<double>(key & sign ? key & ~sign : ~key);
}

/// Keys of two indices, and the indices of a key.
inline std::uint64_t key_of(std::uint32_t first, std::uint32_t second) {
  return std::uint64_t(first) << 32 | second;
}
inline std::uint32_t first_of(std::uint64_t key) {
  return static_cast<std::uint32_t>(key >> 32);
}
inline std::uint32_t second_of(std::uint64_t key) {
  return static_cast<std::uint32_t>(key);
}

/// Sorts; polls for cancelling where there are many.
inline void sort_keyed(std::span<keyed> items) {
  constexpr std::size_t at_once = 200'000;  // some 20 ms
  while (items.size() > at_once) {
    poll_cancelled();
    const std::size_t half = items.size() / 2;
    std::nth_element(items.data(), items.data() + half, items.data() + items.size());
    sort_keyed(items.first(half));
    items = items.subspan(half);
  }
  std::sort(items.data(), items.data() + items.size());
}

/// Leaves the `count` first ones, sorted.
inline void keep_first(std::vector<keyed>& items, std::size_t count) {
  if (items.size() > count) {
    std::nth_element(items.data(), items.data() + count, items.data() + items.size());
    items.resize(count);
  }
  sort_keyed(items);
}

}  // namespace globalmatch::detail
