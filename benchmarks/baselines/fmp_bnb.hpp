// FMP+BnB, the paper's baseline from general scan registration ([GM] 5.3, Comparison; Cai et al. 2019):
// keypoints, fast match pruning, branch and bound, in four degrees of freedom. Needs PCL
// (GLOBALMATCH_BENCHMARK_PCL).
#pragma once

#include <globalmatch/detail/core/eigen_border.hpp>
#include <globalmatch/points.hpp>

#include <pcl/console/print.h>
#include <Eigen/Geometry>

#include <chrono>
#include <cstddef>
#include <optional>
#include <vector>

#include "baselines/branch_and_bound.hpp"
#include "baselines/fast_match_pruning.hpp"
#include "baselines/pcl_keypoints.hpp"

namespace globalmatch::benchmarks {

struct keypoint_registration_options {
  keypoint_options keypoints = {};
  double threshold = 0.3;   ///< [m] of an inlier: one and a half voxels (ours)
  double max_seconds = 60;  ///< of matching: pruning and search stop then
};

struct keypoint_registration {
  /// Of the largest consensus; nothing where fewer than two matches agree.
  std::optional<Eigen::Isometry3d> target_from_source;
  double keypoint_seconds = 0, matching_seconds = 0;
  bool stopped = false;  ///< at the deadline: there may be a larger consensus
  std::size_t source_keypoints = 0, target_keypoints = 0, correspondences = 0;
  std::size_t pruned = 0;   ///< correspondences that pruning removed
  std::size_t inliers = 0;  ///< the largest consensus
};

/// Registers two scans that are level. Sets PCL's verbosity: keypoints that it skips are no errors.
template <point_range S, point_range T>
keypoint_registration register_by_keypoints(const S& source, const T& target,
                                            const keypoint_registration_options& options = {}) {
  using clock = std::chrono::steady_clock;
  const auto seconds_since = [](clock::time_point start) {
    return std::chrono::duration<double>(clock::now() - start).count();
  };
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
  keypoint_registration result;
  const auto start = clock::now();
  const described_keypoints from = find_keypoints(source, options.keypoints);
  const described_keypoints to = find_keypoints(target, options.keypoints);
  result.keypoint_seconds = seconds_since(start);
  result.source_keypoints = from.places.size();
  result.target_keypoints = to.places.size();

  const auto start_of_matching = clock::now();
  const search_deadline deadline =
      start_of_matching +
      std::chrono::duration_cast<clock::duration>(std::chrono::duration<double>(options.max_seconds));
  const std::vector<point_match> matches = match_keypoints(from, to);
  const pruned_matches kept = prune_matches(matches, options.threshold, deadline);
  const max_consensus found = find_largest_consensus(
      kept.matches, {.threshold = options.threshold, .deadline = deadline}, kept.target_from_source);
  result.matching_seconds = seconds_since(start_of_matching);
  result.correspondences = matches.size();
  result.pruned = matches.size() - kept.matches.size();
  result.inliers = found.inliers;
  result.stopped = kept.stopped || found.stopped;
  if (found.inliers >= 2) result.target_from_source = detail::to_eigen(found.target_from_source);
  return result;
}

}  // namespace globalmatch::benchmarks
