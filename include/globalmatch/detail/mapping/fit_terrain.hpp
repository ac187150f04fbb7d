// The terrain ([GM] 3.1) through the lowest points near a surface under the vegetation.
// In: lowest points and heights under the vegetation. Out: `terrain`. Cost: linear in the area.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/planes.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/mapping/lowest_raster.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/mapping_options.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

/// `terrain::interpolated_height` for points of the cells in one row, which are known to lie half a node from
/// each other.
class heights_along_cells {
 public:
  heights_along_cells(const terrain& ground, int row)
      : per_node_(float(1 / ground.resolution)), last_(ground.columns - 1) {
    row_ = between(row, ground.rows - 1);
    lower_ = ground.heights.data() + ground.node(0, row_);
    upper_ = ground.heights.data() + ground.node(0, std::min(row_ + 1, ground.rows - 1));
  }
  float at(int column, float x, float y) const {
    const int left = between(column, last_), right = std::min(left + 1, last_);
    const float u = x * per_node_ - (float(left) + 0.5f), v = y * per_node_ - (float(row_) + 0.5f);
    return (1 - v) * ((1 - u) * lower_[left] + u * lower_[right]) +
           v * ((1 - u) * upper_[left] + u * upper_[right]);
  }

 private:
  /// The node before a cell; of the outermost cells the nodes next to them.
  static int between(int cell, int last) {
    static_assert(lowest_cells_a_node == 2);
    return std::clamp((cell + 1) / 2 - 1, 0, std::max(last - 1, 0));
  }

  float per_node_;
  int last_, row_;
  const float *lower_, *upper_;
};

/// Which of the lowest points are ground, and how many of them lie at each node.
struct ground_marks {
  std::vector<std::uint8_t> is_ground;  // by cell
  std::vector<std::uint8_t> of_node;
};

/// Hands the ground points to the terrain, node by node. False when there are none.
inline bool collect_ground(const lowest_raster& lowest, const ground_marks& marks, terrain& result,
                           const execution& exec) {
  result.first_ground.reserve(marks.of_node.size() + 1);
  result.first_ground.push_back(0);
  for (const std::uint8_t count : marks.of_node)
    result.first_ground.push_back(result.first_ground.back() + count);
  result.ground.resize(result.first_ground.back());
  parallel_for(
      exec, "ground", std::size_t(result.rows),
      [&](std::size_t row) {
        for (int c = 0; c < result.columns; ++c) {
          std::uint32_t next = result.first_ground[result.node(c, int(row))];
          for (int dr = 0; dr < lowest_cells_a_node; ++dr)
            for (int dc = 0; dc < lowest_cells_a_node; ++dc) {
              const std::size_t i =
                  lowest.cell(c * lowest_cells_a_node + dc, int(row) * lowest_cells_a_node + dr);
              if (marks.is_ground[i]) result.ground[next++] = lowest.points[i];
            }
        }
      },
      16);
  return !result.ground.empty();
}

/// Marks the nodes of a terrain that ground lies near, within `hole` nodes.
inline void mark_data(const std::vector<std::uint8_t>& of_node, int hole, terrain& result,
                      const execution& exec) {
  const auto is_near = [&](int column, int row) {
    if (of_node[result.node(column, row)] > 0) return true;
    for (int r = std::max(row - hole, 0); r <= std::min(row + hole, result.rows - 1); ++r)
      for (int c = std::max(column - hole, 0); c <= std::min(column + hole, result.columns - 1); ++c)
        if (of_node[result.node(c, r)] > 0 &&
            (r - row) * (r - row) + (c - column) * (c - column) <= hole * hole)
          return true;
    return false;
  };
  result.has_data.resize(of_node.size());
  parallel_for(
      exec, "ground", std::size_t(result.rows),
      [&](std::size_t row) {
        for (int c = 0; c < result.columns; ++c)
          result.has_data[result.node(c, int(row))] = is_near(c, int(row)) ? 1 : 0;
      },
      16);
}

/// Fits the terrain to the lowest points near a surface under the vegetation, `heights` at its nodes: planes
/// through what lies around each node, refitted without what stands out upwards; where too little lies
/// there, through what lies in ever larger blocks. Of a noisy
/// scan what stands out downwards is left out too; elsewhere that is ground between what grows on it.
inline terrain fit_terrain(const lowest_raster& lowest, std::vector<float> heights, int columns, int rows,
                           const ground_options& options, const execution& exec = {}, bool is_noisy = false) {
  constexpr double min_points = 5, roughness = 0.08;  // [m] above planes that span 1.5 m
  terrain result;
  result.frame = lowest.frame;
  result.resolution = options.resolution;
  result.columns = columns;
  result.rows = rows;
  result.heights = std::move(heights);

  // Calls `visit(i, c, p)` for the cells of a row of nodes whose point lies near the heights so far.
  const auto for_each_near = [&](int row, double above, const auto& visit) {
    constexpr int cells = lowest_cells_a_node;  // a node
    const auto band_below = float(is_noisy ? -above : -options.ground_band), band_above = float(above);
    for (int r = row * cells; r < (row + 1) * cells; ++r) {
      const heights_along_cells ground(result, r);
      for (int c = 0; c < lowest.columns; ++c) {
        const std::size_t i = lowest.cell(c, r);
        const vec3f& p = lowest.points[i];
        if (std::isnan(p.z)) continue;
        const float height = p.z - ground.at(c, p.x, p.y);
        if (height > band_below && height < band_above) visit(i, c / cells, p);
      }
    }
  };
  plane_pyramid pyramid;
  for (const auto& [above, half_width] :
       {std::pair(options.ground_band, 2), {2.5 * roughness, 2}, {roughness, 1}, {roughness, 1}}) {
    const auto& planes = pyramid.fit(
        result.resolution, columns, rows, half_width, min_points,
        [&, limit = above](int row, plane_moments* moments) {
          for_each_near(row, limit, [&](std::size_t, int c, const vec3f& p) { moments[c].add(p); });
        },
        exec);
    parallel_for(exec, "ground", planes.size(), [&](std::size_t i) {
      if (planes[i].known()) result.heights[i] = planes[i].height;
    });
  }
  ground_marks marks{std::vector<std::uint8_t>(lowest.points.size()),
                     std::vector<std::uint8_t>(result.heights.size())};
  parallel_for(
      exec, "ground", std::size_t(rows),
      [&](std::size_t row) {
        for_each_near(int(row), roughness, [&](std::size_t i, int c, const vec3f&) {
          marks.is_ground[i] = 1;
          ++marks.of_node[result.node(c, int(row))];
        });
      },
      16);
  if (!collect_ground(lowest, marks, result, exec)) return {};
  mark_data(marks.of_node, int(options.hole_radius / result.resolution), result, exec);
  return result;
}

}  // namespace globalmatch::detail
