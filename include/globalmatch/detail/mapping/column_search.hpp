// The stems of one cluster ([GM] 3.1): mostly one, several where stems stand close or branches join them. The
// fullest column is followed, a circle is fitted across it, then a cylinder, until no column is high enough.
// In: the points of a cluster. Out: cylinders with their support.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/float_lanes.hpp"
#include "globalmatch/detail/core/local_points.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/detail/mapping/cell_columns.hpp"
#include "globalmatch/detail/mapping/column_raster.hpp"
#include "globalmatch/detail/mapping/cylinder.hpp"
#include "globalmatch/detail/mapping/cylinder_fit.hpp"
#include "globalmatch/detail/mapping/stem_cylinder.hpp"
#include "globalmatch/mapping_options.hpp"
#include "globalmatch/points.hpp"

namespace globalmatch::detail {

/// A line that rises with z: (x, y) = at + slope (z - z0).
struct vertical_line {
  vec2 at, slope;
  double z0 = 0;

  vec2 at_height(double z) const { return at + slope * (z - z0); }
  /// What it passes in plan, over more than the understory layer.
  rectangle seen_from_above() const {
    constexpr double half_height = 2;  // [m]
    const vec2 a = at_height(z0 - half_height), b = at_height(z0 + half_height);
    return {{std::min(a.x, b.x), std::min(a.y, b.y)}, {std::max(a.x, b.x), std::max(a.y, b.y)}};
  }
};

/// Follows a column up and down: the line through the middles of its slices, each of the points near it,
/// from an upright one at `start`. Returns it with the height bins that points near it fill.
inline std::pair<vertical_line, std::uint64_t> follow_column(std::span<const vec3> points, const vec2& start,
                                                             double max_slope) {
  constexpr double slice = 0.2, near = 0.15;  // [m]
  constexpr int max_iterations = 6, slices = 32;
  vertical_line line{start, {}, 0};
  for (const vec3& p : points) line.z0 += p.z / double(points.size());
  const double lowest = line.z0 - slice * slices / 2;
  std::uint64_t filled = 0;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    std::array<vec3, slices> sums{};
    std::array<double, slices> counts{};
    filled = 0;
    for (const vec3& p : points) {
      if ((p.xy() - line.at_height(p.z)).squared_norm() > near * near) continue;
      const int s = static_cast<int>((p.z - lowest) / slice);
      if (s < 0 || s >= slices) continue;
      sums[std::size_t(s)] += p;
      ++counts[std::size_t(s)];
      filled |= height_bit(p.z);
    }
    double n = 0, z = 0, zz = 0;
    vec2 xy, xyz;
    for (std::size_t s = 0; s < slices; ++s) {
      if (counts[s] == 0) continue;
      const vec3 m = sums[s] / counts[s] - vec3{0, 0, line.z0};
      n += 1, z += m.z, zz += m.z * m.z;
      xy += m.xy();
      xyz += m.xy() * m.z;
    }
    if (n < 3) break;
    const double variance_z = zz - z * z / n;
    line.slope = (xyz - xy * z / n) / std::max(variance_z, 1e-6);
    if (line.slope.norm() > max_slope) line.slope *= max_slope / line.slope.norm();
    line.at = (xy - line.slope * z) / n;
  }
  return {line, filled};
}

/// Sum of squared distances from a circle, cut off at the tolerance; points inside count double. Stops once
/// it reaches `enough`. `x`, `y`: points [m].
inline float circle_cost(const std::vector<float>& x, const std::vector<float>& y, const circle& c,
                         double tolerance, float enough) {
  constexpr std::size_t block = 64;
  const float cx = float(c.center.x), cy = float(c.center.y), r = float(c.radius);
  const float width = float(tolerance), cut = float(tolerance * tolerance);
  float cost = 0, distances[block], costs[block];
  for (std::size_t begin = 0; begin < x.size() && cost < enough; begin += block) {
    const std::size_t some = std::min(x.size() - begin, block);
    for (std::size_t k = 0; k < some; ++k) {
      const float from_x = x[begin + k] - cx, from_y = y[begin + k] - cy;
      distances[k] = from_x * from_x + from_y * from_y;
    }
    take_square_roots(distances, some);
    for (std::size_t k = 0; k < some; ++k) {
      const float d = distances[k] - r;
      costs[k] = std::min(d * d, cut) + cut * one_if_positive(-width - d);
    }
    cost += sum_in_lanes(costs, some);
  }
  return cost;
}

/// The circle that most points lie on, seen along a line, by RANSAC: three points an iteration, until it is
/// unlikely that better ones were missed. `x`, `y`: points [m] from the line.
inline std::optional<circle> fit_circle(const std::vector<float>& x, const std::vector<float>& y,
                                        double tolerance, const cylinder_options& options,
                                        random_source& random) {
  const auto count = static_cast<std::uint32_t>(x.size());
  const double cut = float(tolerance * tolerance);
  std::optional<circle> best;
  float best_cost = std::numeric_limits<float>::infinity();
  int max_iterations = options.max_iterations;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    const std::uint32_t i = random.below(count), j = random.below(count), k = random.below(count);
    if (i == j || j == k || i == k) continue;
    const auto drawn = circle_through({x[i], y[i]}, {x[j], y[j]}, {x[k], y[k]});
    if (!drawn || drawn->radius < options.min_radius || drawn->radius > options.max_radius) continue;
    const float cost = circle_cost(x, y, *drawn, tolerance, best_cost);
    if (!(cost < best_cost)) continue;
    best_cost = cost;
    best = drawn;
    // No more iterations than it takes to draw three points on the circle almost surely.
    const double off = std::clamp(double(cost) / (cut * count), 0.05, 0.95);
    const double success = std::pow(1 - off, 3);
    max_iterations =
        std::min(max_iterations, iteration + static_cast<int>(std::ceil(-4.6 / std::log1p(-success))));
  }
  return best;
}

