// What is known of the poses of maps before a survey, and whose frame is wanted.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/rigid.hpp"

namespace globalmatch::detail {

class known_poses {
 public:
  static constexpr std::size_t none = std::numeric_limits<std::size_t>::max();

  /// No known ones. `preferred`: a map whose frame is that of its component.
  known_poses(std::size_t preferred = none) : preferred_(preferred) {}  // NOLINT: a number says all
  /// `survey_from_local`: of maps whose poses are known, from their levelled local frames. None is held.
  known_poses(std::size_t preferred, std::vector<std::optional<rigid>> survey_from_local)
      : preferred_(preferred),
        survey_from_local_(std::move(survey_from_local)),
        held_(survey_from_local_.size()),
        references_(survey_from_local_.size()),
        levelled_(survey_from_local_.size()) {}

  bool is_known(std::size_t map) const {
    return map < survey_from_local_.size() && survey_from_local_[map].has_value();
  }
  /// Whether its pose is not adjusted.
  bool is_fixed(std::size_t map) const { return map < held_.size() && held_[map] != 0; }
  void hold(std::size_t map) { held_[map] = true; }
  void release_all() { std::fill(held_.begin(), held_.end(), false); }
  /// Prefers a map whose pose is known to others.
  void refer_to(std::size_t map) { references_[map] = true; }
  /// Prefers a map whose vertical is known to those of which nothing is.
  void note_level(std::size_t map) { levelled_[map] = true; }
  /// The reference of a component is one of those of its maps that have the highest rank.
  int rank(std::size_t map) const {
    if (is_known(map)) return 3 + references_[map];
    if (map == preferred_) return 2;
    return map < levelled_.size() && levelled_[map] != 0 ? 1 : 0;
  }

  /// From the local frame of a map to that of another one, both of which are known.
  rigid transform_beside(std::size_t reference, std::size_t map) const {
    return survey_from_local_[reference]->inverse() * *survey_from_local_[map];
  }

 private:
  std::size_t preferred_;
  std::vector<std::optional<rigid>> survey_from_local_;
  std::vector<std::uint8_t> held_, references_, levelled_;
};

}  // namespace globalmatch::detail
