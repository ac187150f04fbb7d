// What the scanners of two maps saw, for those who match the maps.
#pragma once

#include "globalmatch/detail/core/visible_ranges.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

/// What the scanner of a map saw. Refers to the map.
struct scan_view {
  const visible_ranges* visible = nullptr;
  const terrain* ground = nullptr;
};

/// Of both maps that are matched.
struct scan_views {
  scan_view source, target;

  scan_views reversed() const { return {target, source}; }
};

}  // namespace globalmatch::detail
