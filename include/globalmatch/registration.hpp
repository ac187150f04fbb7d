// Registration ([GM] 3): two stem maps, or two scans, -> the motion that lays the source on the target.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/local_frame.hpp"
#include "globalmatch/detail/mapping/funnel.hpp"
#include "globalmatch/detail/matching/decision.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/icp.hpp"
#include "globalmatch/mapping_options.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/matching_options.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/positions.hpp"
#include "globalmatch/stem_map.hpp"
#include "globalmatch/stem_mapping.hpp"
#include "globalmatch/stem_matching.hpp"
#include "globalmatch/transform.hpp"

namespace globalmatch {

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
  globalmatch::matching matching;                       ///< holds the coarse motion
  std::optional<icp_result> icp;                        ///< when it ran
};

struct scan_registration {
  stem_map source, target;
  globalmatch::registration registration;
};

namespace detail {

/// Where the stems of the map were lost that has too few, for the reason of the decision; empty where both
/// have enough.
inline std::string describe_lost_stems(const stem_map& source, const stem_map& target, std::size_t minimum) {
  for (const auto& [map, name] : {std::pair(&source, "source"), std::pair(&target, "target")})
    if (const std::string lost = detail::where_lost(explain(map->funnel), minimum); !lost.empty())
      return std::string(". ") + name + ", " + lost;
  return "";
}

/// Which of the scans were not level, for the reason of the decision; empty where both were, or the motion is
/// free to tilt.
inline std::string describe_tilted_maps(const stem_map& source, const stem_map& target,
                                        degrees_of_freedom dof) {
  std::string remark;
  if (dof == degrees_of_freedom::six) return remark;
  for (const auto& [map, name] : {std::pair(&source, "source"), std::pair(&target, "target")})
    if (is_tilted(*map)) remark += std::string(". The stems of ") + name + " " + describe_tilt(*map);
  return remark;
}

/// Near the terrain's, with the vertical of the map.
inline detail::local_frame levelled_frame(const stem_map& map) {
  return {map.terrain.frame.origin, detail::levelling_rotation(map.up)};
}
inline std::vector<Eigen::Vector3d> levelled(const std::vector<Eigen::Vector3d>& points,
                                             const detail::local_frame& frame) {
  std::vector<Eigen::Vector3d> local;
  local.reserve(points.size());
  for (const Eigen::Vector3d& p : points) local.push_back(frame.to_local(p));
  return local;
}
inline std::vector<Eigen::Vector3d> levelled_normals(const stem_map& map, const detail::local_frame& frame) {
  std::vector<Eigen::Vector3d> local;
  local.reserve(map.stem_normals.size());
  for (const Eigen::Vector3d& n : map.stem_normals) local.push_back(frame.local_from_scan_rotation * n);
  return local;
}

/// ICP over the samples of both maps, in their levelled frames: ground on ground, stems on stems. It turns
/// freely where a vertical is the stems', which is good to some tenths of a degree.
inline icp_result refine_by_samples(const stem_map& source, const stem_map& target,
                                    const Eigen::Isometry3d& coarse, degrees_of_freedom dof,
                                    const icp_options& options, const execution& exec) {
  const detail::local_frame from = levelled_frame(source), to = levelled_frame(target);
  std::vector<icp_layer> layers = {
      {levelled(source.ground_samples, from), levelled(target.ground_samples, to)},
      {levelled(source.stem_samples, from), levelled(target.stem_samples, to)}};
  const auto have_normals = [](const stem_map& m) { return m.stem_normals.size() == m.stem_samples.size(); };
  if (have_normals(source) && have_normals(target)) {
    layers.back().source_normals = levelled_normals(source, from);
    layers.back().target_normals = levelled_normals(target, to);
  }
  const Eigen::Isometry3d source_local = from.local_from_scan(), target_local = to.local_from_scan();
  if (source.up_by_stems || target.up_by_stems) dof = degrees_of_freedom::six;
  icp_result result =
      refine_by_icp(std::move(layers), target_local * coarse * source_local.inverse(), dof, options, exec);
  result.target_from_source = target_local.inverse() * result.target_from_source * source_local;
  return result;
}
}  // namespace detail

/// Registers two mapped scans: match their stems, then refine by ICP over ground and stem samples. An ICP
/// that does not converge leaves the coarse motion. Where a map took its vertical from its stems, ICP turns
/// freely, whatever the degrees of freedom. Throws `std::invalid_argument` naming a bad option.
inline registration register_maps(const stem_map& source, const stem_map& target,
                                  const registration_options& options = {}, const execution& exec = {}) {
  require_valid(options.icp);
  registration result;
  if (source.cancelled || target.cancelled) {
    result.outcome = outcome::cancelled;
    result.reason = operation_cancelled().what();
    return result;
  }
  try {
    result.matching =
        detail::match_positions(import_positions(source.stems, source.up, "source", exec),
                        import_positions(target.stems, target.up, "target", exec), options.matching, exec);
    result.outcome = result.matching.outcome;
    const auto minimum = std::size_t(options.matching.decision.min_correspondences);
    if (std::min(source.stems.size(), target.stems.size()) < minimum)
      result.matching.reason += detail::describe_lost_stems(source, target, minimum);
    if (result.outcome != outcome::registered)
      result.matching.reason += detail::describe_tilted_maps(source, target, options.matching.dof);
    result.reason = result.matching.reason;
    result.target_from_source = result.matching.target_from_source;
    if (result.outcome == outcome::registered && options.icp.metric != icp_metric::none) {
      result.icp = detail::refine_by_samples(source, target, *result.target_from_source, options.matching.dof,
                                             options.icp, exec);
      if (result.icp->converged) result.target_from_source = result.icp->target_from_source;
    }
  } catch (const operation_cancelled& e) {
    result.outcome = outcome::cancelled;
    result.reason = e.what();
    result.target_from_source.reset();
  }
  return result;
}

/// Registers two scans: map the stems of each, then `register_maps`. `up` points away from the ground in both
/// frames.
template <point_range Source, point_range Target>
scan_registration register_scans(const Source& source, const Target& target,
                                 const registration_options& options = {},
                                 const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ(),
                                 const execution& exec = {}) {
  require_valid(options.matching);
  require_valid(options.icp);
  scan_registration result;
  result.source = map_stems(source, options.mapping, up, exec);
  if (result.source.cancelled)
    result.target.cancelled = true;
  else
    result.target = map_stems(target, options.mapping, up, exec);
  result.registration = register_maps(result.source, result.target, options, exec);
  return result;
}
}  // namespace globalmatch
