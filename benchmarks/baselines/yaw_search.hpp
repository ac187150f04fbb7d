// The angle about the vertical under which most points come near their counterparts: every correspondence
// allows one interval of angles, and the angle that lies in most intervals is found by sorting their ends
// (max-stabbing, as in Cai, Chin, Bustos and Schindler 2019, "Practical optimal registration of terrestrial
// LiDAR scan pairs", ISPRS J. 151). Exact; cost: n log n. Ours: the middle of the best angles is returned.
#pragma once

#include <globalmatch/detail/core/vectors.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <vector>

namespace globalmatch::benchmarks {

using detail::vec3;

/// A keypoint of the source, and the one of the target that it was matched with [m].
struct point_match {
  vec3 source, target;
};

/// Angles [rad] from `begin`, in [-pi, pi), counter-clockwise to `begin + length`; both ends belong to it.
struct angle_interval {
  double begin = 0, length = 0;
};

inline double wrapped_angle(double angle) {
  constexpr double turn = 2 * std::numbers::pi;
  angle -= turn * std::floor((angle + std::numbers::pi) / turn);
  return angle < std::numbers::pi ? angle : angle - turn;
}

/// The angles about z by which `p` may turn to come within `radius` of `q`: it turns on a circle, which a
/// ball cuts in one arc. Nothing when there are none.
inline std::optional<angle_interval> angles_within(const vec3& p, const vec3& q, double radius) {
  constexpr double pi = std::numbers::pi;
  const double of_p = p.xy().norm(), of_q = q.xy().norm(), lift = p.z - q.z;
  const double excess = of_p * of_p + of_q * of_q + lift * lift - radius * radius, product = 2 * of_p * of_q;
  if (excess > product) return std::nullopt;
  if (excess <= -product) return angle_interval{-pi, 2 * pi};
  const double half = std::acos(excess / product);
  const double middle = std::atan2(q.y, q.x) - std::atan2(p.y, p.x);
  return angle_interval{wrapped_angle(middle - half), 2 * half};
}

struct best_angle {
  double angle = 0;  ///< [rad]
  std::size_t count = 0;
};

/// An angle in most of the intervals, and in how many it is.
inline best_angle stab_most(const std::vector<angle_interval>& intervals) {
  constexpr double pi = std::numbers::pi;
  struct interval_end {
    double at;
    bool closes;
  };
  std::vector<interval_end> ends;
  std::size_t open = 0;  // at -pi
  for (const angle_interval& i : intervals) {
    const double end = i.begin + i.length;
    open += end >= pi;
    if (i.length >= 2 * pi) continue;
    ends.push_back({i.begin, false});
    ends.push_back({end >= pi ? end - 2 * pi : end, true});
  }
  std::sort(ends.begin(), ends.end(), [](const interval_end& a, const interval_end& b) {
    return a.at != b.at ? a.at < b.at : a.closes < b.closes;
  });
  best_angle best{0, open};
  if (!ends.empty()) best.angle = wrapped_angle((ends.back().at - 2 * pi + ends.front().at) / 2);
  for (std::size_t e = 0; e < ends.size(); ++e) {
    if (ends[e].closes) {
      --open;
      continue;
    }
    if (++open <= best.count) continue;
    const double next = e + 1 < ends.size() ? ends[e + 1].at : ends.front().at + 2 * pi;
    best = {wrapped_angle((ends[e].at + next) / 2), open};
  }
  return best;
}

}  // namespace globalmatch::benchmarks
