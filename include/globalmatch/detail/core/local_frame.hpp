// A levelled frame near the points of a scan.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <stdexcept>

namespace globalmatch::detail {

/// A levelled frame near the points: its z axis is `up`. For `up` = +z it only shifts, so that coordinates
/// stay exact.
struct local_frame {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< [m] in the frame of the scan
  Eigen::Matrix3d local_from_scan_rotation = Eigen::Matrix3d::Identity();

  Eigen::Vector3d to_local(const Eigen::Vector3d& p) const {
    return is_level() ? Eigen::Vector3d(p - origin)
                      : Eigen::Vector3d(local_from_scan_rotation * (p - origin));
  }
  bool is_level() const { return local_from_scan_rotation(2, 2) == 1; }  ///< it only shifts
  Eigen::Vector3d to_scan(const Eigen::Vector3d& p) const {
    return local_from_scan_rotation.transpose() * p + origin;
  }
  Eigen::Isometry3d local_from_scan() const {
    Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
    transform.linear() = local_from_scan_rotation;
    transform.translation() = -(local_from_scan_rotation * origin);
    return transform;
  }
};

/// Rotation that turns `up` into +z, by the shortest way. Throws `std::invalid_argument` when `up` is zero or
/// not finite.
inline Eigen::Matrix3d levelling_rotation(const Eigen::Vector3d& up) {
  if (!up.allFinite() || !(up.stableNorm() > 0))
    throw std::invalid_argument("up must be a finite vector other than zero");
  const Eigen::Vector3d u = up.stableNormalized();
  if (u.x() == 0 && u.y() == 0)  // straight up, or upside down: a half turn about x
    return Eigen::Vector3d(1, u.z(), u.z()).asDiagonal();
  // Rodrigues' formula about u x z; its limit for u = -z is any half turn
  const double f = u.z() > 0 ? 1 / (1 + u.z()) : (1 - u.z()) / (u.x() * u.x() + u.y() * u.y());
  Eigen::Matrix3d rotation;
  rotation << 1 - f * u.x() * u.x(), -f * u.x() * u.y(), -u.x(),  //
      -f * u.x() * u.y(), 1 - f * u.y() * u.y(), -u.y(),          //
      u.x(), u.y(), u.z();
  return rotation;
}

}  // namespace globalmatch::detail
