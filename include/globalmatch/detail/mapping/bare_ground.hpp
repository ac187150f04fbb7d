// A first surface under the vegetation: planes under the lowest points.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "globalmatch/detail/core/planes.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/mapping/lowest_raster.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/mapping_options.hpp"

namespace globalmatch::detail {

/// Height at (x, y) of a plane through points that vegetation may lie above: least squares, repeated without
/// what stands out upwards. Not known from fewer than three points.
inline local_plane plane_under(std::vector<vec3f>& points, float x, float y) {
  constexpr int max_iterations = 4;
  constexpr double min_step = 0.03;  // [m] roughness that every forest floor has
  local_plane plane;
  for (int iteration = 0; iteration < max_iterations && points.size() >= 3; ++iteration) {
    plane_moments moments;
    for (const vec3f& p : points) moments.add(p);
    plane = moments.fit(x, y, 3);
    const auto residual = [&](const vec3f& p) { return p.z - plane.at(p.x - x, p.y - y); };
    double squares = 0;
    for (const vec3f& p : points) squares += double(residual(p)) * residual(p);
    const double limit = std::max(min_step, std::sqrt(squares / double(points.size())));
    if (std::erase_if(points, [&](const vec3f& p) { return residual(p) > limit; }) == 0) break;
  }
  return plane;
}

/// The lowest points of square blocks, 1 m wide at the usual resolution, NaN where there is none.
struct lowest_of_blocks {
  static constexpr int cells_a_block = 4;
  double width;  ///< [m]
  int columns, rows;
  std::vector<vec3f> points;  ///< row by row

  lowest_of_blocks(const lowest_raster& lowest, const execution& exec)
      : width(cells_a_block * lowest.resolution),
        columns((lowest.columns + cells_a_block - 1) / cells_a_block),
        rows((lowest.rows + cells_a_block - 1) / cells_a_block),
        points(std::size_t(columns) * std::size_t(rows), no_point) {
    parallel_for(
        exec, "ground", std::size_t(rows),
        [&](std::size_t row) {
          const int begin = int(row) * cells_a_block, end = std::min(begin + cells_a_block, lowest.rows);
          for (int r = begin; r < end; ++r)
            for (int c = 0; c < lowest.columns; ++c) {
              const vec3f& p = lowest.points[lowest.cell(c, r)];
              vec3f& kept = points[block(c / cells_a_block, int(row))];
              if (!std::isnan(p.z) && !(kept.z <= p.z)) kept = p;
            }
        },
        16);
  }
  std::size_t block(int c, int r) const { return std::size_t(r) * std::size_t(columns) + std::size_t(c); }
};

/// A plane under the vegetation about the middle of each block, through the points of 5 x 5 blocks; where
/// these are too few, of larger ones.
inline std::vector<local_plane> planes_of_blocks(const lowest_of_blocks& lowest, const execution& exec) {
  constexpr int half_width = 2;  // blocks
  constexpr std::size_t min_points = 6;
  std::vector<local_plane> planes(lowest.points.size());
  parallel_for(
      exec, "ground", std::size_t(lowest.rows),
      [&](std::size_t row) {
        std::vector<vec3f> nearby;
        const int top = std::min(int(row) + half_width, lowest.rows - 1);
        for (int c = 0; c < lowest.columns; ++c) {
          nearby.clear();
          const int right = std::min(c + half_width, lowest.columns - 1);
          for (int br = std::max(int(row) - half_width, 0); br <= top; ++br)
            for (int bc = std::max(c - half_width, 0); bc <= right; ++bc)
              if (const vec3f& p = lowest.points[lowest.block(bc, br)]; !std::isnan(p.z)) nearby.push_back(p);
          if (nearby.size() >= min_points)
            planes[lowest.block(c, int(row))] = plane_under(nearby, float((c + 0.5) * lowest.width),
                                                            float((double(row) + 0.5) * lowest.width));
        }
      },
      8);
  plane_pyramid pyramid;
  const auto& wider = pyramid.fit(
      lowest.width, lowest.columns, lowest.rows, half_width, double(min_points),
      [&](int r, plane_moments* moments) {
        for (int c = 0; c < lowest.columns; ++c)
          if (const vec3f& p = lowest.points[lowest.block(c, r)]; !std::isnan(p.z)) moments[c].add(p);
      },
      exec);
  for (std::size_t i = 0; i < planes.size(); ++i)
    if (!planes[i].known()) planes[i] = wider[i];
  return planes;
}

/// Heights [m] at the nodes of a raster of `columns` x `rows`, as wide as two cells of the lowest points,
/// under what grows on the ground.
inline std::vector<float> planes_under_vegetation(const lowest_raster& lowest, int columns, int rows,
                                                  const ground_options&, const execution& exec = {}) {
  constexpr int nodes_a_block = lowest_of_blocks::cells_a_block / lowest_cells_a_node;
  const lowest_of_blocks blocks(lowest, exec);
  const std::vector<local_plane> planes = planes_of_blocks(blocks, exec);
  std::vector<float> heights(std::size_t(columns) * std::size_t(rows));
  parallel_for(
      exec, "ground", std::size_t(rows),
      [&](std::size_t row) {
        const int br = int(row) / nodes_a_block;
        for (int c = 0; c < columns; ++c) {
          const int bc = c / nodes_a_block;
          const double x = (c + 0.5) * 2 * lowest.resolution, y = (double(row) + 0.5) * 2 * lowest.resolution;
          heights[row * std::size_t(columns) + std::size_t(c)] = planes[blocks.block(bc, br)].at(
              float(x - (bc + 0.5) * blocks.width), float(y - (br + 0.5) * blocks.width));
        }
      },
      16);
  return heights;
}

}  // namespace globalmatch::detail
