// The steps of registering two stem maps composed: match the stems, find the height by the ground that both
// scans see, refine by ICP.
#pragma once

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/compiled.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/matching/scan_views.hpp"
#include "globalmatch/detail/matching/uncertainty.hpp"
#include "globalmatch/detail/verbs/refine_by_samples.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/icp.hpp"
#include "globalmatch/mapping_options.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/matching_options.hpp"
#include "globalmatch/positions.hpp"
#include "globalmatch/registration_options.hpp"
#include "globalmatch/stem_map.hpp"
#include "globalmatch/stem_matching.hpp"

namespace globalmatch::detail {

/// Where the stems of the map were lost that has too few, for the reason of the decision; empty where both
/// have enough.
inline std::string describe_lost_stems(const stem_map& source, const stem_map& target, std::size_t minimum) {
  for (const auto& [map, name] : {std::pair(&source, "source"), std::pair(&target, "target")})
    if (const std::string lost = where_lost(explain(map->funnel), minimum); !lost.empty())
      return std::string(". ") + name + ", " + lost;
  return "";
}

/// Which of the scans were not level, for the reason of the decision; empty where both were, or the transform
/// may tilt.
inline std::string describe_tilted_maps(const stem_map& source, const stem_map& target,
                                        std::optional<degrees_of_freedom> dof) {
  std::string remark;
  if (dof != degrees_of_freedom::four) return remark;
  for (const auto& [map, name] : {std::pair(&source, "source"), std::pair(&target, "target")})
    if (is_tilted(*map)) remark += std::string(". The stems of ") + name + " " + describe_tilt(*map);
  return remark;
}

/// Of which scans it is not known what their scanners saw, for the reason of the decision; empty where it is,
/// or where the maps are not of scans.
inline std::string describe_unseen_maps(const stem_map& source, const stem_map& target) {
  std::string remark;
  for (const auto& [map, name] : {std::pair(&source, "source"), std::pair(&target, "target")})
    if (map->funnel.stems > 0 && map->visible.empty())
      remark += std::string(". What the scanner of ") + name +
                " saw is not used: it is not known where it stood (option `scanner`), it moved, or too few "
                "stems show it";
  return remark;
}

/// Why six degrees of freedom cannot be had of two maps: no heights differ in one of them; empty where they
/// can, or are not asked for.
inline std::string describe_flat_maps(const position_set& source, const position_set& target,
                                      std::optional<degrees_of_freedom> dof) {
  if (dof != degrees_of_freedom::six || (source.has_heights && target.has_heights)) return "";
  return std::string(source.has_heights ? "target" : "source") +
         ": its stems all have the same height; six degrees of freedom need heights that differ, four do not";
}

/// Matches the stems of two maps. Where they are not registered, the reason says where stems were lost and
/// which scan was not level.
inline matching match_maps(const stem_map& source, const stem_map& target, const matching_options& options,
                           const execution& exec) {
  position_set from = import_positions(source.stems, source.up, "source", exec),
               to = import_positions(target.stems, target.up, "target", exec);
  matching result;
  result.reason = describe_flat_maps(from, to, options.dof);
  if (!result.reason.empty()) return result;
  const scan_views views = {{&source.visible, &source.terrain}, {&target.visible, &target.terrain}};
  result = match_positions(std::move(from), std::move(to), options, exec, &views);
  const auto minimum = std::size_t(options.decision.min_correspondences);
  if (std::min(source.stems.size(), target.stems.size()) < minimum)
    result.reason += describe_lost_stems(source, target, minimum);
  if (result.outcome != outcome::registered)
    result.reason += describe_tilted_maps(source, target, options.dof) + describe_unseen_maps(source, target);
  return result;
}

/// Leaves the height of a registration unknown: that of the transform is a guess.
inline void forget_height(matching& result, std::string reason) {
  result.vertical->source = vertical_source::none;
  result.vertical->sigma = std::numeric_limits<double>::infinity();
  result.vertical->reason = std::move(reason);
  if (result.uncertainty) set_height_variance(*result.uncertainty, height_variance(*result.vertical));
}

/// Moves the registration to the height at which the ground that both scans see coincides. Where too little
/// is seen by both the heights of the stems stay, unless the ground of a scan was cut off.
inline void use_ground(const stem_map& source, const stem_map& target, matching& result) {
  if (std::string reason = why_without_ground(source, target); !reason.empty())
    return forget_height(result, std::move(reason));
  const auto found = offset_of_ground(source, target, *result.target_from_source);
  if (!found) {
    if (source.terrain.cut_off || target.terrain.cut_off)
      forget_height(result,
                    "the ground was cut off; both scans show none of it at one place, and the height of the "
                    "transform is a guess");
    return;
  }
  const Eigen::Vector3d shift = found->offset * target.up;
  for (Eigen::Isometry3d* moved :
       {&*result.target_from_source, &result.hypotheses.front().target_from_source})
    moved->pretranslate(shift);
  result.vertical->source = vertical_source::ground;
  result.vertical->sigma = found->sigma;
  result.vertical->reason.clear();
  if (!result.uncertainty) return;
  result.uncertainty->center += shift;
  set_height_variance(*result.uncertainty, height_variance(*result.vertical));
}

/// Gives the transform of ICP the height of the coarse one at the stems where that is a guess, or where ICP
/// changes it by more than three of its standard deviations.
inline void keep_height(registration& result, const Eigen::Vector3d& up) {
  constexpr double deviations = 3;
  const Eigen::Isometry3d moved = result.icp->target_from_source * result.target_from_source->inverse();
  const auto& u = result.matching.uncertainty;
  const Eigen::Vector3d center = u ? u->center : Eigen::Vector3d(result.target_from_source->translation());
  const double change = (moved * center - center).dot(up);
  const vertical_fit& vertical = *result.matching.vertical;
  if (vertical.is_known() && std::abs(change) <= deviations * vertical.sigma) return;
  result.icp->target_from_source.pretranslate(-change * up);
}

GLOBALMATCH_INLINE registration register_stem_maps(const stem_map& source, const stem_map& target,
                                                   const registration_options& options, const execution& exec,
                                                   build_mode) {
  require_valid(options.icp);
  require_valid(options.matching);
  require_own_scale(options.matching);
  registration result;
  try {
    if (source.cancelled || target.cancelled) throw operation_cancelled();
    const parallel_scope scope(exec, "matching");
    result.matching = match_maps(source, target, options.matching, exec);
    if (result.matching.outcome == outcome::registered && !options.matching.horizontal)
      use_ground(source, target, result.matching);
    result.outcome = result.matching.outcome;
    result.reason = result.matching.reason;
    result.target_from_source = result.matching.target_from_source;
    if (result.outcome != outcome::registered || options.icp.metric == icp_metric::none) return result;
    const bool rotates = result.matching.vertical->kind == vertical_kind::rotated;
    result.icp = refine_by_samples(source, target, *result.target_from_source,
                                   rotates ? degrees_of_freedom::six : degrees_of_freedom::four,
                                   result.matching.vertical->is_known(), options.icp, exec);
    keep_height(result, target.up);
    result.refined =
        result.icp->converged &&
        moves_within(result.matching.uncertainty, *result.target_from_source, result.icp->target_from_source);
    if (result.refined) result.target_from_source = result.icp->target_from_source;
  } catch (const operation_cancelled& e) {
    result.outcome = outcome::cancelled;
    result.reason = e.what();
    result.target_from_source.reset();
  }
  return result;
}

}  // namespace globalmatch::detail
