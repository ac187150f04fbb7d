// The rigid transform that fits corresponding points best ([GM] 3.3).
#pragma once

#include <cmath>
#include <cstddef>
#include <optional>
#include <span>

#include "globalmatch/detail/core/decompositions.hpp"
#include "globalmatch/detail/core/rigid.hpp"

namespace globalmatch {

/// What a registration may do: 6-DoF rotates freely, 4-DoF only about the z axis (yaw), [GM] Eqs. (6) and
/// (7).
enum class degrees_of_freedom { four = 4, six = 6 };

namespace detail {

/// Least squares transform of `source` [m] onto `target` [m]; point i corresponds to point i with weight
/// `weights[i]` (all equal when empty). Nothing when the points do not determine it: fewer than two apart
/// (horizontally, 4-DoF) or all on a line (6-DoF). All sizes are equal.
inline std::optional<rigid> fit_rigid(std::span<const vec3> source, std::span<const vec3> target,
                                      degrees_of_freedom dof, std::span<const double> weights = {}) {
  constexpr double negligible = 1e-12;
  const auto weight = [&](std::size_t i) { return weights.empty() ? 1.0 : weights[i]; };
  double sum = 0;
  vec3 source_mean, target_mean;
  for (std::size_t i = 0; i < source.size(); ++i) {
    const double w = weight(i);
    sum += w;
    source_mean += w * source[i];
    target_mean += w * target[i];
  }
  if (!(sum > 0)) return std::nullopt;
  source_mean /= sum;
  target_mean /= sum;
  mat3 covariance;
  for (std::size_t i = 0; i < source.size(); ++i)
    covariance += outer(weight(i) * (source[i] - source_mean), target[i] - target_mean);
  rigid transform;
  if (dof == degrees_of_freedom::four) {
    const double cosine = covariance(0, 0) + covariance(1, 1), sine = covariance(0, 1) - covariance(1, 0);
    if (std::hypot(cosine, sine) <= negligible * sum) return std::nullopt;
    transform.rotation = rotation_about_z(std::atan2(sine, cosine));
  } else {
    const rotation_of_covariance best(covariance);
    const double largest = best.singular_values.x > sum ? best.singular_values.x : sum;
    if (best.singular_values.y <= negligible * largest) return std::nullopt;
    transform.rotation = best.rotation;
  }
  transform.translation = target_mean - transform.rotation * source_mean;
  return transform;
}

}  // namespace detail
}  // namespace globalmatch
