// Rigid motion from correspondences by least squares ([GM] 3.3): six degrees of freedom, or four for levelled
// scans.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/SVD>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <stdexcept>

namespace globalmatch {

/// What a registration may do: 6-DoF rotates freely, 4-DoF only about the z axis (yaw), [GM] Eqs. (6) and
/// (7).
enum class degrees_of_freedom { four = 4, six = 6 };

/// Least squares motion that lays `source` [m] on `target` [m]; point i corresponds to point i with weight
/// `weights[i]` (all equal when empty). Nothing when the points do not determine it: fewer than two apart (in
/// plan, 4-DoF) or all on a line (6-DoF). Throws `std::invalid_argument` when the sizes differ.
inline std::optional<Eigen::Isometry3d> fit_transform(std::span<const Eigen::Vector3d> source,
                                                      std::span<const Eigen::Vector3d> target,
                                                      degrees_of_freedom dof,
                                                      std::span<const double> weights = {}) {
  if (source.size() != target.size() || (!weights.empty() && weights.size() != source.size()))
    throw std::invalid_argument("fit_transform: source, target and weights differ in size");
  const auto weight = [&](std::size_t i) { return weights.empty() ? 1.0 : weights[i]; };
  double sum = 0;
  Eigen::Vector3d source_mean = Eigen::Vector3d::Zero(), target_mean = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < source.size(); ++i) {
    sum += weight(i);
    source_mean += weight(i) * source[i];
    target_mean += weight(i) * target[i];
  }
  if (!(sum > 0)) return std::nullopt;
  source_mean /= sum;
  target_mean /= sum;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < source.size(); ++i)
    covariance += weight(i) * (source[i] - source_mean) * (target[i] - target_mean).transpose();

  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  constexpr double negligible = 1e-12;
  if (dof == degrees_of_freedom::four) {
    const double cosine = covariance(0, 0) + covariance(1, 1), sine = covariance(0, 1) - covariance(1, 0);
    if (std::hypot(cosine, sine) <= negligible * sum) return std::nullopt;
    transform.linear() =
        Eigen::AngleAxisd(std::atan2(sine, cosine), Eigen::Vector3d::UnitZ()).toRotationMatrix();
  } else {  // Sorkine-Hornung and Rabinovich 2017, Least-squares rigid motion using SVD
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
    if (svd.singularValues()(1) <= negligible * std::max(sum, svd.singularValues()(0))) return std::nullopt;
    const Eigen::Matrix3d v = svd.matrixV(), u = svd.matrixU();
    const double handedness = (v * u.transpose()).determinant() < 0 ? -1 : 1;
    transform.linear() = v * Eigen::Vector3d(1, 1, handedness).asDiagonal() * u.transpose();
  }
  transform.translation() = target_mean - transform.linear() * source_mean;
  return transform;
}

}  // namespace globalmatch
