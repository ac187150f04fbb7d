// Where links would place maps, and how many of them agree.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/detail/matching/prior.hpp"
#include "globalmatch/detail/survey/plan_pose.hpp"

namespace globalmatch::detail {

/// A transform that a link proposes, and what of the link it transforms.
struct proposed_place {
  plan_pose pose;
  vec2 center;  ///< [m] of the paired stems, before `pose`
  std::uint32_t link;
};

/// Whether two proposals are one place: no two places of a map are so near that stems can be paired at both.
inline bool agree(const proposed_place& a, const proposed_place& b) {
  constexpr double same_place = 1, same_yaw = 0.05;  // [m] [rad]
  return (b.pose * a.center - a.pose * a.center).norm() < same_place &&
         std::abs(wrapped(b.pose.yaw - a.pose.yaw)) < same_yaw;
}

/// Proposals that agree with one of them.
struct agreeing_places {
  std::size_t count = 0;
  std::size_t one = 0;  ///< that they agree with; the first of those with as many
};

/// Of those that agree with proposal `i` only those count that `counts(i, other)`. Cost: quadratic.
template <class Counts>
agreeing_places max_agreement(std::span<const proposed_place> places, const Counts& counts) {
  agreeing_places most;
  for (std::size_t i = 0; i < places.size(); ++i) {
    std::size_t count = 0;
    for (const proposed_place& other : places) count += agree(places[i], other) && counts(i, other);
    if (count > most.count) most = {count, i};
  }
  return most;
}
inline agreeing_places max_agreement(std::span<const proposed_place> places) {
  return max_agreement(places, [](std::size_t, const proposed_place&) { return true; });
}

}  // namespace globalmatch::detail
