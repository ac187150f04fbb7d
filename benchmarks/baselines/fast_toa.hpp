// A matcher in the manner of Fast-TOA (Tremblay and Beland 2018, "Towards operational marker-free
// registration of terrestrial lidar data in forests", ISPRS J.). [GM] 2.2 fixes
// that likeness by relative positions and DBH leaves out pairs of triplets and sorts the others, which it
// says of Kelbe et al., too; of this one only that it is the efficient version. What its program documents
// has a largest relative difference of DBH and a largest one of positions.
//
// Ours: level maps, horizontal edges, all pairs in place of RANSAC, tolerances and grid as in `toa.hpp`; the
// order and the end of the search; narrow triplets, which determine a rotation badly, are left out;
// the pairs whose edges differ least are tried first, and the search ends when a transform brings enough
// stems together. Where none does all pairs are tried, as by TOA. Radii that are unknown are alike.
#pragma once

#include "baselines/like_triplets.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace globalmatch::benchmarks {

struct fast_toa_options {
  double min_width = 0.5;          ///< [m] of triplets
  double sufficient_share = 0.3;   ///< of the stems of the smaller map
  std::size_t min_sufficient = 6;  ///< stems
};

/// A pair of like triplets, by the sum of the differences of their edges [m].
struct ranked_triplets {
  double difference;
  std::array<correspondence, 3> pairs;
};

/// The first transform, in order of likeness, on which enough stems agree, otherwise that on which most do.
inline scored_transform first_sufficient(const stem_alignment& maps, matching_funnel& funnel,
                                         const fast_toa_options& options = {}) {
  const like_triplets triplets(maps,
                               {.edge_threshold = maps.inlier_threshold, .min_width = options.min_width});
  std::vector<ranked_triplets> ranked;
  funnel.target_triangles = triplets.target_triplets();
  funnel.source_triangles = triplets.for_each([&](const auto& pairs, double difference) {
    ranked.push_back({difference, pairs});
  });
  funnel.local_pairs = ranked.size();
  std::stable_sort(ranked.begin(), ranked.end(), [](const ranked_triplets& a, const ranked_triplets& b) {
    return a.difference < b.difference;
  });
  const double smaller = double(std::min(maps.source.size(), maps.target.size()));
  const auto sufficient =
      std::max(options.min_sufficient, std::size_t(std::ceil(options.sufficient_share * smaller)));
  scored_transform best;
  for (const ranked_triplets& next : ranked) {
    if (best.agreeing >= sufficient) break;
    matching_context::poll_cancelled_at(funnel.tested++);
    maps.keep_better(next.pairs, best);
  }
  return best;
}

inline match_run run_fast_toa(const two_maps& maps, const run_limits& limits, double inlier_threshold) {
  return run_by_triplets(maps, limits, inlier_threshold,
                         [](const stem_alignment& alignment, matching_funnel& funnel) {
                           return first_sufficient(alignment, funnel);
                         });
}

}  // namespace globalmatch::benchmarks
