// Verticality ([GM] Eq. (1)): v = 1 - |n . up| with normals n from principal component analysis of the
// neighbourhood. In: local points (their z axis is up). Out: a normal, a verticality and the spacing of
// points around each.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "globalmatch/detail/core/local_points.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/mapping/cell_columns.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/mapping_options.hpp"

namespace globalmatch::detail {

/// The surface through a cell.
struct cell_surface {
  float verticality = 0;        ///< [GM] Eq. (1); 0 where there are too few points
  float spacing = 0;            ///< [m] distance of points on it: that of a square grid of equal density
  std::uint8_t half_width = 0;  ///< cells around it whose points it took: 1 in dense places, up to 3
};

/// Whether a cell may be of a stem.
inline bool is_stem_cell(const cell_surface& s, const verticality_options& options) {
  constexpr double loose_threshold = 0.5;
  return s.half_width > 0 &&
         (!options.constraint || s.verticality > options.threshold.value_or(loose_threshold));
}

/// Sums over points of what their covariance is made of. Doubles of local coordinates: no digits are lost.
struct moments {
  double n = 0, x = 0, y = 0, z = 0, xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;

  void add(double px, double py, double pz) {
    n += 1, x += px, y += py, z += pz;
    xx += px * px, xy += px * py, xz += px * pz, yy += py * py, yz += py * pz, zz += pz * pz;
  }
  void operator+=(const moments& o) {
    n += o.n, x += o.x, y += o.y, z += o.z;
    xx += o.xx, xy += o.xy, xz += o.xz, yy += o.yy, yz += o.yz, zz += o.zz;
  }

  /// [GM] Eq. (1) with the normal of principal component analysis, which is not computed itself: the squared
  /// components of an eigenvector follow from the eigenvalues of the matrix and of its minor (Denton et al.
  /// 2022, Bulletin of the AMS 59, 31-58).
  double verticality() const {
    const double mx = x / n, my = y / n, mz = z / n;
    const double a = xx / n - mx * mx, b = yy / n - my * my, c = zz / n - mz * mz;
    const double d = xy / n - mx * my, e = xz / n - mx * mz, f = yz / n - my * mz;
    const double trace = a + b + c, minor_z = a * b - d * d;
    const double minors = minor_z + a * c - e * e + b * c - f * f;
    const double determinant = a * (b * c - f * f) - d * (d * c - e * f) + e * (d * f - b * e);
    double smallest = 0;  // eigenvalue: Newton's steps from below never pass the least root
    for (int step = 0; step < 12; ++step) {
      const double value = ((trace - smallest) * smallest - minors) * smallest + determinant;
      const double slope = (2 * trace - 3 * smallest) * smallest - minors;
      const double next = smallest - value / slope;
      if (!(next > smallest)) break;
      smallest = next;
    }
    const double others = trace - smallest;  // the sum of the other two, and below their product
    const double apart = smallest * smallest - others * smallest + minors - smallest * others;
    const double up = (smallest * smallest - (a + b) * smallest + minor_z) / apart;
    return apart > 0 ? 1 - std::sqrt(std::clamp(up, 0.0, 1.0)) : 0;
  }
};

/// Sums over a column of cells and those around it, height by height: a cell then adds up a few heights, not
/// all of its neighbours. For cells of some rows; refers to them.
class sums_by_height {
 public:
  sums_by_height(const cell_columns& cells, std::size_t first_row, std::size_t last_row)
      : cells_(cells), first_(cells.cells_begin(cells.columns_begin(first_row))) {
    const cell_columns::cell_index last = cells.cells_begin(cells.columns_begin(last_row));
    of_cell_.resize(last - first_);
    const local_points& points = cells.points();
    for (cell_columns::cell_index c = first_; c < last; ++c)
      for (std::uint32_t p = cells.points_begin(c); p < cells.points_end(c); ++p)
        of_cell_[c - first_].add(points.x[p], points.y[p], points.z[p]);
  }

