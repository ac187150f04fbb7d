// Cloth simulation: what a cloth looks like that falls on the ground turned upside down ([GM] 3.1, after
// [CSF]). [CSF] Zhang et al. 2016, An easy-to-use airborne LiDAR data filtering method based on cloth
// simulation, Remote Sensing 8(6), 501. Cost: particles times iterations, until the cloth is at rest.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/mapping_options.hpp"

namespace globalmatch::detail {

/// Heights of the cloth over a raster of lowest points.
struct cloth {
  int columns, rows;
  std::vector<float> heights;  ///< [m] row by row
};

/// Calls `visit(j)` for the cells that share an edge with cell i of a raster.
template <class Visit>
void for_each_edge_neighbor(std::size_t i, int columns, int rows, const Visit& visit) {
  const std::size_t width = std::size_t(columns), c = i % width, r = i / width;
  if (c > 0) visit(i - 1);
  if (c + 1 < width) visit(i + 1);
  if (r > 0) visit(i - width);
  if (r + 1 < std::size_t(rows)) visit(i + width);
}

/// Gives empty cells (NaN) the value of the nearest cell that has one, in steps along rows and columns ([CSF]
/// IHV).
inline void fill_from_nearest(std::vector<float>& values, int columns, int rows) {
  std::vector<std::size_t> front;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (!std::isnan(values[i])) front.push_back(i);
  for (std::size_t k = 0; k < front.size(); ++k)
    for_each_edge_neighbor(front[k], columns, rows, [&](std::size_t j) {
      if (!std::isnan(values[j])) return;
      values[j] = values[front[k]];
      front.push_back(j);
    });
}

/// Lays a cloth under the ground. `lowest` holds a height per cell [m], row by row, NaN where there is none;
/// at least one is needed. Seen upside down the ground is what the cloth falls on and the trees hang below
/// it: particles fall under gravity, stay where they meet the ground, and pull on their neighbours.
inline cloth simulate_cloth(std::vector<float> lowest, int columns, int rows,
                            const cloth_options& options = {}, const execution& exec = {}) {
  fill_from_nearest(lowest, columns, rows);
  // From here on all heights are upside down.
  for (float& z : lowest) z = -z;
  const std::vector<float>& ground = lowest;
  std::vector<float> height(ground.size(), *std::max_element(ground.begin(), ground.end()));
  std::vector<float> before = height;
  std::vector<std::uint8_t> fixed(ground.size(), 0);
  const auto fall = static_cast<float>(options.gravity * options.time_step * options.time_step);

  const auto collide = [&](std::size_t i) {
    if (height[i] > ground[i]) return;
    height[i] = ground[i];
    fixed[i] = 1;
  };
  const auto pull = [&](std::size_t i, std::size_t j) {
    const float difference = height[j] - height[i];
    if (!fixed[i] && !fixed[j]) {
      height[i] += difference / 4;
      height[j] -= difference / 4;
    } else if (!fixed[i]) {
      height[i] += difference / 2;
    } else if (!fixed[j]) {
      height[j] -= difference / 2;
    }
  };

  for (int iteration = 0; iteration < options.max_iterations; ++iteration) {
    if (iteration % 16 == 0) report_progress(exec, "ground", double(iteration) / options.max_iterations);
    float max_displacement = 0;
    for (std::size_t i = 0; i < height.size(); ++i) {
      if (fixed[i]) continue;
      const float now = height[i];
      height[i] += (now - before[i]) - fall;  // Verlet integration, [CSF] Eq. (4)
      before[i] = now;
    }
    for (int pass = 0; pass < options.rigidness; ++pass)
      for (int r = 0; r < rows; ++r)
        for (int c = 0; c < columns; ++c) {
          const std::size_t i = std::size_t(r) * std::size_t(columns) + std::size_t(c);
          if (c + 1 < columns) pull(i, i + 1);
          if (r + 1 < rows) pull(i, i + std::size_t(columns));
        }
    for (std::size_t i = 0; i < height.size(); ++i) {
      if (fixed[i]) continue;
      collide(i);
      max_displacement = std::max(max_displacement, std::abs(height[i] - before[i]));
    }
    if (max_displacement < options.convergence_threshold) break;
  }

  // Slope post-processing: steep ground holds up the cloth's edge, so contact spreads from resting particles.
  std::vector<std::size_t> contact;
  for (std::size_t i = 0; i < height.size(); ++i)
    if (fixed[i]) contact.push_back(i);
  for (std::size_t k = 0; k < contact.size(); ++k)
    for_each_edge_neighbor(contact[k], columns, rows, [&](std::size_t j) {
      if (fixed[j] || std::abs(ground[j] - ground[contact[k]]) > options.slope_step) return;
      height[j] = ground[j];
      fixed[j] = 1;
      contact.push_back(j);
    });
  for (float& z : height) z = -z;
  return {columns, rows, std::move(height)};
}

}  // namespace globalmatch::detail
