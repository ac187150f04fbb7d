// A matcher in the manner of TOA (Kelbe et al. 2016, "Marker-free registration of forest terrestrial laser
// scanner data pairs with embedded confidence metrics", IEEE JSTARS). [GM] 2.2 and 3.2 fix: any triplet of
// stems is tried; triplets that differ in edges or DBH are left out; of the transforms of all others that one
// is taken on which most stems agree. The abstract of Kelbe et al. speaks of voting for it.
//
// Ours: maps are level, so that edges are horizontal and a transform has four degrees of freedom; all pairs
// of like triplets are tried, where [GM] 5.3 calls both TOA and Fast-TOA RANSAC; the tolerances, as no source
// at hand has them; like triplets are found by a grid over their edges, so that not every two must be
// compared, which is faster than what was published and finds the same ones; the least squares over all
// agreeing stems in the end. Radii that are unknown are alike: without any, edges decide alone. Cost: cubic
// in the stems, and a try for every two triplets that are alike.
#pragma once

#include "baselines/like_triplets.hpp"

namespace globalmatch::benchmarks {

/// The transform of two like triplets on which most stems agree, of several the first; `funnel` is filled.
inline scored_transform best_of_triplets(const stem_alignment& maps, matching_funnel& funnel) {
  const like_triplets triplets(maps, {.edge_threshold = maps.inlier_threshold});
  scored_transform best;
  funnel.target_triangles = triplets.target_triplets();
  funnel.source_triangles = triplets.for_each([&](const auto& pairs, double) {
    matching_context::poll_cancelled_at(funnel.local_pairs++);
    maps.keep_better(pairs, best);
  });
  funnel.tested = funnel.local_pairs;
  return best;
}

inline match_run run_toa(const two_maps& maps, const run_limits& limits, double inlier_threshold) {
  return run_by_triplets(maps, limits, inlier_threshold, best_of_triplets);
}

}  // namespace globalmatch::benchmarks