/// The points near a line, of which every so many are fitted.
struct column_sample {
  vertical_line line;
  std::vector<point_index> members;  ///< positions in the understory
  std::vector<vec3> points;          ///< of these
};

/// How a cylinder is fitted to the points of a column. A function and what it refers to.
struct cylinder_fitter {
  std::optional<cylinder> (*fit)(const cylinder_fitter&, const column_sample&, const cylinder_options&,
                                 random_source&);
  std::span<const vec3f> normals = {};  ///< of all understory points, where it takes them
};

/// The circle seen along the line, then least squares.
inline std::optional<cylinder> fit_along_line(const cylinder_fitter&, const column_sample& column,
                                              const cylinder_options& options, random_source& random) {
  constexpr std::size_t min_points = 6;
  const double tolerance = options.distance_tolerance.value();
  const double blurred = tolerance + 0.01;  // [m] the line is not quite the axis
  if (column.points.size() < min_points) return std::nullopt;
  std::vector<float> x, y;
  for (const vec3& p : column.points) {
    const vec2 from_line = p.xy() - column.line.at_height(p.z);
    x.push_back(float(from_line.x));
    y.push_back(float(from_line.y));
  }
  const auto found = fit_circle(x, y, blurred, options, random);
  if (!found) return std::nullopt;
  const vec2 at = column.line.at + found->center, slope = column.line.slope;
  const cylinder seen{{at.x, at.y, column.line.z0}, vec3{slope.x, slope.y, 1}.normalized(), found->radius, 0};
  return refine_cylinder(seen, column.points, tolerance, options, 2 * blurred);
}

/// Takes the columns that a stem stands in out of a raster: those near the axis at some height that it was
/// seen at, of the columns in `around`.
inline void remove_stem(column_raster& columns, const rectangle& around, const cylinder& c) {
  constexpr double half_height = 1.5, surroundings = 0.05;  // [m]
  const vec2 slope = c.axis.xy() / c.axis.z;
  columns.remove(around.widened(c.radius), [&](double x, double y) {
    const vec2 from_middle{x - c.point.x, y - c.point.y};
    const double share =
        std::clamp(from_middle.dot(slope) / std::max(slope.squared_norm(), 1e-9), -half_height, half_height);
    return (from_middle - share * slope).norm() < c.radius + surroundings;
  });
}

/// The search for the stems of one cluster. Refers to the understory.
class column_search {
 public:
  column_search(const cell_columns& understory, std::span<const point_index> members,
                const cylinder_fitter& fitter, const stem_cylinder_options& options)
      : understory_(understory),
        fitter_(fitter),
        options_(options),
        max_slope_(std::tan(options.cylinder.max_tilt_deg * std::numbers::pi / 180)),
        columns_(understory.points(), members, options.column_width) {}

  /// At most `maximum` stems.
  std::vector<stem_cylinder> run(random_source& random, std::size_t maximum) {
    constexpr double min_filled_share = 0.5;  // height that a column holds of a stem that leans, as a share
    std::vector<stem_cylinder> stems;
    for (auto column = columns_.densest(); column && stems.size() < maximum; column = columns_.densest()) {
      poll_cancelled();
      if (column->bins * height_bin < min_filled_share * options_.min_height) break;
      const rectangle around = square_about(column->center, search_radius + 1.5 * max_slope_);
      std::optional<stem_cylinder> stem;
      if (sample_column(column->center, around))
        if (const auto fit = fitter_.fit(fitter_, sample_, options_.cylinder, random))
          stem = score_stem(*fit, understory_, options_);
      if (stem) {
        remove_stem(columns_, around, stem->cylinder);
        stems.push_back(std::move(*stem));
      }
      columns_.remove(square_about(column->center, options_.column_width / 2),
                      [](double, double) { return true; });
    }
    return stems;
  }

 private:
  static constexpr double search_radius = 0.45;  // [m] from the line: thick stems

  static std::size_t step_for(std::size_t count) {
    constexpr std::size_t max_points = 500;  // that are fitted
    return (count + max_points - 1) / max_points;
  }

  /// Follows the column about a place, and samples the points near it; false when it is not high enough.
  bool sample_column(const vec2& center, const rectangle& around) {
    const local_points& points = understory_.points();
    sample_.points.clear();
    columns_.for_each_in(around, step_for(columns_.count_in(around)),
                         [&](point_index i) { sample_.points.push_back(vec3(points[i])); });
    const auto [line, filled] = follow_column(sample_.points, center, max_slope_);
    if (std::popcount(filled) * height_bin < options_.min_height) return false;
    sample_.line = line;
    near_.clear();
    columns_.for_each_in(line.seen_from_above().widened(search_radius), 1, [&, l = line](point_index i) {
      const vec2 at = l.at_height(points.z[i]);
      const vec2 from_line{points.x[i] - at.x, points.y[i] - at.y};
      if (from_line.squared_norm() < search_radius * search_radius) near_.push_back(i);
    });
    sample_.members.clear();
    sample_.points.clear();
    for (std::size_t k = 0; k < near_.size(); k += step_for(near_.size())) {
      sample_.members.push_back(near_[k]);
      sample_.points.push_back(vec3(points[near_[k]]));
    }
    return true;
  }

  const cell_columns& understory_;
  const cylinder_fitter& fitter_;
  const stem_cylinder_options& options_;
  double max_slope_;
  column_raster columns_;
  column_sample sample_;  // reused memory
  std::vector<point_index> near_;
};

}  // namespace globalmatch::detail
