// What is known of the poses of maps before a survey: fixed ones, and whose frame is wanted.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/detail/survey/plan_pose.hpp"

namespace globalmatch::detail {

class known_poses {
 public:
  static constexpr std::size_t none = std::numeric_limits<std::size_t>::max();

  /// No fixed ones. `preferred`: a map whose frame is that of its component.
  known_poses(std::size_t preferred = none) : preferred_(preferred) {}  // NOLINT: a number says all
  /// `survey_from_local`: of the fixed maps, from their levelled local frames.
  known_poses(std::size_t preferred, std::vector<std::optional<rigid>> survey_from_local)
      : preferred_(preferred), survey_from_local_(std::move(survey_from_local)) {}

  bool is_fixed(std::size_t map) const {
    return map < survey_from_local_.size() && survey_from_local_[map].has_value();
  }
  /// The reference of a component is one of those of its maps that have the highest rank.
  int rank(std::size_t map) const { return is_fixed(map) ? 2 : map == preferred_ ? 1 : 0; }

  /// The pose of a fixed map in the local frame of another one.
  plan_pose pose_beside(std::size_t reference, std::size_t map) const {
    return plan_of(transform_beside(reference, map));
  }
  double height_beside(std::size_t reference, std::size_t map) const {
    return transform_beside(reference, map).translation.z;
  }

 private:
  rigid transform_beside(std::size_t reference, std::size_t map) const {
    return survey_from_local_[reference]->inverse() * *survey_from_local_[map];
  }

  std::size_t preferred_;
  std::vector<std::optional<rigid>> survey_from_local_;
};

}  // namespace globalmatch::detail
