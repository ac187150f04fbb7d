// Matches of points of which some agree with one transform.
#pragma once

#include "globalmatch/detail/core/random.hpp"
#include "globalmatch/detail/core/rigid.hpp"

#include "baselines/yaw_search.hpp"

#include <cstddef>
#include <numbers>
#include <vector>

namespace globalmatch {

struct planted_matches {
  std::vector<benchmarks::point_match> matches;  ///< those that agree come first
  detail::rigid target_from_source;

  /// Points of a box of 20 x 20 x 4 m; matches that agree do so within `noise` [m] an axis.
  planted_matches(std::size_t agreeing, std::size_t others, double noise, detail::random_source& random) {
    const auto place = [&] {
      return detail::vec3{20 * random.uniform() - 10, 20 * random.uniform() - 10, 4 * random.uniform()};
    };
    target_from_source = {detail::rotation_about_z(2 * std::numbers::pi * random.uniform()),
                          {30 + random.normal(), -8, 2 * random.normal()}};
    for (std::size_t i = 0; i < agreeing; ++i) {
      const detail::vec3 p = place();
      const detail::vec3 off{random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() - 0.5};
      matches.push_back({p, target_from_source * p + 2 * noise * off});
    }
    for (std::size_t i = 0; i < others; ++i) matches.push_back({place(), target_from_source * place()});
  }
};

}  // namespace globalmatch
