// Which things are connected (union-find with path halving: Tarjan and van Leeuwen 1984, J. ACM 31(2)).
#pragma once

#include <cstddef>
#include <vector>

#include "globalmatch/points.hpp"

namespace globalmatch::detail {

/// Disjoint sets whose representative is their least member, so that the order of joining does not matter.
class disjoint_sets {
 public:
  explicit disjoint_sets(std::size_t count) : parent_(count) {
    for (std::size_t i = 0; i < count; ++i) parent_[i] = static_cast<point_index>(i);
  }
  point_index find(point_index i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  /// That of each member. It is never greater than any other, so that one pass tells all.
  const std::vector<point_index>& representatives() {
    for (point_index& parent : parent_) parent = parent_[parent];
    return parent_;
  }
  /// False where both were in one set already.
  bool join(point_index i, point_index j) {
    i = find(i);
    j = find(j);
    if (i < j)
      parent_[j] = i;
    else
      parent_[i] = j;
    return i != j;
  }

 private:
  std::vector<point_index> parent_;
};

}  // namespace globalmatch::detail
