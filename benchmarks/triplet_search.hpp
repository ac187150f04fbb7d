// Exhaustive search over triplets of stems, in the manner of TOA (Kelbe et al. 2016) and Fast-TOA (Tremblay
// and Beland 2018) but without tree diameters: every triplet of one map against every one of the other with
// like edges, each transform scored by all stems. A baseline: cost grows with the sixth power of the stems.
#pragma once

#include <globalmatch/detail/core/eigen_border.hpp>
#include <globalmatch/stem_matching.hpp>

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

namespace globalmatch::benchmarks {

using namespace detail;

struct triplet_match {
  std::optional<Eigen::Isometry3d> target_from_source;  ///< the one with most inliers
  std::size_t source_triplets = 0, target_triplets = 0, like_pairs = 0;
};

/// A transform between the levelled local frames of two maps as one between the frames of their callers.
inline Eigen::Isometry3d in_scan_frames(const rigid& target_from_source, const position_set& source,
                                        const position_set& target) {
  return to_eigen(target.frame.local_from_scan()).inverse() * to_eigen(target_from_source) *
         to_eigen(source.frame.local_from_scan());
}

inline std::vector<triangle> all_triplets(const position_set& stems) {
  std::vector<triangle> triplets;
  for (stem_index i = 0; i < stems.size(); ++i)
    for (stem_index j = i + 1; j < stems.size(); ++j)
      for (stem_index k = j + 1; k < stems.size(); ++k)
        triplets.push_back(make_triangle(stems, {i, j, k}, true));
  return triplets;
}

template <position_range Source, position_range Target>
triplet_match match_all_triplets(const Source& source_stems, const Target& target_stems,
                                 double inlier_threshold) {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const position_set source = import_positions(source_stems, up, "source");
  const position_set target = import_positions(target_stems, up, "target");
  const matching_context maps(source, target, false, degrees_of_freedom::four);
  const std::vector<triangle> source_triplets = all_triplets(source), target_triplets = all_triplets(target);
  constexpr float cell = 0.1f;  // [m]
  const triangle_grid target_grid(target_triplets.size(), cell, [&](std::size_t i) {
    return triangle_grid::item{edge_point(target_triplets[i]), target_triplets[i].vertices};
  });
  triplet_match result;
  result.source_triplets = source_triplets.size();
  result.target_triplets = target_triplets.size();
  std::size_t max_inliers = 0;
  std::optional<rigid> best;
  const auto try_transform = [&](const std::array<correspondence, 3>& triplet) {
    const auto transform = maps.fit(triplet);
    if (!transform) return;
    std::size_t inliers = 0;
    for (const vec3& p : source.at) {
      bool is_inlier = false;
      maps.for_each_inlier(*transform * p, inlier_threshold, [&](stem_index, double) { is_inlier = true; });
      inliers += is_inlier;
    }
    if (inliers <= max_inliers) return;
    max_inliers = inliers;
    best = *transform;
  };
  for (const triangle& triplet : source_triplets)
    for (const triangle& t : admissible_orders(triplet, inlier_threshold))
      target_grid.for_each_near(edge_point(t), float(inlier_threshold), [&](const auto& item) {
        const auto& like = item.label;
        ++result.like_pairs;
        try_transform({{{t.vertices[0], like[0]}, {t.vertices[1], like[1]}, {t.vertices[2], like[2]}}});
      });
  if (best) result.target_from_source = in_scan_frames(*best, source, target);
  return result;
}

}  // namespace globalmatch::benchmarks
