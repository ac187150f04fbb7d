// Votes for transforms: which of the transforms that congruent triangles propose are worth a trial.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include "globalmatch/detail/core/keyed_sort.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/detail/matching/matching_context.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/positions.hpp"
#include "globalmatch/triangles.hpp"

namespace globalmatch::detail {

/// Transforms that triangles with one source stem propose: those that place it on the same target stem with
/// about the same yaw count as one.
class vote_accumulator {
 public:
  explicit vote_accumulator(const matching_context& context) : context_(context) {}

  /// Forgets all votes, and keeps the memory. `yaw_width` [rad] of votes that count as one.
  void reset(double yaw_width) {
    constexpr double maximum = 1e6;
    votes_.clear();
    triangles_.clear();
    yaws_ = std::clamp(std::floor(2 * std::numbers::pi / yaw_width), 1.0, maximum);
  }

  /// The votes that follow are for this triangle, which has source stem `i` among its vertices.
  void set_query(const triangle& of_source, stem_index i) {
    query_ = of_source.vertices;
    own_ = query_[0] == i ? 0 : query_[1] == i ? 1 : 2;
    direction_ = direction(context_.source, query_[1], query_[2]);
  }

  /// Adds the vote of a congruent target triangle, unless the prior does not allow it.
  void vote(const std::array<stem_index, 3>& congruent) {
    if (context_.prior && context_.horizontal_distances() &&
        !context_.prior->may_place(context_.source.at[query_[own_]], context_.target.at[congruent[own_]]))
      return;
    const vec2 d = direction(context_.target, congruent[1], congruent[2]);
    const double turned = quadrants(d.dot(direction_), direction_.x * d.y - direction_.y * d.x);
    const auto yaw = static_cast<std::uint32_t>(turned / 4 * yaws_);
    votes_.push_back({key_of(congruent[own_], yaw), triangles_.size()});
    triangles_.push_back({{{query_[0], congruent[0]}, {query_[1], congruent[1]}, {query_[2], congruent[2]}}});
  }

  /// The triangles to try, those of most votes first, at most `maximum`, each the last one of those with one
  /// transform.
  std::vector<std::array<correspondence, 3>> peaks(std::size_t maximum) {
    sort_keyed(votes_);
    peaks_.clear();
    for (std::size_t begin = 0, end = 0; begin < votes_.size(); begin = end) {
      while (end < votes_.size() && votes_[end].key == votes_[begin].key) ++end;
      peaks_.push_back({~std::uint64_t(end - begin), end - 1});
    }
    keep_first(peaks_, maximum);
    std::vector<std::array<correspondence, 3>> triangles;
    triangles.reserve(peaks_.size());
    for (const keyed& peak : peaks_) triangles.push_back(triangles_[votes_[peak.value].value]);
    return triangles;
  }

 private:
  static vec2 direction(const position_set& stems, stem_index from, stem_index to) {
    return (stems.at[to] - stems.at[from]).xy();
  }

  /// Grows with the angle of (x, y) from 0 to 4, though not quite evenly within a quadrant; an arc tangent
  /// for each vote would take longer than all the rest of it.
  static double quadrants(double x, double y) {
    const double sum = std::abs(x) + std::abs(y), share = sum > 0 ? x / sum : 1;
    return y < 0 ? 3 + share : 1 - share;
  }

  const matching_context& context_;
  double yaws_ = 1;                       // that are distinguished
  std::array<stem_index, 3> query_ = {};  // source triangle, ...
  std::size_t own_ = 0;                   // ... which of its vertices all have in common, ...
  vec2 direction_ = {1, 0};               // ... and where its longest edge points
  std::vector<keyed> votes_;              // target stem and yaw; number of the triangle
  std::vector<keyed> peaks_;
  std::vector<std::array<correspondence, 3>> triangles_;
};

}  // namespace globalmatch::detail
