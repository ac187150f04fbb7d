// Stems of two scans that meet but for noise, matched: what an uncertainty is measured by.
#pragma once

#include <Eigen/Geometry>

#include <cstddef>
#include <optional>

#include "globalmatch/detail/core/random.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/detail/matching/uncertainty.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/positions.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::scenes {

using namespace detail;

/// So many stems on 30 m by 20 m, and their least squares transform.
struct noisy_match {
  position_set source, target;
  transform_of_scene truth;
  matching_context maps;
  local_hypothesis best;

  noisy_match(std::size_t stems, degrees_of_freedom dof, double sigma, random_source& random)
      : source(set_in_order(random_stems(random, stems, 30, 20))),
        truth(random_levelled_transform(random)),
        maps(source, target, false, dof) {
    target = set_in_order(noisy(moved(truth, source.at), sigma, random));
    for (stem_index i = 0; i < stems; ++i) best.correspondences.push_back({i, i});
    best.target_from_source = *maps.fit(best.correspondences);
    best.inlier_threshold = 100 * sigma;
  }

  /// What leads from the estimate to the truth.
  Eigen::Isometry3d error() const { return truth * to_eigen(best.target_from_source.inverse()); }
};

/// The uncertainty as a caller gets it, whose frame is the levelled one.
inline std::optional<transform_uncertainty> reported_uncertainty(noisy_match& match) {
  local_vertical_fit vertical;
  if (match.maps.dof == degrees_of_freedom::four) vertical = fit_vertical(match.best, match.maps, false);
  const auto local = uncertainty_of(match.best, match.maps, vertical);
  if (!local) return std::nullopt;
  return in_caller_frame(*local, {});
}

}  // namespace globalmatch::scenes
