// What the baselines share: both maps in levelled local frames, and how many stems agree on a transform.
#pragma once

#include <globalmatch/detail/core/eigen_border.hpp>
#include <globalmatch/detail/matching/matching_context.hpp>
#include <globalmatch/positions.hpp>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "match_run.hpp"
#include "stem_layouts.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace globalmatch::benchmarks {

using namespace detail;

/// A transform between the levelled local frames of two maps as one between the frames of their callers.
inline Eigen::Isometry3d in_scan_frames(const rigid& target_from_source, const position_set& source,
                                        const position_set& target) {
  return to_eigen(target.frame.local_from_scan()).inverse() * to_eigen(target_from_source) *
         to_eigen(source.frame.local_from_scan());
}

/// Stems and their radii, where they are measured, in a levelled local frame.
inline position_set import_stems(const positions& stems, const std::vector<double>& radii,
                                 std::string_view name) {
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  return radii.empty() ? import_positions(stems, up, name)
                       : import_positions(with_radii(stems, radii), up, name);
}

/// A transform and the source stems that agree on it.
struct scored_transform {
  rigid target_from_source;
  std::size_t agreeing = 0;
};

/// Both maps, and what transforms make of them: of four degrees of freedom, distances horizontal.
class stem_alignment {
 public:
  /// A stem agrees that ends within `inlier_threshold` [m] of one of the other map.
  stem_alignment(const two_maps& maps, double threshold)
      : source(import_stems(maps.source, maps.source_radii, "source")),
        target(import_stems(maps.target, maps.target_radii, "target")),
        inlier_threshold(threshold),
        context(source, target, true, degrees_of_freedom::four) {}
  stem_alignment(const stem_alignment&) = delete;
  stem_alignment& operator=(const stem_alignment&) = delete;

  const position_set source, target;
  const double inlier_threshold;
  const matching_context context;  // refers to both

  std::size_t agreeing_stems(const rigid& target_from_source) const {
    std::size_t agreeing = 0;
    for (const vec3& p : source.at) agreeing += context.has_inlier(target_from_source * p, inlier_threshold);
    return agreeing;
  }

  /// Replaces `best` by the transform that fits these correspondences, where more stems agree on that.
  void keep_better(std::span<const correspondence> pairs, scored_transform& best) const {
    const auto transform = context.fit(pairs);
    if (!transform) return;
    const std::size_t agreeing = agreeing_stems(*transform);
    if (agreeing > best.agreeing) best = {*transform, agreeing};
  }

  /// The least squares transform over all stems that agree, re-paired until convergence, in the frames of the
  /// caller; nothing where fewer than three stems agree.
  std::optional<Eigen::Isometry3d> refined(const scored_transform& best) const {
    constexpr int max_iterations = 20;
    if (best.agreeing < 3) return std::nullopt;
    rigid transform = best.target_from_source;
    std::vector<correspondence> pairs, before;
    for (int i = 0; i < max_iterations; ++i) {
      pairs = context.pair_stems(transform, inlier_threshold);
      const auto fitted = context.fit(pairs);
      if (pairs.size() < 3 || !fitted || pairs == before) break;
      transform = *fitted;
      before = pairs;
    }
    return in_scan_frames(transform, source, target);
  }

  /// The counts of stems.
  matching_funnel funnel() const {
    return {.source_stems = source.size() + source.coincident,
            .target_stems = target.size() + target.coincident,
            .source_coincident = source.coincident,
            .target_coincident = target.coincident};
  }
};

}  // namespace globalmatch::benchmarks
