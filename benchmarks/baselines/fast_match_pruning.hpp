// Fast match pruning (Cai, Chin, Bustos and Schindler 2019, ISPRS J. 151): matches that cannot be part of the
// largest consensus are removed before it is searched for. Theirs: the bound of one match (if it is an
// inlier, others are inliers only where differences to it agree within twice the threshold, which leaves the
// angle alone to be searched), and that a match whose bound is below a consensus that was found cannot be in
// the largest. Ours: the passes, which bound again what is left, over fewer matches, until none is removed.
#pragma once

#include <globalmatch/detail/core/rigid.hpp>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <vector>

#include "baselines/yaw_search.hpp"

namespace globalmatch::benchmarks {

using detail::rigid;
using search_deadline = std::chrono::steady_clock::time_point;

inline bool is_over(search_deadline deadline) {
  return std::chrono::steady_clock::now() >= deadline;
}

/// How many matches a transform brings within the threshold [m].
inline std::size_t count_inliers(const std::vector<point_match>& matches, const rigid& target_from_source,
                                 double threshold) {
  return std::size_t(std::count_if(matches.begin(), matches.end(), [&](const point_match& m) {
    return (target_from_source * m.source - m.target).squared_norm() <= threshold * threshold;
  }));
}

struct pruned_matches {
  std::vector<point_match> matches;  ///< in their order; holds every largest consensus
  rigid target_from_source;          ///< of the largest consensus that was come by
  std::size_t consensus = 0;         ///< its inliers
  bool stopped = false;              ///< at the deadline, before all was bounded
};

/// An upper bound of any consensus that holds match `k`, with the angle that has it.
inline best_angle bound_with(const std::vector<point_match>& matches, std::size_t k, double threshold,
                             std::vector<angle_interval>& intervals) {
  intervals.clear();
  for (const point_match& m : matches)
    if (const auto angles =
            angles_within(m.source - matches[k].source, m.target - matches[k].target, 2 * threshold))
      intervals.push_back(*angles);
  return stab_most(intervals);
}

/// Removes the matches that no consensus as large as the largest can hold. Cost: n^2 log n a pass.
inline pruned_matches prune_matches(const std::vector<point_match>& matches, double threshold,
                                    search_deadline deadline = search_deadline::max()) {
  pruned_matches result{matches, {}, 0, false};
  std::vector<angle_interval> intervals;
  std::vector<std::size_t> bounds;
  for (std::size_t before = matches.size() + 1; result.matches.size() < before;) {
    before = result.matches.size();
    bounds.assign(before, before);
    for (std::size_t k = 0; k < before && !result.stopped; ++k) {
      const best_angle best = bound_with(result.matches, k, threshold, intervals);
      bounds[k] = best.count;
      const point_match& m = result.matches[k];
      const detail::mat3 turn = detail::rotation_about_z(best.angle);
      const rigid through{turn, m.target - turn * m.source};
      const std::size_t inliers =
          best.count > result.consensus ? count_inliers(matches, through, threshold) : 0;
      if (inliers > result.consensus) {
        result.consensus = inliers;
        result.target_from_source = through;
      }
      result.stopped = is_over(deadline);
    }
    std::size_t next = 0;
    std::erase_if(result.matches, [&](const point_match&) { return bounds[next++] < result.consensus; });
    if (result.stopped) break;
  }
  return result;
}

}  // namespace globalmatch::benchmarks
