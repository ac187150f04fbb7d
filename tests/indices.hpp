// Indices of all of some things.
#pragma once

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace globalmatch::scenes {

inline std::vector<std::uint32_t> all_of(std::size_t count) {
  std::vector<std::uint32_t> indices(count);
  std::iota(indices.begin(), indices.end(), 0u);
  return indices;
}

}  // namespace globalmatch::scenes
