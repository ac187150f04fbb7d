// What a registration takes and returns ([GM] 3).
#pragma once

#include <Eigen/Geometry>

#include <optional>
#include <string>

#include "globalmatch/icp_options.hpp"
#include "globalmatch/mapping_options.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/matching_options.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch {

/// Options of `register_scans` and `register_maps`.
struct registration_options {
  mapping_options mapping = {};
  matching_options matching = {};
  icp_options icp = {};
};

/// The values of the paper, for scans of some thirty million points, where the defaults come from the data at
/// hand.
inline registration_options paper_options() {
  registration_options options;
  options.mapping.understory = {.min_height = 0.2, .max_height = 3.0};
  options.mapping.ground.filter = ground_filter::cloth;
  options.mapping.rule = stem_point_rule::points;
  options.mapping.vertical = vertical_rule::given;
  options.mapping.voxel_size = 0.01;
  options.mapping.verticality.radius = 0.10;
  options.mapping.verticality.threshold = 0.9;
  options.mapping.stems.cylinder.usual_taper.reset();
  options.mapping.min_quality = 0;
  options.matching.triangles.neighbors = 20;
  options.matching.inlier_threshold = 0.05;
  options.matching.proposal = proposal::algorithm_1;
  options.matching.dof = degrees_of_freedom::four;
  options.icp.metric = icp_metric::point_to_point;
  return options;
}

/// What came of a registration, with the evidence to trust or reject it.
struct registration {
  globalmatch::outcome outcome = outcome::not_registered;
  std::string reason;                                   ///< empty when registered
  std::optional<Eigen::Isometry3d> target_from_source;  ///< only when registered; refined unless ICP is off
  globalmatch::matching matching;                       ///< holds the coarse transform
  std::optional<icp_result> icp;                        ///< when it ran
  bool refined = false;                                 ///< `target_from_source` is that of ICP
};

/// What `register_scans` returns: both maps, and how they are registered.
struct scan_registration {
  stem_map source, target;
  globalmatch::registration registration;
};

}  // namespace globalmatch
