// Maps that are loaded when they are needed, of which the latest stay in memory.
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

/// Loads maps by their number; of those that were asked for last some are kept. Refers to `load`.
template <class Load>
class recent_maps {
 public:
  explicit recent_maps(const Load& load) : load_(load) {}

  std::shared_ptr<const stem_map> operator()(std::size_t map) {
    constexpr std::size_t capacity = 8;  // of some 8 MB each
    const auto found =
        std::find_if(kept_.begin(), kept_.end(), [&](const auto& entry) { return entry.first == map; });
    if (found != kept_.end()) {
      std::rotate(found, found + 1, kept_.end());
    } else {
      if (kept_.size() == capacity) kept_.erase(kept_.begin());
      kept_.emplace_back(map, std::make_shared<const stem_map>(load_(map)));
    }
    return kept_.back().second;
  }

 private:
  const Load& load_;
  std::vector<std::pair<std::size_t, std::shared_ptr<const stem_map>>> kept_;  // the latest last
};

}  // namespace globalmatch::detail
