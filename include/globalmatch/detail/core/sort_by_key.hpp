// A stable sort by whole numbers: one function for all that is sorted by a key.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace globalmatch::detail {

/// A key, and the place of what it belongs to.
struct keyed_place {
  std::uint64_t key;
  std::uint32_t place;
};

/// Sorts by key, equal ones as they came. Radix sort: a pass for every eight bits in which keys differ.
/// `spare` is reused memory.
inline void sort_by_key(std::vector<keyed_place>& entries, std::vector<keyed_place>& spare) {
  constexpr unsigned bits = 8;
  constexpr std::uint64_t mask = (1u << bits) - 1;
  constexpr std::size_t few = 64;
  if (entries.size() < few) {  // insertion sort
    for (std::size_t i = 1; i < entries.size(); ++i) {
      const keyed_place moved = entries[i];
      std::size_t to = i;
      for (; to > 0 && entries[to - 1].key > moved.key; --to) entries[to] = entries[to - 1];
      entries[to] = moved;
    }
    return;
  }
  std::uint64_t differ = 0;
  for (const keyed_place& e : entries) differ |= e.key ^ entries.front().key;
  spare.resize(entries.size());
  std::array<std::uint32_t, mask + 1> next;
  for (unsigned shift = 0; shift < 64 && differ >> shift != 0; shift += bits) {
    if (((differ >> shift) & mask) == 0) continue;
    next.fill(0);
    for (const keyed_place& e : entries) ++next[(e.key >> shift) & mask];
    std::uint32_t sum = 0;
    for (std::uint32_t& n : next) sum += std::exchange(n, sum);
    for (const keyed_place& e : entries) spare[next[(e.key >> shift) & mask]++] = e;
    entries.swap(spare);
  }
}

/// The places of some keys in their order, equal ones as they come.
inline std::vector<std::uint32_t> order_by(const std::vector<std::uint64_t>& keys) {
  std::vector<keyed_place> entries(keys.size()), spare;
  for (std::size_t i = 0; i < keys.size(); ++i) entries[i] = {keys[i], static_cast<std::uint32_t>(i)};
  sort_by_key(entries, spare);
  std::vector<std::uint32_t> order(keys.size());
  for (std::size_t i = 0; i < keys.size(); ++i) order[i] = entries[i].place;
  return order;
}

}  // namespace globalmatch::detail
