// Stem positions behind the border: finite, in a levelled local frame, in an order of their own.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "globalmatch/local_points.hpp"
#include "globalmatch/points.hpp"

namespace globalmatch {

/// Positions of stems, sorted by (x, y, z) of the caller's frame, so that results do not depend on the
/// caller's order.
struct position_set {
  local_frame frame;                 ///< its origin is the first position
  std::vector<Eigen::Vector3d> at;   ///< [m] levelled local frame
  std::vector<stem_index> original;  ///< index of each in the caller's range
  bool has_heights = true;           ///< false: positions in plan, all heights are 0

  std::size_t size() const { return at.size(); }
};

/// Reads the caller's positions. `name` ("source", "target") is for messages. Throws `std::invalid_argument`
/// when a coordinate is not finite.
template <position_range R>
position_set import_positions(const R& positions, const Eigen::Vector3d& up, std::string_view name) {
  position_set set;
  set.has_heights = point_range<R>;
  const Eigen::Matrix3d levelling = levelling_rotation(up);
  if (set.has_heights) set.frame.local_from_scan_rotation = levelling;  // positions in plan are level already
  std::vector<Eigen::Vector3d> given;
  for (const auto& p : positions) {
    given.push_back(xyz(p));
    if (!given.back().allFinite())
      throw std::invalid_argument(std::string(name) + ": position " + std::to_string(given.size() - 1) +
                                  " is not finite; remove it");
  }
  set.original.resize(given.size());
  std::iota(set.original.begin(), set.original.end(), stem_index(0));
  std::stable_sort(set.original.begin(), set.original.end(), [&](stem_index a, stem_index b) {
    return std::lexicographical_compare(given[a].begin(), given[a].end(), given[b].begin(), given[b].end());
  });
  if (!given.empty()) set.frame.origin = given[set.original.front()];
  for (const stem_index i : set.original) set.at.push_back(set.frame.to_local(given[i]));
  return set;
}

/// Distance [m] of two positions, in plan where heights do not count.
inline double stem_distance(const Eigen::Vector3d& a, const Eigen::Vector3d& b, bool horizontal) {
  return horizontal ? (a - b).head<2>().norm() : (a - b).norm();
}

}  // namespace globalmatch
