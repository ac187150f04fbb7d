// Pairs of stems of two maps.
#pragma once

#include <cstddef>
#include <vector>

#include "globalmatch/matching.hpp"
#include "globalmatch/points.hpp"

namespace globalmatch::scenes {

/// Correspondences of equal indices.
inline std::vector<correspondence> same_indices(std::size_t count) {
  std::vector<correspondence> pairs;
  for (stem_index i = 0; i < count; ++i) pairs.push_back({i, i});
  return pairs;
}

}  // namespace globalmatch::scenes
