// Uncertainties of poses about other places, in other frames, and between poses.
#pragma once

#include <Eigen/Geometry>

#include <stdexcept>

#include "globalmatch/matching.hpp"

namespace globalmatch::detail {

/// Throws `std::invalid_argument` for a covariance that is not 4 x 4.
inline void require_four_rows(const transform_uncertainty& u) {
  if (u.covariance.rows() != 4 || u.covariance.cols() != 4)
    throw std::invalid_argument("uncertainty: the covariance of a pair must be 4 x 4");
}

/// The same 4 x 4 uncertainty about another center [m].
inline transform_uncertainty about(const transform_uncertainty& u, const Eigen::Vector3d& center) {
  Eigen::Matrix4d there = Eigen::Matrix4d::Identity();
  there.topRightCorner<3, 1>() = u.up.cross(center - u.center);
  transform_uncertainty result{center, u.up, {}};
  result.covariance = there * Eigen::Matrix4d(u.covariance) * there.transpose();
  return result;
}

/// The same 4 x 4 uncertainty in another frame.
inline transform_uncertainty in_frame(const transform_uncertainty& u, const Eigen::Isometry3d& frame) {
  Eigen::Matrix4d turned = Eigen::Matrix4d::Identity();
  turned.topLeftCorner<3, 3>() = frame.linear();
  transform_uncertainty result{frame * u.center, frame.linear() * u.up, {}};
  result.covariance = turned * Eigen::Matrix4d(u.covariance) * turned.transpose();
  return result;
}

/// That of two independent 4 x 4 ones, about the center of the first one.
inline transform_uncertainty sum_of(const transform_uncertainty& a, const transform_uncertainty& b) {
  transform_uncertainty result = a;
  result.covariance += about(b, a.center).covariance;
  return result;
}

/// Variances [m^2] of a place along one horizontal axis and along the vertical.
struct place_variance {
  double horizontal, height;

  place_variance(const transform_uncertainty& u, const Eigen::Vector3d& place) {
    const Eigen::Matrix3d there = u.at(place);
    height = u.up.dot(there * u.up);
    horizontal = (there.trace() - height) / 2;
  }
};

}  // namespace globalmatch::detail
