// Ground on ground: how far apart in height the ground is that two scans see at one place. In: ground points
// of both, in one levelled frame, at the right place in plan. Out: the vertical offset between them. Ours.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/keyed_sort.hpp"
#include "globalmatch/detail/core/matrices.hpp"
#include "globalmatch/detail/core/position_index.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::detail {

/// [m] of the target's ground above that of the source.
struct ground_offset {
  double offset = 0;
  double sigma = 0;
};

/// Ground points, and planes through those around a place.
class ground_planes {
 public:
  explicit ground_planes(std::vector<vec3> points) : points_(as_set(std::move(points))), index_(points_) {}

  const std::vector<vec3>& points() const { return points_.at; }

  /// Height [m] of the plane at (x, y) through the points around; nothing where fewer than `min_neighbors`
  /// are, or none is next to it.
  std::optional<double> height_at(double x, double y, std::size_t min_neighbors) const {
    constexpr double plane_radius = 0.75, max_distance = 0.35;  // [m]
    mat3 normal;
    vec3 right;
    std::size_t count = 0;
    double nearest = plane_radius * plane_radius;
    index_.for_each_within(x, y, plane_radius, [&](stem_index i, double squared) {
      const vec3 row{points_.at[i].x - x, points_.at[i].y - y, 1};
      normal += outer(row, row);
      right += points_.at[i].z * row;
      nearest = std::min(nearest, squared);
      ++count;
    });
    if (count < min_neighbors || nearest > max_distance * max_distance || !normal.is_invertible())
      return std::nullopt;
    return (normal.inverse() * right).z;
  }

 private:
  static position_set as_set(std::vector<vec3> points) {
    position_set set;
    set.at = std::move(points);
    return set;
  }

  position_set points_;
  position_index index_;
};

/// Median vertical offset [m] of each block of 4 m that both see, at every `step`-th point of the source.
inline std::vector<double> offsets_of_blocks(const ground_planes& source, const ground_planes& target,
                                             std::size_t min_neighbors, std::size_t step) {
  constexpr double block_width = 4, max_offset = 15;  // [m]
  constexpr std::size_t min_offsets = 8;              // of a block
  std::vector<keyed> by_block;
  std::vector<double> offsets;
  const auto number = [&](double v) { return std::uint32_t(std::int32_t(std::floor(v / block_width))); };
  for (std::size_t i = 0; i < source.points().size(); i += step) {
    if (i / step % 1024 == 0) poll_cancelled();
    const vec3& p = source.points()[i];
    const auto to = target.height_at(p.x, p.y, min_neighbors);
    if (!to || std::abs(*to - p.z) > max_offset) continue;
    const auto from = source.height_at(p.x, p.y, min_neighbors);
    if (!from) continue;
    by_block.push_back({key_of(number(p.x), number(p.y)), offsets.size()});
    offsets.push_back(*to - *from);
  }
  sort_keyed(by_block);
  std::vector<double> medians, block;
  for (std::size_t i = 0; i < by_block.size(); ++i) {
    block.push_back(offsets[by_block[i].value]);
    if (i + 1 < by_block.size() && by_block[i + 1].key == by_block[i].key) continue;
    if (block.size() >= min_offsets) medians.push_back(median(block));
    block.clear();
  }
  return medians;
}

/// The offset that most blocks agree on; nothing where fewer than three do, or another one is nearly as
/// frequent.
inline std::optional<ground_offset> mode_of_offsets(std::vector<double> blocks) {
  constexpr double half_width = 0.15;  // [m] within which blocks agree
  constexpr double min_ratio = 2.5;    // of the most frequent to the next
  constexpr std::size_t min_blocks = 3;
  sort_numbers(blocks);
  const auto count_around = [&](double middle) {
    return std::size_t(std::upper_bound(blocks.begin(), blocks.end(), middle + half_width) -
                       std::lower_bound(blocks.begin(), blocks.end(), middle - half_width));
  };
  double mode = 0;
  std::size_t most = 0, next = 0;
  for (const double b : blocks)
    if (const std::size_t count = count_around(b); count > most) most = count, mode = b;
  for (const double b : blocks)
    if (std::abs(b - mode) > 2 * half_width) next = std::max(next, count_around(b));
  if (most < min_blocks || double(most) < min_ratio * double(next)) return std::nullopt;
  std::vector<double> agreeing;
  for (const double b : blocks)
    if (std::abs(b - mode) <= half_width) agreeing.push_back(b);
  const auto count = double(agreeing.size());
  const double middle = median(agreeing);
  double squares = 0;
  for (const double b : agreeing) squares += (b - middle) * (b - middle);
  constexpr double median_of_normal = 1.5708;  // variance of a median, against that of the mean
  const double of_students_t = count > 3 ? (count - 1) / (count - 3) : 3;
  constexpr double min_sigma = 1e-3;  // [m] no ground is known better
  const double variance = of_students_t * median_of_normal * squares / (count - 1) / count;
  return ground_offset{middle, std::max(min_sigma, std::sqrt(variance))};
}

/// The vertical offset of the ground that both scans see, from points in one levelled frame. First where
/// ground lies densely, then also where it is sparser; nothing where too little of it is seen by both. No
/// more than `max_places` of the source's points are compared, evenly picked. Cost: linear in the points.
inline std::optional<ground_offset> find_ground_offset(
    std::vector<vec3> source, std::vector<vec3> target,
    std::size_t max_places = std::numeric_limits<std::size_t>::max()) {
  if (source.empty() || target.empty()) return std::nullopt;
  const std::size_t step = 1 + (source.size() - 1) / max_places;
  const ground_planes from(std::move(source)), to(std::move(target));
  for (const std::size_t min_neighbors : {12u, 8u})
    if (const auto found = mode_of_offsets(offsets_of_blocks(from, to, min_neighbors, step))) return found;
  return std::nullopt;
}

}  // namespace globalmatch::detail
