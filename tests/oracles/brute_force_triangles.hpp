// Local triangles by looking at every stem: the oracle of `build_triangles`.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <set>
#include <utility>
#include <vector>

#include "globalmatch/positions.hpp"

namespace globalmatch::oracles {

/// The stems of every local triangle, increasing. Of equally near stems the one with the lower index is
/// nearer.
inline std::set<std::array<stem_index, 3>> brute_force_triplets(const position_set& stems, bool horizontal,
                                                                std::size_t neighbors) {
  std::set<std::array<stem_index, 3>> triplets;
  for (stem_index i = 0; i < stems.size(); ++i) {
    std::vector<std::pair<double, stem_index>> others;
    for (stem_index j = 0; j < stems.size(); ++j) {
      const detail::vec3 d = stems.at[j] - stems.at[i];
      const double horizontal_distances = d.x * d.x + d.y * d.y;
      if (j != i)
        others.push_back({horizontal ? horizontal_distances : horizontal_distances + d.z * d.z, j});
    }
    std::sort(others.begin(), others.end());
    others.resize(std::min(others.size(), neighbors));
    for (const auto& [unused_j, j] : others)
      for (const auto& [unused_k, k] : others) {
        std::array<stem_index, 3> triplet = {i, j, k};
        std::sort(triplet.begin(), triplet.end());
        if (j < k) triplets.insert(triplet);
      }
  }
  return triplets;
}

}  // namespace globalmatch::oracles
