// What a query for neighbours finds.
#pragma once

#include <cstdint>

namespace globalmatch::detail {

/// A point found by a query.
template <class T>
struct neighbor {
  std::uint32_t index;
  T squared_distance;

  /// Nearer first; among equally near ones the lower index.
  bool operator<(const neighbor& other) const {
    return squared_distance < other.squared_distance ||
           (squared_distance == other.squared_distance && index < other.index);
  }
};

}  // namespace globalmatch::detail
