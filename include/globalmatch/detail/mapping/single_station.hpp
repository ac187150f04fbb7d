// Was a scan taken from one place, and from that one? From there the scanner does not see past its own stems.
#pragma once

#include <cmath>
#include <cstddef>

#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

/// Whether the stems of a map agree with how far its scanner saw. Not so for merged scans, for those of a
/// scanner that moved, or that stood elsewhere; nor where too few stems show it.
inline bool is_seen_from_scanner(const stem_map& map) {
  constexpr std::size_t min_stems = 8;
  constexpr double max_share = 0.2;  // of the stems it saw past: some are none, or lean
  if (map.visible.empty()) return false;
  std::size_t stems = 0, past = 0;
  for (const stem& s : map.stems) {
    const vec3 base = map.terrain.frame.to_local(vec3::from(s.position));
    const vec3 axis = map.terrain.frame.rotation * vec3::from(s.axis);
    const vec3 offset = base - map.visible.scanner;
    if (!(axis.z > 0) || !visible_ranges::is_covered(std::hypot(offset.x, offset.y), s.radius)) continue;
    ++stems;
    past += map.visible.sees_past(base, axis / axis.z, s.radius, s.position_sigma);
  }
  return stems >= min_stems && double(past) <= max_share * double(stems);
}

}  // namespace globalmatch::detail
