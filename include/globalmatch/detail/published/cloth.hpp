// Cloth simulation: what a cloth looks like that falls on the ground turned upside down ([GM] 3.1, after
// [CSF]). [CSF] Zhang et al. 2016, An easy-to-use airborne LiDAR data filtering method based on cloth
// simulation, Remote Sensing 8(6), 501. Cost: particles times iterations, until the cloth is at rest.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
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

/// A cloth that falls on ground turned upside down: particles fall under gravity, stay where they meet the
/// ground, and pull on their neighbours.
class falling_cloth {
 public:
  /// `ground`: heights [m] upside down, row by row.
  falling_cloth(std::vector<float> ground, int columns, int rows, const cloth_options& options)
      : ground_(std::move(ground)),
        columns_(columns),
        rows_(rows),
        rigidness_(options.rigidness),
        fall_(float(options.gravity * options.time_step * options.time_step)),
        heights_(ground_.size(), *std::max_element(ground_.begin(), ground_.end())),
        before_(heights_),
        fixed_(ground_.size(), 0) {}

  /// One unit of time; returns by how far a particle moved at most [m].
  float step() {
    for (std::size_t i = 0; i < heights_.size(); ++i) {
      if (fixed_[i]) continue;
      const float now = heights_[i];
      heights_[i] += (now - before_[i]) - fall_;  // Verlet integration, [CSF] Eq. (4)
      before_[i] = now;
    }
    for (int pass = 0; pass < rigidness_; ++pass)
      for (std::size_t i = 0; i < heights_.size(); ++i) {
        if ((i + 1) % std::size_t(columns_) != 0) pull(i, i + 1);
        if (i + std::size_t(columns_) < heights_.size()) pull(i, i + std::size_t(columns_));
      }
    float max_displacement = 0;
    for (std::size_t i = 0; i < heights_.size(); ++i) {
      if (fixed_[i]) continue;
      if (heights_[i] <= ground_[i]) {
        heights_[i] = ground_[i];
        fixed_[i] = 1;
      }
      max_displacement = std::max(max_displacement, std::abs(heights_[i] - before_[i]));
    }
    return max_displacement;
  }

  /// Slope post-processing: steep ground holds up the cloth's edge, so contact spreads from resting particles
  /// to neighbours whose ground lies within `slope_step` [m].
  void spread_contact(double slope_step) {
    std::vector<std::size_t> contact;
    for (std::size_t i = 0; i < heights_.size(); ++i)
      if (fixed_[i]) contact.push_back(i);
    for (std::size_t k = 0; k < contact.size(); ++k)
      for_each_edge_neighbor(contact[k], columns_, rows_, [&](std::size_t j) {
        if (fixed_[j] || std::abs(ground_[j] - ground_[contact[k]]) > slope_step) return;
        heights_[j] = ground_[j];
        fixed_[j] = 1;
        contact.push_back(j);
      });
  }

  const std::vector<float>& heights() const { return heights_; }

 private:
  void pull(std::size_t i, std::size_t j) {
    const float difference = heights_[j] - heights_[i];
    const float share = !fixed_[i] && !fixed_[j] ? 0.25f : 0.5f;
    if (!fixed_[i]) heights_[i] += difference * share;
    if (!fixed_[j]) heights_[j] -= difference * share;
  }

  std::vector<float> ground_;
  int columns_, rows_, rigidness_;
  float fall_;  // [m] in the first unit of time
  std::vector<float> heights_, before_;
  std::vector<std::uint8_t> fixed_;
};

/// Heights of a cloth under the ground. `lowest` holds a height per cell [m], row by row, NaN where there is
/// none; at least one is needed.
inline cloth simulate_cloth(std::vector<float> lowest, int columns, int rows,
                            const cloth_options& options = {}, const execution& exec = {}) {
  fill_from_nearest(lowest, columns, rows);
  for (float& z : lowest) z = -z;
  falling_cloth falling(std::move(lowest), columns, rows, options);
  for (int iteration = 0; iteration < options.max_iterations; ++iteration) {
    if (iteration % 16 == 0) report_progress(exec, "ground", double(iteration) / options.max_iterations);
    if (falling.step() < options.convergence_threshold) break;
  }
  falling.spread_contact(options.slope_step);
  std::vector<float> heights = falling.heights();
  for (float& z : heights) z = -z;
  return {columns, rows, std::move(heights)};
}

}  // namespace globalmatch::detail
