// The largest consensus of matches under a turn about the vertical and a translation, by branch and bound
// (Cai, Chin, Bustos and Schindler 2019, ISPRS J. 151). Theirs: cubes of translations, best upper bound
// first; a cube's upper bound is the consensus at its centre with the threshold widened by half its diagonal,
// the one at the threshold itself a solution, both found over all angles at once by max-stabbing. Ours:
// the first cube, that matches which a cube loses are not looked at in its parts, and the size below which
// cubes are not divided.
#pragma once

#include <globalmatch/detail/core/rigid.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <queue>
#include <tuple>
#include <utility>
#include <vector>

#include "baselines/fast_match_pruning.hpp"
#include "baselines/yaw_search.hpp"

namespace globalmatch::benchmarks {

struct consensus_options {
  double threshold = 0.1;    ///< [m] of an inlier
  double resolution = 1e-3;  ///< [m] cubes whose half diagonal is no larger are not divided
  search_deadline deadline = search_deadline::max();
};

struct max_consensus {
  rigid target_from_source;
  std::size_t inliers = 0;
  std::size_t bound = 0;  ///< no transform has more: `inliers`, unless stopped or at the resolution
  std::size_t cubes = 0;  ///< that were bounded
  bool stopped = false;   ///< at the deadline, with the best that was found until then
};

namespace consensus_detail {

/// Translations, and the matches that may be inliers there.
struct translation_cube {
  vec3 center;
  double half_side = 0;
  std::size_t bound = 0, number = 0;
  std::vector<std::size_t> matches = {};

  double half_diagonal() const { return std::sqrt(3.0) * half_side; }
  /// The last one found is the deepest, and goes first where bounds are equal.
  friend bool operator<(const translation_cube& a, const translation_cube& b) {
    return std::tie(a.bound, a.number) < std::tie(b.bound, b.number);
  }
};

inline vec3 centroid(const std::vector<point_match>& matches, vec3 point_match::*part) {
  vec3 sum;
  for (const point_match& m : matches) sum += m.*part;
  return sum / double(matches.size());
}

/// The search over matches whose centroids are the origins, so that the first cube is small.
class consensus_cubes {
 public:
  consensus_cubes(std::vector<point_match> matches, const consensus_options& options)
      : matches_(std::move(matches)), options_(options) {}

  /// `known`: inliers of a transform that is known; only more of them are found.
  max_consensus search(std::size_t known) {
    best_.inliers = known;
    bound_cube(first_cube());
    while (!cubes_.empty() && cubes_.top().bound > best_.inliers && !best_.stopped) {
      const translation_cube cube = cubes_.top();
      cubes_.pop();
      unresolved_ = std::max(unresolved_, cube.half_diagonal() <= options_.resolution ? cube.bound : 0);
      if (cube.half_diagonal() > options_.resolution) divide(cube);
      best_.stopped = is_over(options_.deadline);
    }
    best_.bound = std::max(best_.inliers, unresolved_);
    if (!cubes_.empty()) best_.bound = std::max(best_.bound, cubes_.top().bound);
    return best_;
  }

 private:
  /// A match is an inlier of no translation longer than its two points are far from the origins.
  translation_cube first_cube() const {
    translation_cube cube;
    for (const point_match& m : matches_)
      cube.half_side = std::max(cube.half_side, m.source.norm() + m.target.norm() + options_.threshold);
    cube.matches.resize(matches_.size());
    std::iota(cube.matches.begin(), cube.matches.end(), std::size_t(0));
    return cube;
  }

  void divide(const translation_cube& cube) {
    const double half = cube.half_side / 2;
    for (int part = 0; part < 8; ++part) {
      const vec3 shift{part & 1 ? half : -half, part & 2 ? half : -half, part & 4 ? half : -half};
      bound_cube({cube.center + shift, half, 0, 0, cube.matches});
    }
  }

  /// Angles by which the matches are inliers at the centre of the cube; `kept`: those that have any.
  best_angle search_angles(const translation_cube& cube, double threshold, std::vector<std::size_t>* kept) {
    intervals_.clear();
    for (const std::size_t i : cube.matches)
      if (const auto angles =
              angles_within(matches_[i].source, matches_[i].target - cube.center, threshold)) {
        intervals_.push_back(*angles);
        if (kept) kept->push_back(i);
      }
    return stab_most(intervals_);
  }

  void bound_cube(translation_cube cube) {
    ++best_.cubes;
    std::vector<std::size_t> kept;
    cube.bound = search_angles(cube, options_.threshold + cube.half_diagonal(), &kept).count;
    if (cube.bound <= best_.inliers) return;
    cube.matches = std::move(kept);
    if (const best_angle at_center = search_angles(cube, options_.threshold, nullptr);
        at_center.count > best_.inliers) {
      best_.inliers = at_center.count;
      best_.target_from_source = {detail::rotation_about_z(at_center.angle), cube.center};
    }
    cube.number = best_.cubes;
    if (cube.bound > best_.inliers) cubes_.push(std::move(cube));
  }

  std::vector<point_match> matches_;
  consensus_options options_;
  std::priority_queue<translation_cube> cubes_;
  std::vector<angle_interval> intervals_;
  std::size_t unresolved_ = 0;  // bound of the cubes that were too small to divide
  max_consensus best_;
};

}  // namespace consensus_detail

/// A transform with most inliers; `known` is one to begin with. Cost: cubes times n log n, cubes without a
/// useful limit.
inline max_consensus find_largest_consensus(const std::vector<point_match>& matches,
                                            const consensus_options& options, const rigid& known = {}) {
  const std::size_t of_known = count_inliers(matches, known, options.threshold);
  if (matches.empty()) return {};
  const vec3 from = consensus_detail::centroid(matches, &point_match::source);
  const vec3 to = consensus_detail::centroid(matches, &point_match::target);
  std::vector<point_match> centered = matches;
  for (point_match& m : centered) m = {m.source - from, m.target - to};
  max_consensus found = consensus_detail::consensus_cubes(std::move(centered), options).search(of_known);
  const rigid& local = found.target_from_source;
  found.target_from_source = found.inliers > of_known
                                 ? rigid{local.rotation, local.translation + to - local.rotation * from}
                                 : known;
  return found;
}

}  // namespace globalmatch::benchmarks
