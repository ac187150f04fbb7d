// Prior: what is known of the transform before stems are looked at. In: a Gaussian, in the frames of the
// caller. Out: which transforms between the levelled local frames it allows, and how likely it makes them.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/rigid.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/matching_options.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::detail {

/// Angle [rad] in (-pi, pi].
inline double wrapped(double angle) {
  return std::remainder(angle, 2 * std::numbers::pi);
}

/// Angle [rad] by which a rotation turns about the vertical.
inline double yaw_of(const mat3& r) {
  return std::atan2(r(1, 0) - r(0, 1), r(0, 0) + r(1, 1));
}

/// `transform_prior` between the levelled local frames.
class local_prior {
 public:
  local_prior(const transform_prior& given, const position_set& source, const position_set& target)
      : transform_(target.frame.local_from_scan() * from_eigen(given.target_from_source) *
                   source.frame.local_from_scan().inverse()),
        yaw_(yaw_of(transform_.rotation)) {
    double squares = 0;
    for (const vec3& p : source.at) center_ += p / double(source.size());
    for (const vec3& p : source.at) squares += (p - center_).xy().squared_norm() / double(source.size());
    // The stems, which the prior is compared with, say where and how they stand no better than this.
    constexpr double stem_sigma = 0.1;  // [m]
    sigma_position_ = std::hypot(given.sigma_position, stem_sigma);
    sigma_yaw_ = std::hypot(given.sigma_yaw, stem_sigma / std::max(std::sqrt(squares), stem_sigma));
    place_ = transform_ * center_;
    transform_ = {rotation_about_z(yaw_), {}};  // heights and tilts are free
    transform_.translation = place_ - transform_.rotation * center_;
  }

  /// The same with source and target exchanged.
  local_prior reversed() const {
    local_prior other = *this;
    other.reversed_ = !reversed_;
    return other;
  }

  /// The most probable transform.
  rigid transform() const { return reversed_ ? transform_.inverse() : transform_; }
  /// [rad] of it
  double yaw() const { return reversed_ ? -yaw_ : yaw_; }
  /// [rad] by which another one may be turned more
  double max_turn() const { return std::min(std::numbers::pi, max_sigmas * sigma_yaw_); }

  /// How a transform differs from the most probable one.
  prior_deviation deviation(const rigid& target_from_source) const {
    const rigid forward = reversed_ ? target_from_source.inverse() : target_from_source;
    const double distance = (forward * center_ - place_).xy().norm(),
                 turn = std::abs(wrapped(yaw_of(forward.rotation) - yaw_));
    return {distance, turn, std::hypot(distance / sigma_position_, turn / sigma_yaw_)};
  }

  /// Whether a transform is within four standard deviations.
  bool allows(const rigid& target_from_source) const {
    const prior_deviation d = deviation(target_from_source);
    return d.distance <= max_sigmas * sigma_position_ && d.turn <= max_turn();
  }

  /// Whether a transform that is allowed, and does not tilt, may place a source stem on a target stem, at
  /// these positions.
  bool may_place(const vec3& source, const vec3& target) const {
    const vec3 &from = reversed_ ? target : source, &to = reversed_ ? source : target;
    const double chord = 2 * std::sin(max_turn() / 2) * (from - center_).xy().norm();
    return (transform_ * from - to).xy().norm() <= max_sigmas * sigma_position_ + chord;
  }

  /// Whether of transforms that differ by a shift [m] along a lattice, or turn it onto itself, one at most is
  /// allowed.
  bool separates(double shift) const {
    return 2 * max_sigmas * sigma_position_ < shift && 2 * max_turn() < std::numbers::pi / 3;
  }

  /// [m^2] The integral of the Gaussian of the place over its largest value: places that are as probable as
  /// the most probable one would cover so much.
  double effective_area() const { return 2 * std::numbers::pi * sigma_position_ * sigma_position_; }
  /// The same of yaws, as a share of all.
  double effective_share_of_yaws() const {
    return std::min(1.0, sigma_yaw_ / std::sqrt(2 * std::numbers::pi));
  }

 private:
  static constexpr double max_sigmas = 4;

  rigid transform_;            // of the caller's source to the caller's target, about the vertical
  double yaw_ = 0;             // [rad] of it
  vec3 center_, place_;        // [m] centroid of the caller's source stems, and where the prior places it
  double sigma_position_ = 0;  // [m] along each axis, in plan
  double sigma_yaw_ = 0;       // [rad]
  bool reversed_ = false;      // transforms that are asked for lead from the caller's target to his source
};

}  // namespace globalmatch::detail
