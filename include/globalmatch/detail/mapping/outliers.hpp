// Lowest points that are no ground: multipath returns below it, and stems and crowns above it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <iterator>
#include <limits>
#include <vector>

#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/mapping/lowest_raster.hpp"
#include "globalmatch/execution.hpp"

namespace globalmatch::detail {

/// Whether at least `minimum` points within two cells of a cell, itself not counted, are such that
/// `counts(height)`.
template <class Counts>
bool are_around(const lowest_raster& raster, int column, int row, int minimum, const Counts& counts) {
  const int left = std::max(column - 2, 0), right = std::min(column + 2, raster.columns - 1);
  const int top = std::min(row + 2, raster.rows - 1);
  for (int r = std::max(row - 2, 0); r <= top; ++r)
    for (int c = left; c <= right; ++c) {
      const float z = raster.points[raster.cell(c, r)].z;
      if ((c != column || r != row) && !std::isnan(z) && counts(z) && --minimum == 0) return true;
    }
  return false;
}

/// With fewer points around it a point cannot be called an outlier.
constexpr int min_around = 4;

/// Empties the cells whose point lies more than `depth` [m] below all but one of the points within two cells:
/// multipath returns come singly or in twos, while on a slope some neighbour is always lower. Returns how
/// many.
inline std::size_t remove_low_outliers(lowest_raster& raster, double depth, const execution& exec = {}) {
  std::vector<std::vector<std::size_t>> outliers(static_cast<std::size_t>(raster.rows));
  parallel_for(
      exec, "ground", outliers.size(),
      [&](std::size_t row) {
        const int r = int(row);
        for (int c = 0; c < raster.columns; ++c) {
          if (!raster.holds(c, r)) continue;
          const double z = raster.points[raster.cell(c, r)].z;
          const auto any = [](float) { return true; };
          const auto near = [&](float other) { return other < z + depth; };
          if (!are_around(raster, c, r, 2, near) && are_around(raster, c, r, min_around, any))
            outliers[row].push_back(raster.cell(c, r));
        }
      },
      16);
  std::size_t removed = 0;
  for (const auto& of_row : outliers)
    for (const std::size_t i : of_row) {
      raster.points[i].z = not_known;
      ++removed;
    }
  return removed;
}

/// The lowest point of square blocks of a raster, 1 m wide at the usual resolution, NaN where there is none.
struct block_minima {
  static constexpr int cells_a_block = 4;
  int columns, rows;
  std::vector<float> heights;  ///< row by row

