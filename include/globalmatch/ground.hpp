// Ground ([GM] 3.1): lowest points -> cloth -> ground points near the cloth -> terrain by local planes.
// In: points of a scan, one pass. Out: `terrain` and its funnel. Cost: linear in points and in area.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <stdexcept>
#include <vector>

#include "globalmatch/cloth.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/local_points.hpp"
#include "globalmatch/lowest_points.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/terrain.hpp"

namespace globalmatch {

struct ground_options {
  cloth_options cloth = {};
  double low_point_depth = 0.3;  ///< [m] a lowest point this far below its neighbours is no ground (ours)
  double steepest_slope = 1.0;   ///< [m/m] what stands out more steeply is no ground (ours)
  double ground_band = 0.5;      ///< [m] lowest points within this of the cloth are ground ([CSF] h_cp)
  double plane_radius = 1.0;     ///< [m] ground points this near in plan make a node's plane (ours)
  double hole_radius = 1.5;      ///< [m] further than this from all ground points there is no data (ours)
};

struct ground_model {
  globalmatch::terrain terrain;
  ground_funnel funnel;
};

/// Throws `std::invalid_argument` naming the field that makes no sense.
inline void require_valid(const ground_options& options) {
  const auto require = [](bool holds, const char* message) {
    if (!holds) throw std::invalid_argument(message);
  };
  require(options.cloth.resolution > 0, "ground.cloth.resolution must be positive");
  require(options.cloth.rigidness >= 1, "ground.cloth.rigidness must be at least 1");
  require(options.cloth.max_iterations >= 1, "ground.cloth.max_iterations must be at least 1");
  require(options.cloth.time_step > 0 && options.cloth.gravity > 0,
          "ground.cloth.time_step and ground.cloth.gravity must be positive");
  require(
      options.cloth.at_rest > 0 &&
          options.cloth.at_rest < options.cloth.gravity * options.cloth.time_step * options.cloth.time_step,
      "ground.cloth.at_rest must be positive and less than the first fall, gravity * time_step^2");
  require(options.cloth.slope_step > 0, "ground.cloth.slope_step must be positive");
  require(options.low_point_depth > 0, "ground.low_point_depth must be positive");
  require(options.steepest_slope > 0, "ground.steepest_slope must be positive");
  require(options.ground_band > 0, "ground.ground_band must be positive");
  require(options.plane_radius > 0, "ground.plane_radius must be positive");
  require(options.hole_radius > 0, "ground.hole_radius must be positive");
}

namespace detail {

/// Each cell of the cloth covers 2 x 2 cells of the lowest points.
constexpr int lowest_per_cloth_cell = 2;

inline std::vector<float> cloth_cell_minima(const lowest_raster& lowest, int columns, int rows) {
  std::vector<float> minima(std::size_t(columns) * std::size_t(rows),
                            std::numeric_limits<float>::quiet_NaN());
  for (int r = 0; r < lowest.rows; ++r)
    for (int c = 0; c < lowest.columns; ++c) {
      if (!lowest.holds(c, r)) continue;
      float& minimum = minima[std::size_t(r / lowest_per_cloth_cell) * std::size_t(columns) +
                              std::size_t(c / lowest_per_cloth_cell)];
      const float z = lowest.points[lowest.cell(c, r)].z();
      if (!(minimum <= z)) minimum = z;
    }
  return minima;
}

/// Height at (x, y) of a plane through points that vegetation may lie above: least squares, repeated without
/// what stands out upwards. Nothing from fewer than three points.
inline std::optional<float> height_of_local_plane(std::vector<Eigen::Vector3f>& points, float x, float y) {
  constexpr int rounds = 4;
  constexpr float least_step = 0.03f;  // [m] roughness that every forest floor has
  constexpr float ridge = 3e-4f;       // [m^2] holds the slope down where points do not spread
  std::optional<float> height;
  for (int round = 0; round < rounds && points.size() >= 3; ++round) {
    Eigen::Matrix3f normal = Eigen::Matrix3f::Zero();
    Eigen::Vector3f right = Eigen::Vector3f::Zero();
    const float reference = points.front().z();  // small numbers for float
    for (const Eigen::Vector3f& p : points) {
      const Eigen::Vector3f row(1, p.x() - x, p.y() - y);
      normal += row * row.transpose();
      right += row * (p.z() - reference);
    }
    normal(1, 1) += ridge * float(points.size());
    normal(2, 2) += ridge * float(points.size());
    const Eigen::Vector3f plane = normal.inverse() * right;
    height = reference + plane.x();
    const auto residual = [&](const Eigen::Vector3f& p) {
      return p.z() - reference - plane.dot(Eigen::Vector3f(1, p.x() - x, p.y() - y));
    };
    float squares = 0;
    for (const Eigen::Vector3f& p : points) squares += residual(p) * residual(p);
    const float limit = std::max(least_step, std::sqrt(squares / float(points.size())));
    if (std::erase_if(points, [&](const Eigen::Vector3f& p) { return residual(p) > limit; }) == 0) break;
  }
  return height;
}

/// Heights of nodes without ground: as if a membrane hung between the others.
inline void fill_holes(std::vector<float>& heights, int columns, int rows) {
  std::vector<std::size_t> unknown;
  for (std::size_t i = 0; i < heights.size(); ++i)
    if (std::isnan(heights[i])) unknown.push_back(i);
  fill_from_nearest(heights, columns, rows);
  constexpr int sweeps = 50;
  for (int sweep = 0; sweep < sweeps; ++sweep)
    for (const std::size_t i : unknown) {
      float sum = 0, count = 0;
      for_each_edge_neighbor(i, columns, rows, [&](std::size_t j) {
        sum += heights[j];
        ++count;
      });
      heights[i] = sum / count;
    }
}

}  // namespace detail

inline namespace GLOBALMATCH_THREADING {

/// Fits the terrain to the lowest points near the cloth, so that a slope does not sink it below them.
inline terrain fit_terrain(const lowest_raster& lowest, const cloth& surface, const ground_options& options,
                           const execution& how = {}) {
  terrain result;
  result.frame = lowest.frame;
  result.resolution = options.cloth.resolution;
  result.columns = surface.columns;
  result.rows = surface.rows;
  result.heights = surface.heights;
  std::vector<std::uint8_t> is_ground(lowest.points.size(), 0);
  for (std::size_t i = 0; i < lowest.points.size(); ++i) {
    const Eigen::Vector3f& p = lowest.points[i];
    if (std::isnan(p.z())) continue;
    is_ground[i] = std::abs(p.z() - result.interpolated_height(p.x(), p.y())) < options.ground_band;
    if (is_ground[i]) result.ground.push_back(p);
  }

  const std::size_t nodes = surface.heights.size();
  result.heights.assign(nodes, std::numeric_limits<float>::quiet_NaN());
  result.has_data.assign(nodes, 0);
  const int reach =
      int(std::ceil(std::max(options.plane_radius, options.hole_radius) / lowest.resolution)) + 1;
  parallel_chunks(how, "ground", nodes, 1024, [&](std::size_t begin, std::size_t end) {
    std::vector<Eigen::Vector3f> nearby;
    for (std::size_t i = begin; i < end; ++i) {
      const int c = int(i % std::size_t(result.columns)), r = int(i / std::size_t(result.columns));
      const auto x = float((c + 0.5) * result.resolution), y = float((r + 0.5) * result.resolution);
      nearby.clear();
      const int row = r * detail::lowest_per_cloth_cell, column = c * detail::lowest_per_cloth_cell;
      for (int dr = -reach; dr <= reach + 1; ++dr)
        for (int dc = -reach; dc <= reach + 1; ++dc) {
          if (!lowest.holds(column + dc, row + dr)) continue;
          const std::size_t cell = lowest.cell(column + dc, row + dr);
          if (!is_ground[cell]) continue;
          const Eigen::Vector3f& p = lowest.points[cell];
          const double distance = std::hypot(p.x() - x, p.y() - y);
          if (distance < options.hole_radius) result.has_data[i] = 1;
          if (distance < options.plane_radius) nearby.push_back(p);
        }
      if (const auto height = detail::height_of_local_plane(nearby, x, y)) result.heights[i] = *height;
    }
  });
  if (result.ground.empty()) return {};
  if (std::all_of(result.heights.begin(), result.heights.end(), [](float z) { return std::isnan(z); }))
    result.heights = surface.heights;  // too few points anywhere for a plane
  detail::fill_holes(result.heights, result.columns, result.rows);
  return result;
}

/// The ground under a scan. `up` points away from it, in the frame of the scan. The terrain is empty when no
/// point is finite. Throws `std::invalid_argument` naming a bad option, `operation_cancelled` on request.
template <point_range R>
ground_model model_ground(const R& scan, const ground_options& options = {},
                          const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ(), const execution& how = {}) {
  require_valid(options);
  ground_model model;
  const double resolution = options.cloth.resolution / detail::lowest_per_cloth_cell;
  lowest_raster lowest = gather_lowest_points(scan, resolution, up, model.funnel, how);
  if (lowest.points.empty()) return model;
  model.funnel.low_outliers = remove_low_outliers(lowest, options.low_point_depth);
  model.funnel.unreachable = remove_unreachable(lowest, options.steepest_slope, options.ground_band);

  const int columns = lowest.columns / detail::lowest_per_cloth_cell;
  const int rows = lowest.rows / detail::lowest_per_cloth_cell;
  const cloth surface =
      simulate_cloth(detail::cloth_cell_minima(lowest, columns, rows), columns, rows, options.cloth, how);
  model.terrain = fit_terrain(lowest, surface, options, how);
  model.funnel.ground_points = model.terrain.ground.size();
  return model;
}

}  // namespace GLOBALMATCH_THREADING
}  // namespace globalmatch