  /// Nothing yet, for a stack of cells between two heights.
  void start(std::int32_t lowest, std::int32_t highest) {
    bottom_ = lowest - max_half_width;
    sums_.assign(std::size_t(highest + max_half_width - bottom_ + 1), {});
  }
  /// Adds the columns `half_width` cells away, to those nearer, for cells between two heights of the stack.
  void widen(const column_window& window, std::int32_t half_width, std::int32_t lowest,
             std::int32_t highest) {
    window.for_each_within(half_width, half_width == 1 ? 0 : half_width, [&](std::size_t column) {
      const cell_columns::cell_index end = cells_.cells_end(column);
      for (auto c = cells_.cells_begin(column); c < end && cells_[c].height <= highest + max_half_width; ++c)
        if (cells_[c].height >= lowest - max_half_width)
          sums_[std::size_t(cells_[c].height - bottom_)] += of_cell_[c - first_];
    });
  }
  /// Over the heights within reach of one.
  moments around(std::int32_t height, std::int32_t half_width) const {
    moments sum;
    for (std::int32_t h = height - half_width; h <= height + half_width; ++h)
      sum += sums_[std::size_t(h - bottom_)];
    return sum;
  }

 private:
  const cell_columns& cells_;
  cell_columns::cell_index first_;
  std::vector<moments> of_cell_;
  static constexpr std::int32_t max_half_width = column_window::max_half_width;
  std::int32_t bottom_ = 0;
  std::vector<moments> sums_;
};

/// The surfaces through a stack of cells, [first, last) of one column: each takes as many cells around it as
/// it needs. `window` lies about the column.
inline void estimate_stack(const cell_columns& cells, cell_columns::cell_index first,
                           cell_columns::cell_index last, const verticality_options& options,
                           const column_window& window, sums_by_height& sums,
                           std::vector<cell_surface>& surfaces) {
  constexpr std::int32_t max_half_width = column_window::max_half_width;
  sums.start(cells[first].height, cells[last - 1].height);
  cell_columns::cell_index low = first, high = last;  // not known are some from `low` to before `high`
  for (std::int32_t half_width = 1; half_width <= max_half_width && low < high; ++half_width) {
    sums.widen(window, half_width, cells[low].height, cells[high - 1].height);
    const double min_points = half_width == max_half_width ? 4 : options.min_neighbors;
    const cell_columns::cell_index from = low, to = high;
    low = to, high = from;
    for (cell_columns::cell_index c = from; c < to; ++c) {
      if (surfaces[c].half_width != 0) continue;
      const moments sum = sums.around(cells[c].height, half_width);
      if (sum.n < min_points) {
        low = std::min(low, c), high = c + 1;
        continue;
      }
      surfaces[c] = {static_cast<float>(sum.verticality()),
                     static_cast<float>((2 * half_width + 1) * cells.width() / std::sqrt(sum.n)),
                     static_cast<std::uint8_t>(half_width)};
    }
  }
}

/// Surface through each cell: through the points of the 27 cells around it, or of as many more as it takes to
/// hold `min_neighbors`, up to three cells away. With cells of 5 cm these are the balls that [GM] takes, or
/// nearly so, at a cost for each cell and not for each point. Linear in the points; parallel.
inline std::vector<cell_surface> estimate_surfaces(const cell_columns& cells,
                                                   const verticality_options& options = {},
                                                   const execution& exec = {}) {
  require_valid(options);
  using cell_index = cell_columns::cell_index;
  constexpr std::size_t max_half_width = column_window::max_half_width, rows_a_block = 32;
  std::vector<cell_surface> surfaces(cells.cells());
  parallel_chunks(exec, "verticality", cells.rows(), rows_a_block, [&](std::size_t begin, std::size_t end) {
    column_window window(cells);
    sums_by_height sums(cells, begin - std::min(begin, max_half_width),
                        std::min(end + max_half_width, cells.rows()));
    for (std::size_t column = cells.columns_begin(begin); column < cells.columns_end(end - 1); ++column) {
      window.move_to(column);
      cell_index next = cells.cells_begin(column);
      while (next < cells.cells_end(column)) {
        const cell_index first = next++;
        while (next < cells.cells_end(column) &&
               cells[next].height - cells[next - 1].height <= column_window::max_half_width)
          ++next;
        estimate_stack(cells, first, next, options, window, sums, surfaces);
      }
    }
  });
  return surfaces;
}

}  // namespace globalmatch::detail
