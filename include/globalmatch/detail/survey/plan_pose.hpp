// Poses in plan: a turn about the vertical, and a shift.
#pragma once

#include <cmath>

#include "globalmatch/detail/core/rigid.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/detail/matching/prior.hpp"

namespace globalmatch::detail {

/// A vector turned by a quarter, counter-clockwise: the derivative of turning it.
constexpr vec2 quarter_turned(const vec2& v) {
  return {-v.y, v.x};
}

/// Turn [rad], then shift [m], of the horizontal coordinates of a levelled local frame.
struct plan_pose {
  vec2 shift = {0, 0};
  double yaw = 0;

  vec2 turned(const vec2& v) const {
    const double cosine = std::cos(yaw), sine = std::sin(yaw);
    return {cosine * v.x - sine * v.y, sine * v.x + cosine * v.y};
  }
  vec2 operator*(const vec2& p) const { return turned(p) + shift; }
  plan_pose operator*(const plan_pose& first) const { return {*this * first.shift, yaw + first.yaw}; }
  plan_pose inverse() const {
    const plan_pose turn{{0, 0}, -yaw};
    return {-1.0 * turn.turned(shift), -yaw};
  }
};

/// What of a transform between levelled frames is in plan.
inline plan_pose plan_of(const rigid& transform) {
  return {transform.translation.xy(), std::atan2(transform.rotation(1, 0), transform.rotation(0, 0))};
}

/// The transform between levelled frames that raises by `height` [m].
inline rigid in_space(const plan_pose& pose, double height) {
  return {rotation_about_z(pose.yaw), {pose.shift.x, pose.shift.y, height}};
}

}  // namespace globalmatch::detail