  explicit block_minima(const lowest_raster& raster)
      : columns((raster.columns + cells_a_block - 1) / cells_a_block),
        rows((raster.rows + cells_a_block - 1) / cells_a_block),
        heights(std::size_t(columns) * std::size_t(rows), not_known) {
    for (int r = 0; r < raster.rows; ++r)
      for (int c = 0; c < raster.columns; ++c) {
        const float z = raster.points[raster.cell(c, r)].z;
        float& lowest = heights[block(c / cells_a_block, r / cells_a_block)];
        if (!std::isnan(z) && !(lowest <= z)) lowest = z;
      }
  }
  std::size_t block(int c, int r) const { return std::size_t(r) * std::size_t(columns) + std::size_t(c); }
  /// NaN also beyond the raster.
  float at(int c, int r) const {
    return c >= 0 && r >= 0 && c < columns && r < rows ? heights[block(c, r)] : not_known;
  }
};

/// Mean height [m] of the blocks at `distance` blocks around one when they form a surface that lies above it:
/// nearly all are known, none lies lower or is a step apart from the next; else NaN.
inline float surface_around(const block_minima& blocks, int column, int row, int distance, float step) {
  constexpr int min_share = 3;  // of four
  const float below = blocks.at(column, row);
  const int side = 2 * distance, all = 4 * side;
  float sum = 0, before = not_known;
  int known = 0;
  for (int k = 0; k <= all; ++k) {  // once around, and the first again
    const int edge = k / side % 4, along = k % side - distance;
    const int dc = edge == 0 ? along : edge == 1 ? distance : edge == 2 ? -along : -distance;
    const int dr = edge == 0 ? -distance : edge == 1 ? along : edge == 2 ? distance : -along;
    const float z = blocks.at(column + dc, row + dr);
    if (std::isnan(z)) continue;
    if (!(z > below + step) || std::abs(z - before) > step) return not_known;
    before = z;
    if (k == all) continue;
    sum += z;
    ++known;
  }
  return known * 4 >= all * min_share ? sum / float(known) : not_known;
}

/// Whether a block lies `depth` [m] below two of those in line with it, on both sides: most do not, which is
/// quickly seen.
inline bool is_low(const block_minima& blocks, int column, int row, double depth) {
  const float limit = blocks.at(column, row) + float(depth) / 2;
  const auto lies_lower = [&](int dc, int dr) { return blocks.at(column + dc, row + dr) < limit; };
  return !(lies_lower(2, 0) || lies_lower(-2, 0) || lies_lower(0, 2) || lies_lower(0, -2));
}

/// The lowest of the blocks [m] from 2 to 6 blocks away, where half of the nearest of these are known; else
/// NaN.
inline float lowest_around(const block_minima& blocks, int column, int row) {
  constexpr int inner = 2, outer = 6, min_known = 8;  // of sixteen
  float lowest = std::numeric_limits<float>::infinity();
  int known = 0;
  for (int dr = -outer; dr <= outer; ++dr)
    for (int dc = -outer; dc <= outer; ++dc) {
      const int distance = std::max(std::abs(dc), std::abs(dr));
      const float z = distance < inner ? not_known : blocks.at(column + dc, row + dr);
      if (std::isnan(z)) continue;
      lowest = std::min(lowest, z);
      known += distance == inner;
    }
  return known >= min_known ? lowest : not_known;
}

/// Empties the cells of clumps below the ground: up to two metres wide, and `depth` [m] and more below a
/// surface that goes all around them, whose blocks are less than `step` [m] apart from each other; where none
/// does, below all that lies within six metres. Returns how many. Cost: linear in the cells.
inline std::size_t remove_low_clumps(lowest_raster& raster, double depth, double step) {
  constexpr int cells = block_minima::cells_a_block;
  const block_minima blocks(raster);
  std::size_t removed = 0;
  for (int row = 0; row < blocks.rows; ++row)
    for (int column = 0; column < blocks.columns; ++column) {
      if (std::isnan(blocks.at(column, row)) || !is_low(blocks, column, row, depth)) continue;
      const float surfaces[] = {surface_around(blocks, column, row, 2, float(step)),
                                surface_around(blocks, column, row, 3, float(step)),
                                lowest_around(blocks, column, row)};
      const auto above = std::find_if(std::begin(surfaces), std::end(surfaces), [&](float around) {
        return blocks.at(column, row) < around - float(depth);
      });
      if (above == std::end(surfaces)) continue;
      for (int r = row * cells; r < std::min((row + 1) * cells, raster.rows); ++r)
        for (int c = column * cells; c < std::min((column + 1) * cells, raster.columns); ++c)
          if (float& z = raster.points[raster.cell(c, r)].z; z < *above - float(depth)) {
            z = not_known;
            ++removed;
          }
    }
  return removed;
}

/// The highest that ground which rises by `slope` [m/m] from any lower point can be at each cell; unbounded
/// where no point proves ground. A border of one cell lies around.
class ground_ceiling {
 public:
  ground_ceiling(const lowest_raster& raster, double slope, const execution& exec)
      : columns_(raster.columns),
        straight_(float(slope * raster.resolution)),
        heights_(std::size_t(raster.columns + 2) * std::size_t(raster.rows + 2), unbounded) {
    const auto any = [](float) { return true; };
    parallel_for(
        exec, "ground", std::size_t(raster.rows),
        [&](std::size_t of) {
          const int r = int(of);
          for (int c = 0; c < columns_; ++c)
            if (raster.holds(c, r) && are_around(raster, c, r, min_around, any))
              row(r)[c] = raster.points[raster.cell(c, r)].z;
        },
        16);
    for (int r = 0; r < raster.rows; ++r) {
      float* here = row(r);
      climb_from(row(r - 1), here);
      for (int c = 0; c < columns_; ++c) here[c] = std::min(here[c], here[c - 1] + straight_);
    }
    for (int r = raster.rows - 1; r >= 0; --r) {
      float* here = row(r);
      climb_from(row(r + 1), here);
      for (int c = columns_ - 1; c >= 0; --c) here[c] = std::min(here[c], here[c + 1] + straight_);
    }
  }

  /// By column.
  const float* row(int r) const {
    return heights_.data() + std::size_t(r + 1) * std::size_t(columns_ + 2) + 1;
  }

 private:
  static constexpr float unbounded = std::numeric_limits<float>::infinity();

  float* row(int r) { return heights_.data() + std::size_t(r + 1) * std::size_t(columns_ + 2) + 1; }
  void climb_from(const float* next, float* here) const {
    const float diagonal = float(std::sqrt(2.0)) * straight_;
    for (int c = 0; c < columns_; ++c)
      here[c] =
          std::min(here[c], std::min(next[c] + straight_, std::min(next[c - 1], next[c + 1]) + diagonal));
  }

  int columns_;
  float straight_;  // [m] rise from one cell to the next
  std::vector<float> heights_;
};

/// Empties the cells whose point no ground reaches: it stands more than `step` [m] above what rises by
/// `slope` [m/m] from some lower point (slope based filtering, Vosselman 2000, ISPRS Archives 33). Behind
/// shrubs the lowest points are on stems and crowns. A lone point, which may be an outlier, is no proof of
/// ground. Returns how many. Cost: linear in the cells.
inline std::size_t remove_unreachable(lowest_raster& raster, double slope, double step,
                                      const execution& exec = {}) {
  const ground_ceiling ceiling(raster, slope, exec);
  std::size_t removed = 0;
  for (int r = 0; r < raster.rows; ++r)
    for (int c = 0; c < raster.columns; ++c)
      if (float& z = raster.points[raster.cell(c, r)].z; z > ceiling.row(r)[c] + float(step)) {
        z = not_known;
        ++removed;
      }
  return removed;
}

}  // namespace globalmatch::detail
