// The order of keys, in linear time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace globalmatch {

/// Positions of the keys in increasing order; equal ones keep theirs. At most 2^32 - 1 keys. Cost: a few
/// passes over the keys, one for each 11 bits in which they differ.
inline std::vector<std::uint32_t> radix_order(std::span<const std::uint64_t> keys) {
  constexpr unsigned bits = 11, digits = 6;
  constexpr std::uint64_t mask = (std::uint64_t(1) << bits) - 1;
  std::vector<std::array<std::uint32_t, mask + 1>> counts(digits);
  for (const std::uint64_t key : keys)
    for (unsigned d = 0; d < digits; ++d) ++counts[d][(key >> (bits * d)) & mask];

  struct entry {
    std::uint64_t key;
    std::uint32_t position;
  };
  std::vector<entry> entries(keys.size()), sorted(keys.size());
  for (std::size_t i = 0; i < keys.size(); ++i) entries[i] = {keys[i], static_cast<std::uint32_t>(i)};
  for (unsigned d = 0; d < digits; ++d) {
    auto& place = counts[d];
    if (keys.empty() || place[(keys[0] >> (bits * d)) & mask] == keys.size()) continue;  // all alike
    std::uint32_t sum = 0;
    for (std::uint32_t& count : place) sum += std::exchange(count, sum);
    for (const entry& e : entries) sorted[place[(e.key >> (bits * d)) & mask]++] = e;
    entries.swap(sorted);
  }
  std::vector<std::uint32_t> order(keys.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = entries[i].position;
  return order;
}

}  // namespace globalmatch
