// Uncertainty: how far off may the motion be? In: a hypothesis. Out: the covariance of its motion, from how
// badly its stems meet and how they lie.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <vector>

#include "globalmatch/detail/core/local_frame.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/detail/matching/robust_fit.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/transform.hpp"

namespace globalmatch::detail {

/// Variance of Student's t.
inline double variance_of_t(double degrees) {
  return degrees / (degrees - 2);
}

/// Shift and turn from residuals: the inverse of the normal matrix, times the variance that these leave.
class residual_adjustment {
 public:
  using normal_matrix = transform_uncertainty::small_matrix<6, 6>;
  using derivative_matrix = transform_uncertainty::small_matrix<3, 6>;
  using residual_vector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 3, 1>;

  explicit residual_adjustment(Eigen::Index unknowns) { normal_.setZero(unknowns, unknowns); }

  /// Misfits whose variance [m^2] is as given, but for one factor.
  void add(const derivative_matrix& derivative, const residual_vector& residual, double variance) {
    normal_ += derivative.transpose() * derivative / variance;
    squares_ += residual.squaredNorm() / variance;
    coordinates_ += double(residual.size());
  }

  normal_matrix covariance() const {
    constexpr double efficiency = 0.95;  // of the robust weights, see `robust_weights`
    const double degrees = coordinates_ - double(normal_.rows());
    return variance_of_t(degrees) * squares_ / (efficiency * degrees) *
           normal_.ldlt().solve(normal_matrix::Identity(normal_.rows(), normal_.rows()));
  }

 private:
  normal_matrix normal_;
  double squares_ = 0, coordinates_ = 0;
};

/// Variance [m^2] of the height in 4-DoF, a median.
inline double variance_of_height(const hypothesis& h, const matching_context& context) {
  const double median_of_normal = std::numbers::pi / 2;  // its variance, against that of the mean
  const double count = double(h.correspondences.size());
  double squares = 0;
  for (const correspondence& c : h.correspondences)
    squares +=
        std::pow((h.target_from_source * context.source.at[c.source] - context.target.at[c.target]).z(), 2);
  return median_of_normal * variance_of_t(count - 1) * squares / (count - 1) / count;
}

/// Uncertainty of a hypothesis' motion, least squares over its pairs, in the frames of `context`; residuals
/// are taken for independent, and as large as `position_sigma` tells, but for one factor, or alike. The
/// height of 4-DoF has that of a median; 0 where a map has no heights. Nothing for fewer than four pairs.
/// Cost: linear in the pairs.
inline std::optional<transform_uncertainty> uncertainty_of(const hypothesis& h,
                                                           const matching_context& context) {
  constexpr std::size_t minimum = 4;
  if (h.correspondences.size() < minimum) return std::nullopt;
  const bool four = context.dof == degrees_of_freedom::four;
  transform_uncertainty result;
  result.covariance.setZero(four ? 4 : 6, four ? 4 : 6);
  for (const correspondence& c : h.correspondences)
    result.center += h.target_from_source * context.source.at[c.source] / double(h.correspondences.size());
  const double unknown = unknown_variance(context, h);
  // In 4-DoF the height has nothing to do with the rest.
  const std::vector<int> unknowns = four ? std::vector{0, 1, 3} : std::vector{0, 1, 2, 3, 4, 5};
  const auto coordinates = Eigen::seqN(0, four ? 2 : 3);
  residual_adjustment adjustment(Eigen::Index(unknowns.size()));
  std::size_t adjusted = 0;
  for (const correspondence& c : h.correspondences) {
    context.poll_cancelled_at(adjusted++);
    const Eigen::Vector3d transformed = h.target_from_source * context.source.at[c.source];
    adjustment.add(result.derivative(transformed)(coordinates, unknowns),
                   (context.target.at[c.target] - transformed)(coordinates),
                   known_variance(context, c) + unknown);
  }
  result.covariance(unknowns, unknowns) = adjustment.covariance();
  if (four && context.source.has_heights && context.target.has_heights)
    result.covariance(2, 2) = variance_of_height(h, context);
  return result;
}

/// From a levelled local frame to that of its caller.
inline transform_uncertainty in_caller_frame(transform_uncertainty u, const local_frame& frame) {
  const Eigen::Matrix3d scan_from_local = frame.local_from_scan_rotation.transpose();
  u.center = frame.to_scan(u.center);
  u.up = scan_from_local * u.up;
  Eigen::MatrixXd turned = Eigen::MatrixXd::Identity(u.covariance.rows(), u.covariance.rows());
  turned.topLeftCorner<3, 3>() = scan_from_local;
  if (u.covariance.rows() == 6) turned.bottomRightCorner<3, 3>() = scan_from_local;
  u.covariance = (turned * u.covariance * turned.transpose()).eval();
  return u;
}

}  // namespace globalmatch::detail
