// The funnel: what each step of a run was given, what it left, and why it left no more.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace globalmatch {

/// One step between the points of a scan and the correspondences.
struct funnel_step {
  std::string_view step;  ///< its name, as in the reasons of a decision
  std::string_view of;    ///< what came in
  std::size_t in = 0;
  std::string_view what;  ///< what went out
  std::size_t out = 0;
  std::string_view rest;    ///< why the rest was dropped
  std::string_view remedy;  ///< what to look at where too little is left
};

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

}  // namespace globalmatch
