// ICP, a small one ([GM] 3.3, after Besl and McKay 1992): fine registration, point to point or point to
// plane. In: samples of both scans and a coarse transform. Out: the refined transform. Parallel over points.
// Cost: iterations times n log n.
#pragma once

#include <Eigen/Geometry>

#include <stdexcept>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/compiled.hpp"
#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/rigid.hpp"
#include "globalmatch/detail/core/rigid_fit.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/icp_options.hpp"
#include "globalmatch/points.hpp"

namespace globalmatch {

namespace detail {

/// `refine_by_icp` in the internal representation. Layers that lack samples of a scan count for nothing.
/// `uncertainty`: where it is asked for.
GLOBALMATCH_INLINE icp_result refine_samples(std::vector<icp_samples> layers, const rigid& coarse,
                                             degrees_of_freedom dof, const icp_options& options,
                                             const execution& exec, icp_uncertainty* uncertainty = nullptr,
                                             build_mode = {});

/// The finite points of a range.
template <point_range R>
std::vector<vec3> finite_points(const R& points) {
  std::vector<vec3> result;
  for (const auto& p : points)
    if (const vec3 v = xyz(p); is_finite(v)) result.push_back(v);
  return result;
}

}  // namespace detail

/// Refines `coarse`, the transform target_from_source, over the layers; points that are not finite are
/// skipped. When fewer than six pairs are left `converged` is false and the transform the last good one.
/// 4-DoF turns about z, so both frames must be level. Throws `std::invalid_argument` for options that make no
/// sense, normals of some points only, and a coarse transform that is not finite.
inline icp_result refine_by_icp(const std::vector<icp_layer>& layers, const Eigen::Isometry3d& coarse,
                                degrees_of_freedom dof, const icp_options& options = {},
                                const execution& exec = {}) {
  // `like`: of points and their normals those go of which the other is not finite.
  const auto copy = [](const std::vector<Eigen::Vector3d>& points, const std::vector<Eigen::Vector3d>& like) {
    std::vector<detail::vec3> result;
    result.reserve(points.size());
    for (std::size_t i = 0; i < points.size(); ++i)
      if (is_finite(detail::from_eigen(points[i])) &&
          (like.empty() || is_finite(detail::from_eigen(like[i]))))
        result.push_back(detail::from_eigen(points[i]));
    return result;
  };
  std::vector<detail::icp_samples> samples;
  for (const icp_layer& l : layers) {
    const bool has_normals = !l.source_normals.empty() || !l.target_normals.empty();
    if (has_normals &&
        (l.source_normals.size() != l.source.size() || l.target_normals.size() != l.target.size()))
      throw std::invalid_argument("layers: normals must be given for all points of both scans, or for none");
    samples.push_back({copy(l.source, l.source_normals), copy(l.target, l.target_normals),
                       copy(l.source_normals, l.source), copy(l.target_normals, l.target)});
  }
  return detail::refine_samples(std::move(samples), detail::from_eigen(coarse), dof, options, exec);
}

/// The same over points of the caller's, as one layer; those that are not finite are skipped.
template <point_range Source, point_range Target>
icp_result refine_by_icp(const Source& source, const Target& target, const Eigen::Isometry3d& coarse,
                         degrees_of_freedom dof, const icp_options& options = {},
                         const execution& exec = {}) {
  std::vector<detail::icp_samples> layers(1);
  layers.front().source = detail::finite_points(source);
  layers.front().target = detail::finite_points(target);
  return detail::refine_samples(std::move(layers), detail::from_eigen(coarse), dof, options, exec);
}

}  // namespace globalmatch

#if !defined(GLOBALMATCH_COMPILED)
#include "globalmatch/detail/icp/refine_samples.hpp"
#endif
