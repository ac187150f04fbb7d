// A first surface under the vegetation: planes under the lowest points.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "globalmatch/detail/core/planes.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/mapping/lowest_points.hpp"
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

/// Heights [m] at the nodes of a raster of `columns` x `rows`, as wide as two cells of the lowest points,
/// under what grows on the ground: planes under the lowest points of blocks, each through those of 5 x 5
/// blocks without what stands out upwards.
inline std::vector<float> planes_under_vegetation(const lowest_raster& lowest, int columns, int rows, const ground_options&,
                                                  const execution& exec = {}) {
  constexpr int cells_a_block = 4, half_width = 2;  // blocks of 1 m
  const double width = cells_a_block * lowest.resolution;
  const int across = (lowest.columns + cells_a_block - 1) / cells_a_block;
  const int along = (lowest.rows + cells_a_block - 1) / cells_a_block;
  const auto block = [&](int c, int r) { return std::size_t(r) * std::size_t(across) + std::size_t(c); };
  std::vector<vec3f> lowest_of(std::size_t(across) * std::size_t(along),
                                         no_point);
  parallel_for(
      exec, "ground", std::size_t(along),
      [&](std::size_t row) {
        const int begin = int(row) * cells_a_block, end = std::min(begin + cells_a_block, lowest.rows);
        for (int r = begin; r < end; ++r)
          for (int c = 0; c < lowest.columns; ++c) {
            const vec3f& p = lowest.points[lowest.cell(c, r)];
            vec3f& kept = lowest_of[block(c / cells_a_block, int(row))];
            if (!std::isnan(p.z) && !(kept.z <= p.z)) kept = p;
          }
      },
      16);

  // A block without a plane of its own takes that of larger blocks.
  std::vector<local_plane> planes(lowest_of.size());
  parallel_for(
      exec, "ground", std::size_t(along),
      [&](std::size_t row) {
        std::vector<vec3f> nearby;
        const int r = int(row);
        for (int c = 0; c < across; ++c) {
          nearby.clear();
          for (int br = std::max(r - half_width, 0); br <= std::min(r + half_width, along - 1); ++br)
            for (int bc = std::max(c - half_width, 0); bc <= std::min(c + half_width, across - 1); ++bc)
              if (const vec3f& p = lowest_of[block(bc, br)]; !std::isnan(p.z))
                nearby.push_back(p);
          if (nearby.size() >= 6)
            planes[block(c, r)] = plane_under(nearby, float((c + 0.5) * width), float((r + 0.5) * width));
        }
      },
      8);
  plane_pyramid pyramid;
  const auto& wider = pyramid.fit(
      width, across, along, half_width, 6,
      [&](int r, plane_moments* moments) {
        for (int c = 0; c < across; ++c)
          if (const vec3f& p = lowest_of[block(c, r)]; !std::isnan(p.z)) moments[c].add(p);
      },
      exec);
  for (std::size_t i = 0; i < planes.size(); ++i)
    if (!planes[i].known()) planes[i] = wider[i];

  std::vector<float> heights(std::size_t(columns) * std::size_t(rows));
  constexpr int nodes_a_block = cells_a_block / lowest_cells_a_node;
  parallel_for(
      exec, "ground", std::size_t(rows),
      [&](std::size_t row) {
        const int r = int(row);
        for (int c = 0; c < columns; ++c) {
          const int bc = c / nodes_a_block, br = r / nodes_a_block;
          const double x = (c + 0.5) * 2 * lowest.resolution, y = (r + 0.5) * 2 * lowest.resolution;
          heights[std::size_t(r) * std::size_t(columns) + std::size_t(c)] =
              planes[block(bc, br)].at(float(x - (bc + 0.5) * width), float(y - (br + 0.5) * width));
        }
      },
      16);
  return heights;
}

}  // namespace globalmatch::detail
