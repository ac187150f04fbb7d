// The largest consensus set ([GM] Algorithm 1) without looking at seeds that cannot win.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/global_matching/consensus_bounds.hpp"
#include "globalmatch/detail/global_matching/consensus_finder.hpp"
#include "globalmatch/execution.hpp"

namespace globalmatch::detail {

/// A seed and the size of its consensus set.
struct seed_consensus {
  std::size_t seed, size;

  /// Algorithm 1, line 10: the larger set, of equally large ones that of the first seed.
  bool beats(const seed_consensus& other) const {
    return size > other.size || (size == other.size && seed < other.seed);
  }
};

/// The best of some seeds, all of them looked at. At most a third of `agreements::room`.
inline seed_consensus best_seed(const consensus_finder& finder, std::span<const std::uint32_t> seeds,
                                agreements& agreeing, const execution& exec = {}) {
  std::vector<std::uint32_t> vertices;
  for (const std::uint32_t u : seeds)
    vertices.insert(vertices.end(), finder.vertices(u).begin(), finder.vertices(u).end());
  agreeing.prepare(vertices, exec);
  std::vector<std::size_t> sizes(seeds.size());
  parallel_for(
      exec, "global matching", seeds.size(),
      [&](std::size_t k) { sizes[k] = agreeing.consensus_size(seeds[k]); }, 32);
  seed_consensus best{seeds.front(), sizes.front()};
  for (std::size_t k = 1; k < seeds.size(); ++k)
    if (const seed_consensus other{seeds[k], sizes[k]}; other.beats(best)) best = other;
  return best;
}

/// The seeds in decreasing order of what they promise, the best of all of them, and how many had to be looked
/// at.
struct consensus_search {
  seed_consensus best;
  std::vector<std::uint32_t> order;
  std::size_t visited = 0;
};

/// Sorts seeds by `of(seed)`, decreasing; equal ones keep their order.
template <class Of>
void sort_decreasing(std::vector<std::uint32_t>& seeds, const Of& of) {
  std::vector<keyed> order;
  order.reserve(seeds.size());
  for (std::size_t i = 0; i < seeds.size(); ++i) order.push_back({~std::uint64_t(of(seeds[i])), i});
  sort_keyed(order);
  std::vector<std::uint32_t> sorted;
  sorted.reserve(seeds.size());
  for (const keyed& next : order) sorted.push_back(seeds[next.value]);
  seeds = std::move(sorted);
}

/// The largest consensus set: the one that Algorithm 1 finds, without looking at seeds that cannot win. With
/// `sufficient` > 0 the search ends when a set of this size is found. At least one pair is needed.
inline consensus_search largest_consensus(const consensus_finder& finder, std::size_t sufficient = 0,
                                          const execution& exec = {}) {
  constexpr std::size_t batch = 256;
  agreements agreeing(finder);
  std::vector<std::uint32_t> order(finder.size());
  std::iota(order.begin(), order.end(), 0u);
  sort_decreasing(order, [&](std::uint32_t u) { return finder.votes_for(u); });
  std::size_t visited = std::min(batch, order.size());
  seed_consensus best = best_seed(finder, std::span(order).first(visited), agreeing, exec);
  const auto done = [&] { return sufficient > 0 && best.size >= sufficient; };
  if (visited == order.size() || done()) return {best, std::move(order), visited};

  auto bounds = consensus_bounds(finder, best.size, exec);
  const auto bound_of = [&](std::uint32_t u) { return bounds[u]; };
  const auto can_win = [&](std::uint32_t u) { return bounds[u] >= best.size; };
  sort_decreasing(order, bound_of);
  std::vector<std::uint32_t> seeds(order.begin(), std::partition_point(order.begin(), order.end(), can_win));
  lower_bounds_by_agreement(finder, best.size, bounds, agreeing, exec);
  sort_decreasing(seeds, bound_of);
  for (std::size_t begin = 0; begin < seeds.size() && !done(); begin += batch) {
    const auto next = std::span(seeds).subspan(begin, std::min(batch, seeds.size() - begin));
    const auto end = std::partition_point(next.begin(), next.end(), can_win);
    if (end == next.begin()) break;
    visited += std::size_t(end - next.begin());
    const seed_consensus other = best_seed(finder, {next.begin(), end}, agreeing, exec);
    if (other.beats(best)) best = other;
  }
  return {best, std::move(order), visited};
}

}  // namespace globalmatch::detail
