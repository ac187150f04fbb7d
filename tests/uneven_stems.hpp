// Maps without symmetry, and hypotheses about them.
#pragma once

#include <cmath>
#include <cstddef>

#include "globalmatch/detail/core/random.hpp"
#include "globalmatch/detail/core/rigid.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::scenes {

using namespace detail;

inline constexpr auto four_dof = degrees_of_freedom::four, six_dof = degrees_of_freedom::six;

/// Stems on a strip far from the origin, denser at one end, on a slope.
inline position_set uneven_stems(std::size_t count, random_source& random) {
  position_set set;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = 60 * std::pow(random.uniform(), 2), y = 25 * random.uniform();
    set.at.push_back({300 + x, -80 + y, 12 + 0.2 * x - 0.1 * y + random.normal()});
    set.original.push_back(static_cast<stem_index>(i));
  }
  return set;
}

inline position_set transformed_stems(const rigid& transform, const position_set& stems) {
  position_set result = stems;
  for (vec3& p : result.at) p = transform * p;
  return result;
}

inline rigid some_transform() {
  return {rotation_about_z(0.8), {-40, 70, 5}};
}

/// A hypothesis that pairs stem i with stem i.
inline local_hypothesis pairing_all(std::size_t count, const rigid& transform) {
  local_hypothesis h;
  h.target_from_source = transform;
  h.inlier_threshold = 1;
  for (stem_index i = 0; i < count; ++i) h.correspondences.push_back({i, i});
  return h;
}

}  // namespace globalmatch::scenes
