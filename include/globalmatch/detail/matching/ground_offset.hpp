// Ground on ground: how far apart in height the ground is that two scans see at one place. In: ground points
// of both, in one levelled frame, at the right place in plan. Out: the vertical offset between them. Ours.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
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

/// Vertical offsets [m] at some source points.
inline std::vector<double> offsets_at(std::span<const keyed> points, std::size_t step,
                                      const ground_planes& source, const ground_planes& target,
                                      std::size_t min_neighbors) {
  constexpr double max_offset = 15;  // [m]
  std::vector<double> offsets;
  for (std::size_t i = 0; i < points.size(); i += step) {
    const vec3& p = source.points()[points[i].value];
    const auto to = target.height_at(p.x, p.y, min_neighbors);
    if (!to || std::abs(*to - p.z) > max_offset) continue;
    if (const auto from = source.height_at(p.x, p.y, min_neighbors)) offsets.push_back(*to - *from);
  }
  return offsets;
}

/// Median vertical offset [m] of each block of 4 m that both see, at some of its source points, evenly
/// picked, or at all where both see few of these.
inline std::vector<double> offsets_of_blocks(const ground_planes& source, const ground_planes& target,
                                             std::size_t min_neighbors) {
  constexpr double block_width = 4;                            // [m]
  constexpr std::size_t min_offsets = 8, enough_places = 100;  // of a block
  const auto number = [&](double v) { return std::uint32_t(std::int32_t(std::floor(v / block_width))); };
  std::vector<keyed> by_block;
  for (std::size_t i = 0; i < source.points().size(); ++i)
    by_block.push_back({key_of(number(source.points()[i].x), number(source.points()[i].y)), i});
  sort_keyed(by_block);
  std::vector<double> medians;
  for (std::size_t first = 0, last = 0; first < by_block.size(); first = last) {
    poll_cancelled();
    while (last < by_block.size() && by_block[last].key == by_block[first].key) ++last;
    const std::span<const keyed> block(by_block.data() + first, last - first);
    const std::size_t step = 1 + (block.size() - 1) / enough_places;
    std::vector<double> offsets = offsets_at(block, step, source, target, min_neighbors);
    if (step > 1 && !offsets.empty() && offsets.size() < min_offsets)
      offsets = offsets_at(block, 1, source, target, min_neighbors);
    if (offsets.size() >= min_offsets) medians.push_back(median(offsets));
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
/// ground lies densely, then also where it is sparser; nothing where too little of it is seen by both. Cost:
/// linear in the points.
inline std::optional<ground_offset> find_ground_offset(std::vector<vec3> source, std::vector<vec3> target) {
  if (source.empty() || target.empty()) return std::nullopt;
  const ground_planes from(std::move(source)), to(std::move(target));
  for (const std::size_t min_neighbors : {12u, 8u})
    if (const auto found = mode_of_offsets(offsets_of_blocks(from, to, min_neighbors))) return found;
  return std::nullopt;
}

}  // namespace globalmatch::detail
