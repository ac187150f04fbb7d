// Registration ([GM] 3): two stem maps, or two scans, -> the transform of the source to the target.
#pragma once

#include <Eigen/Core>

#include "globalmatch/detail/core/compiled.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/icp.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/registration_options.hpp"
#include "globalmatch/stem_map.hpp"
#include "globalmatch/stem_mapping.hpp"
#include "globalmatch/stem_matching.hpp"

namespace globalmatch {

namespace detail {
/// For `register_maps`.
GLOBALMATCH_INLINE registration register_stem_maps(const stem_map& source, const stem_map& target,
                                                   const registration_options& options, const execution& exec,
                                                   build_mode = {});
}  // namespace detail

/// Registers two mapped scans: match their stems, then refine by ICP over ground and stem samples. An ICP
/// that does not converge, or moves further in plan than the stems allow, leaves the coarse transform. Where
/// a map took its vertical from its stems, ICP turns freely, whatever the degrees of freedom. Throws
/// `std::invalid_argument` naming a bad option.
inline registration register_maps(const stem_map& source, const stem_map& target,
                                  const registration_options& options = {}, const execution& exec = {}) {
  return detail::register_stem_maps(source, target, options, exec);
}

/// Registers two scans: map the stems of each, then `register_maps`. `up` points away from the ground in both
/// frames.
template <point_range Source, point_range Target>
scan_registration register_scans(const Source& source, const Target& target,
                                 const registration_options& options = {},
                                 const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ(),
                                 const execution& exec = {}) {
  require_valid(options.matching);
  detail::require_own_scale(options.matching);
  require_valid(options.icp);
  const detail::parallel_scope scope(exec, "registration");
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

#if !defined(GLOBALMATCH_COMPILED)
#include "globalmatch/detail/verbs/register_stem_maps.hpp"
#endif
