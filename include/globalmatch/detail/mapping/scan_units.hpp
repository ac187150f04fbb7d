// Scans that cannot be in metres, as a few of their points show before anything costs memory.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <ranges>
#include <stdexcept>
#include <string>
#include <vector>

#include "globalmatch/detail/core/local_frame.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/points.hpp"

namespace globalmatch::detail {

/// At most some 16,000 finite points from all over a scan. Of a scan without random access its first ones.
template <point_range R>
std::vector<vec3> points_all_over(const R& scan) {
  constexpr std::size_t max_points = std::size_t(1) << 14;
  std::vector<vec3> points;
  const auto take = [&](const auto& p) {
    if (const vec3 v = xyz(p); is_finite(v)) points.push_back(v);
  };
  if constexpr (std::ranges::random_access_range<const R>) {
    const auto count = static_cast<std::size_t>(std::ranges::distance(scan));
    const std::size_t step = std::max<std::size_t>(1, count / max_points);
    for (std::size_t i = 0; i < count; i += step)
      take(std::ranges::begin(scan)[static_cast<std::ranges::range_difference_t<const R>>(i)]);
  } else {
    for (const auto& p : scan) {
      if (points.size() == max_points) break;
      take(p);
    }
  }
  return points;
}

/// The range [low, high) of a coordinate, without the outermost points on each side.
struct coordinate_range {
  double low = 0, high = 0;
  double width() const { return high - low; }
};

inline coordinate_range robust_range(const std::vector<vec3>& points, std::size_t axis) {
  constexpr double outside = 0.02;
  std::vector<double> values;
  for (const vec3& p : points) values.push_back(p[axis]);
  std::sort(values.begin(), values.end());
  const auto last = double(values.size() - 1);
  return {values[std::size_t(outside * last)], values[std::size_t((1 - outside) * last)]};
}

/// How far points lie above each other in the tallest blocks of a scan, which are a 32nd of it wide: exceeded
/// by one block in a hundred, less the rise of a slope of 45 degrees. The lowest and the highest point of
/// each may be outliers. 0 where few blocks hold enough points.
inline double height_of_blocks(const std::vector<vec3>& points, const coordinate_range& x,
                               const coordinate_range& y) {
  constexpr std::size_t along = 32, min_blocks = 10, min_points = 4;
  constexpr double share = 0.99;
  const double width = std::max(x.width(), y.width()) / double(along);
  if (!(width > 0)) return 0;
  std::vector<std::vector<double>> heights(along * along);
  for (const vec3& p : points) {
    const double c = (p.x - x.low) / width, r = (p.y - y.low) / width;
    if (c >= 0 && r >= 0 && c < double(along) && r < double(along))
      heights[std::size_t(r) * along + std::size_t(c)].push_back(p.z);
  }
  std::vector<double> ranges;
  for (auto& block : heights) {
    if (block.size() < min_points) continue;
    std::sort(block.begin(), block.end());
    ranges.push_back(block[block.size() - 2] - block[1] - width);
  }
  if (ranges.size() < min_blocks) return 0;
  const auto tall = ranges.begin() + std::ptrdiff_t(share * double(ranges.size() - 1));
  std::nth_element(ranges.begin(), tall, ranges.end());
  return *tall;
}

/// [m] The step, of a decimetre or more, that points from all over a scan share in x or in y; 0 when there is
/// none. Floats hold map coordinates of millions of metres in steps of half a metre. Coordinates that are all
/// equal have none.
inline double coordinate_step(const std::vector<vec3>& points) {
  constexpr std::size_t min_points = 100;
  if (points.size() < min_points) return 0;
  for (const double step : {1.0, 0.5, 0.25, 0.125, 0.1})
    for (const std::size_t axis : {std::size_t(0), std::size_t(1)}) {
      const auto is_multiple = [&](const vec3& p) {
        return std::abs(p[axis] / step - std::round(p[axis] / step)) * step < 1e-6;
      };
      const auto is_other = [&](const vec3& p) { return p[axis] != points.front()[axis]; };
      if (std::any_of(points.begin(), points.end(), is_other) &&
          std::all_of(points.begin(), points.end(), is_multiple))
        return step;
    }
  return 0;
}

/// Throws `std::invalid_argument` naming the unit and the remedy when a scan, of which `points` are from all
/// over, cannot be in metres: in many places points lie higher above each other than trees are. Extents do not
/// tell, as a corridor may be as long.
inline void require_metres(std::vector<vec3> points, const vec3& up) {
  constexpr double tallest_tree = 130;                                     // [m] and more than any
  constexpr double low_in_millimetres = 2000, tall_in_centimetres = 6000;  // 2 m, 60 m
  if (points.empty()) return;
  const mat3 levelled = levelling_rotation(up);
  for (vec3& p : points) p = levelled * p;
  const coordinate_range x = robust_range(points, 0), y = robust_range(points, 1);
  const double height = height_of_blocks(points, x, y);
  if (!(height > tallest_tree)) return;
  const auto whole = [](double v) { return std::to_string(std::llround(v)); };
  const char* const unit = height <= low_in_millimetres ? "centimetres? Multiply them by 0.01"
                           : height <= tall_in_centimetres
                               ? "millimetres? Multiply them by 0.001 (by 0.01 if they are in centimetres)"
                               : "millimetres? Multiply them by 0.001";
  throw std::invalid_argument("scan: extent of " + whole(x.width()) + " x " + whole(y.width()) +
                              " m, with points " + whole(height) +
                              " m above each other: are coordinates in " + unit + ": metres are needed");
}

}  // namespace globalmatch::detail
