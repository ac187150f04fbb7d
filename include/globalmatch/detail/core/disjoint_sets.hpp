// Which things are connected (union-find with path halving: Tarjan and van Leeuwen 1984, J. ACM 31(2)).
#pragma once

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace globalmatch::detail {

/// Sets of numbers, each of its own at first.
class disjoint_sets {
 public:
  explicit disjoint_sets(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0u);
  }

  /// The number that stands for the set of `i`.
  std::uint32_t root(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  /// False where they were in one set already.
  bool join(std::uint32_t a, std::uint32_t b) {
    a = root(a), b = root(b);
    parent_[a] = b;
    return a != b;
  }

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace globalmatch::detail
