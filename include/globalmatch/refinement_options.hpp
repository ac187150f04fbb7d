// What the refinement of a survey takes and returns: options, pairs of scans, what their samples say.
#pragma once

#include <Eigen/Geometry>

#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

#include "globalmatch/icp_options.hpp"
#include "globalmatch/matching.hpp"

namespace globalmatch {

/// Options of the refinement of a survey by the samples of its maps.
struct refinement_options {
  /// More points make poses no better: simulated scans (docs/records/surveys.md).
  icp_options icp = {.max_points = 5000};
  /// Each scan is refined with so many that have most trees in common with it (ours).
  std::size_t pairs_per_scan = 3;
  /// Scans whose maps hold no samples, as those of a census: there are no pairs with them.
  std::vector<std::size_t> without_samples = {};
};

/// Throws `std::invalid_argument` naming the field that makes no sense.
inline void require_valid(const refinement_options& options) {
  require_valid(options.icp);
  if (options.pairs_per_scan < 1) throw std::invalid_argument("pairs_per_scan must be at least 1");
}

/// Two scans of a survey, and how they are placed before their refinement.
struct pair_to_refine {
  std::size_t source = 0, target = 0;                                    ///< numbers of their maps
  Eigen::Isometry3d target_from_source = Eigen::Isometry3d::Identity();  ///< by their poses
  /// 4 x 4, in the frame of the target, halfway between the stems of both.
  transform_uncertainty uncertainty = {};
  bool is_height_known = false;  ///< else that of the transform is a guess
};

/// What the samples of two scans say of the transform between them.
struct refined_pair {
  pair_to_refine start = {};  ///< what it began with
  Eigen::Isometry3d target_from_source =
      Eigen::Isometry3d::Identity();  ///< as at the start where not refined
  /// 4 x 4, in the frame of the target, about the centroid of the samples in common.
  transform_uncertainty uncertainty = {};
  bool is_refined = false;         ///< shift and turn in plan are those of ICP
  bool is_height_refined = false;  ///< the height is that of the ground that both see
  /// [rad] About any horizontal axis, where ICP turned freely because a vertical is that of stems; else 0.
  double tilt_sigma = 0;
  std::size_t samples = 0;  ///< pairs of samples in the last iteration of ICP
  double rms = 0;           ///< [m] of these pairs
  std::string reason = {};  ///< why something was not refined; empty where all was
  /// A text of the caller's, by which it knows whether this is still that of its maps and options.
  std::string provenance = {};
};

}  // namespace globalmatch
