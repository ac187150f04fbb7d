// Links of a survey made wrong on purpose.
#pragma once

#include <globalmatch/detail/core/random.hpp>
#include <globalmatch/detail/matching/prepared_stems.hpp>
#include <globalmatch/detail/survey/plan_pose.hpp>
#include <globalmatch/detail/survey/survey_link.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

namespace globalmatch::benchmarks {

using namespace detail;

/// Replaces this share of the links by wrong ones, which keep their NFA and covariance: every other one is
/// between any two maps, the rest place the same maps elsewhere.
inline void replace_links(std::vector<survey_link>& links, std::span<const prepared_stems> maps, double share,
                          random_source& random) {
  constexpr double range = 30;  // [m] of wrong places
  const auto anywhere = [&] {
    return vec2{range * (2 * random.uniform() - 1), range * (2 * random.uniform() - 1)};
  };
  for (survey_link& l : links) {
    if (random.uniform() >= share) continue;
    if (random.uniform() < 0.5) {
      const auto other = random.below(std::uint32_t(maps.size()));
      if (other != l.source && maps[other].stems.size() > 0) l.target = other;
    }
    l.center = anywhere();
    const plan_pose turn{{0, 0}, std::numbers::pi * (2 * random.uniform() - 1)};
    l.target_from_source = {l.center - turn * anywhere(), turn.yaw};
    for (correspondence& c : l.correspondences)
      c = {random.below(std::uint32_t(maps[l.source].stems.size())),
           random.below(std::uint32_t(maps[l.target].stems.size()))};
  }
}

/// Makes half of the links of this share of the maps agree on one wrong place of the map, 3 to 10 m off.
/// Returns the maps.
inline std::vector<std::size_t> mislead_maps(std::vector<survey_link>& links, std::size_t maps, double share,
                                             random_source& random) {
  constexpr double least = 3, most = 10;  // [m]
  std::vector<std::size_t> misled;
  for (std::size_t m = 0; m < maps; ++m) {
    if (random.uniform() >= share) continue;
    std::vector<survey_link*> own;
    for (survey_link& l : links)
      if (l.source == m || l.target == m) own.push_back(&l);
    if (own.size() < 2) continue;
    for (std::size_t i = own.size(); i > 1; --i) std::swap(own[i - 1], own[random.below(std::uint32_t(i))]);
    own.resize(own.size() / 2);
    const double direction = 2 * std::numbers::pi * random.uniform(),
                 distance = least + (most - least) * random.uniform();
    const plan_pose wrong{{distance * std::cos(direction), distance * std::sin(direction)}, 0};
    for (survey_link* l : own) {
      if (l->source == m) {
        l->target_from_source = l->target_from_source * wrong;
      } else {
        l->target_from_source = wrong.inverse() * l->target_from_source;
        l->center = wrong.inverse() * l->center;
      }
    }
    misled.push_back(m);
  }
  return misled;
}

}  // namespace globalmatch::benchmarks
