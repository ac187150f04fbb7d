// Algorithm 1 with the test of the urban method (Yang et al. 2016) in place of the paper's: two triangle
// pairs agree where the distance of their centroids is the same in both maps. [GM] 3.2.3 and Fig. 6 b fix
// this test and find it ambiguous; all else is as in `literal_algorithm_1.hpp`.
#pragma once

#include "baselines/literal_algorithm_1.hpp"

namespace globalmatch::benchmarks {

/// The test of the urban method, in place of line 5.
inline auto consistent_centroids(const position_set& source, const position_set& target, double epsilon) {
  return [&source, &target, epsilon](const triangle_pair& u1, const triangle_pair& u2) {
    return oracles::centroids_agree(source, target, u1, u2, epsilon);
  };
}

inline match_run run_centroid_test(const two_maps& maps, const run_limits& limits, double inlier_threshold) {
  return run_consensus(maps, limits, inlier_threshold, [&](const auto& source, const auto& target) {
    return consistent_centroids(source, target, inlier_threshold);
  });
}

}  // namespace globalmatch::benchmarks
