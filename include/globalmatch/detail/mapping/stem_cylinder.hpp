// A cylinder that looks like a stem, and the evidence for it.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "globalmatch/detail/core/local_points.hpp"
#include "globalmatch/detail/core/small_solver.hpp"
#include "globalmatch/detail/mapping/cell_columns.hpp"
#include "globalmatch/detail/mapping/column_raster.hpp"
#include "globalmatch/detail/mapping/cylinder.hpp"
#include "globalmatch/detail/mapping/cylinder_fit.hpp"
#include "globalmatch/mapping_options.hpp"
#include "globalmatch/points.hpp"

namespace globalmatch::detail {

/// A cylinder that looks like a stem, and what speaks for it.
struct stem_cylinder {
  detail::cylinder cylinder;         ///< local frame
  std::vector<point_index> support;  ///< positions in the understory points that
                                     ///< lie on it, increasing
  double filled_height = 0;          ///< [m] height that the support fills, in steps of 0.1 m
  double rms = 0;                    ///< [m] of the support about the surface
  double surface_share = 1;          ///< of the points in and within 0.1 m of it those on its surface
  double inside_share = 0;           ///< points in it, as a share of those on its surface
  small_matrix covariance{};         ///< as of `cylinder_covariance`
  double quality = 1;                ///< `stem_quality`
};

/// Probability that a cylinder which looks like a stem is one: a logistic regression on the height that its
/// points fill, their share of all points around, their variance as a share of the squared tolerance (a third
/// where they fill the tolerance evenly, as leaves do) and the radius, of which there were none above 0.3 m
/// to fit. Ours, fitted on simulated scans in the default layer, 0.2 to 3 m above the ground
/// (docs/deviations.md).
inline double stem_quality(const stem_cylinder& found, double tolerance) {
  const double relative_rms = found.rms / tolerance, radius = std::min(found.cylinder.radius, 0.3);
  const double evidence = 2.56 * found.filled_height + 13.27 * found.surface_share -
                          11.67 * relative_rms * relative_rms - 10.06 * radius - 11.63;
  return 1 / (1 + std::exp(-evidence));
}

/// Calls `visit(i, d)` for the understory points within `distance` of the cylinder's surface or inside it,
/// increasing; d is the signed distance from the surface.
template <class Visit>
void for_each_near(const cell_columns& understory, const cylinder& c, double distance, const Visit& visit) {
  constexpr double half_height = 2;  // [m] the understory layer is less than twice as high, on any slope
  const local_points& points = understory.points();
  const double horizontal_extent = half_height * c.axis.xy().norm() / c.axis.z;
  const double max_distance = c.radius + distance + half_height * std::abs(c.taper);
  understory.for_each_run_near(
      c.point.x, c.point.y, max_distance + horizontal_extent, [&](std::uint32_t begin, std::uint32_t end) {
        for (std::uint32_t i = begin; i < end; ++i) {
          const double dx = points.x[i] - c.point.x, dy = points.y[i] - c.point.y,
                       dz = points.z[i] - c.point.z;
          const double along = c.axis.x * dx + c.axis.y * dy + c.axis.z * dz;
          if (std::abs(along) > 2 * half_height) continue;
          const double squared = dx * dx + dy * dy + dz * dz - along * along;
          if (squared > max_distance * max_distance) continue;
          const double d = std::sqrt(std::max(squared, 0.0)) - c.radius + c.taper * along;
          if (d < distance) visit(static_cast<point_index>(i), d);
        }
      });
}

/// Support and evidence of a cylinder; nothing when it does not look like a stem: an upright surface seen
/// over some height, nothing inside it, little close around it, and its place certain.
inline std::optional<stem_cylinder> score_stem(const cylinder& c, const cell_columns& understory,
                                               const stem_cylinder_options& options) {
  constexpr double surroundings = 0.10;     // [m]
  constexpr std::size_t max_points = 1000;  // that the uncertainty is computed from
  const double tolerance = options.cylinder.distance_tolerance.value();
  const double rough = 1.5 * tolerance;  // bark and taper
  const local_points& points = understory.points();
  stem_cylinder found;
  found.cylinder = c;
  struct near_point {
    float z, distance;
  };
  std::vector<near_point> near;
  double lowest = std::numeric_limits<double>::infinity(), highest = -lowest, squares = 0;
  std::uint64_t filled = 0;
  for_each_near(understory, c, surroundings, [&](point_index i, double d) {
    const double z = points.z[i];
    near.push_back({float(z), float(d)});
    if (std::abs(d) >= tolerance) return;
    found.support.push_back(i);
    lowest = std::min(lowest, z);
    highest = std::max(highest, z);
    squares += d * d;
    filled |= height_bit(z);
  });
  if (found.support.size() < std::size_t(options.min_points)) return std::nullopt;
  found.filled_height = std::popcount(filled) * height_bin;
  if (found.filled_height < options.min_height ||
      found.filled_height < options.min_filled * (highest - lowest))
    return std::nullopt;

  std::size_t inside = 0, on_surface = 0, around = 0;
  for (const near_point& p : near)
    if (p.z >= lowest && p.z <= highest)
      ++(p.distance < -rough ? inside : p.distance < rough ? on_surface : around);
  if (on_surface == 0) return std::nullopt;
  found.surface_share = double(on_surface) / double(inside + on_surface + around);
  found.inside_share = double(inside) / double(on_surface);
  if (found.surface_share < options.min_share || found.inside_share > options.max_inside) return std::nullopt;

  std::vector<vec3> support;
  const std::size_t step = (found.support.size() + max_points - 1) / max_points;
  for (std::size_t k = 0; k < found.support.size(); k += step)
    support.push_back(vec3(points[found.support[k]]));
  found.rms = std::sqrt(squares / double(found.support.size()));
  found.covariance = cylinder_covariance(c, support, std::max(found.rms, tolerance / 4), options.cylinder);
  if (axis_uncertainty(found.covariance) > options.max_sigma) return std::nullopt;
  found.quality = stem_quality(found, tolerance);
  return found;
}

}  // namespace globalmatch::detail
