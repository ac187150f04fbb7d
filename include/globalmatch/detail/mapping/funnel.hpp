// The funnel: what each step of a run was given, what it left, and why it left no more.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

/// The first step that leaves nothing, or else the first that leaves fewer than `minimum`, as in "ground: 0
/// ground points of 17 raster cells; is `up` the direction away from the ground?"; empty when there is none.
inline std::string where_lost(const std::vector<funnel_step>& steps, std::size_t minimum) {
  for (const std::size_t fewer_than : {std::size_t(1), minimum})
    for (const funnel_step& s : steps)
      if (s.out < fewer_than)
        return std::string(s.step) + ": " + std::to_string(s.out) + " " + std::string(s.what) + " of " +
               std::to_string(s.in) + " " + std::string(s.of) + "; " + std::string(s.remedy);
  return "";
}

}  // namespace globalmatch::detail
