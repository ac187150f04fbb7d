// Rigid transform from correspondences by least squares ([GM] 3.3): six degrees of freedom, or four for
// levelled scans.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <stdexcept>
#include <vector>

#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/rigid_fit.hpp"

namespace globalmatch {

/// Least squares transform of `source` [m] onto `target` [m]; point i corresponds to point i with weight
/// `weights[i]` (all equal when empty). Nothing when the points do not determine it: fewer than two apart
/// (horizontally, 4-DoF) or all on a line (6-DoF). Throws `std::invalid_argument` when the sizes differ,
/// a coordinate is not finite, or a weight is negative or not finite.
inline std::optional<Eigen::Isometry3d> fit_transform(std::span<const Eigen::Vector3d> source,
                                                      std::span<const Eigen::Vector3d> target,
                                                      degrees_of_freedom dof,
                                                      std::span<const double> weights = {}) {
  if (source.size() != target.size() || (!weights.empty() && weights.size() != source.size()))
    throw std::invalid_argument("fit_transform: source, target and weights differ in size");
  std::vector<detail::vec3> from, to;
  for (const Eigen::Vector3d& p : source) from.push_back(detail::from_eigen(p));
  for (const Eigen::Vector3d& p : target) to.push_back(detail::from_eigen(p));
  const auto finite = [](const detail::vec3& p) { return is_finite(p); };
  if (!std::all_of(from.begin(), from.end(), finite) || !std::all_of(to.begin(), to.end(), finite))
    throw std::invalid_argument(
        "fit_transform: a coordinate of source or target is not finite; remove the point");
  if (!std::all_of(weights.begin(), weights.end(), [](double w) { return w >= 0 && std::isfinite(w); }))
    throw std::invalid_argument("fit_transform: weights must not be negative, and finite");
  const auto transform = detail::fit_rigid(from, to, dof, weights);
  if (!transform) return std::nullopt;
  return detail::to_eigen(*transform);
}

}  // namespace globalmatch
