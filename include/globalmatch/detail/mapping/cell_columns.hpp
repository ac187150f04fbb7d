// Points sorted into cubic cells, cells into columns, columns into rows: what stands near each other lies
// near each other in memory, and neighbours are found without a tree. In: local points. Out: the same,
// sorted.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/local_points.hpp"

namespace globalmatch::detail {

/// Occupied cells of a cubic grid: column by column, each from the lowest cell up; columns row by row.
/// Immutable. Owns its points, cell by cell, those of a cell in the order they came in.
class cell_columns {
 public:
  using cell_index = std::uint32_t;
  struct cell {
    std::int32_t height;  ///< number of the cell above the lowest height
    std::uint32_t first;  ///< of its points
  };
  struct column {
    std::int32_t x, y;  ///< number of its cells along x and y
    cell_index first;   ///< of its cells
  };

  /// All that it holds. `cells`, `columns` and `rows` (the first column of each) have one entry more than
  /// there are.
  struct parts {
    double width = 1, per_meter = 1;    // [m], and cells
    std::array<double, 3> corner = {};  // [m] of the lowest cells
    local_points points;
    std::vector<cell> cells;
    std::vector<column> columns;
    std::vector<std::size_t> rows;

    /// Number of the cell along an axis; grows with the coordinate, whatever the rounding.
    std::int32_t number(double v, std::size_t axis) const {
      return static_cast<std::int32_t>(
          std::min(std::max((v - corner[axis]) * per_meter, 0.0), double(max_cell)));
    }
  };
  static constexpr std::int32_t max_cell = (1 << 21) - 1;  ///< number of the last cell along each axis

  cell_columns() = default;
  explicit cell_columns(parts p) : parts_(std::move(p)) {}

  double width() const { return parts_.width; }
  const local_points& points() const { return parts_.points; }
  std::size_t cells() const { return parts_.cells.empty() ? 0 : parts_.cells.size() - 1; }
  std::size_t columns() const { return parts_.columns.empty() ? 0 : parts_.columns.size() - 1; }
  std::size_t rows() const { return parts_.rows.empty() ? 0 : parts_.rows.size() - 1; }
  const cell& operator[](cell_index c) const { return parts_.cells[c]; }
  const column& column_at(std::size_t c) const { return parts_.columns[c]; }
  std::uint32_t points_begin(cell_index c) const { return parts_.cells[c].first; }
  std::uint32_t points_end(cell_index c) const { return parts_.cells[c + 1].first; }
  cell_index cells_begin(std::size_t c) const { return parts_.columns[c].first; }
  cell_index cells_end(std::size_t c) const { return parts_.columns[c + 1].first; }
  std::size_t columns_begin(std::size_t row) const { return parts_.rows[row]; }
  std::size_t columns_end(std::size_t row) const { return parts_.rows[row + 1]; }

  /// Numbers of the columns of a row from x = `left` to `right`: [begin, end).
  std::pair<std::size_t, std::size_t> columns_between(std::int32_t row, std::int32_t left,
                                                      std::int32_t right) const {
    if (row < 0 || std::size_t(row) >= rows()) return {0, 0};
    const auto begin = parts_.columns.begin() + std::ptrdiff_t(parts_.rows[std::size_t(row)]);
    const auto end = parts_.columns.begin() + std::ptrdiff_t(parts_.rows[std::size_t(row) + 1]);
    const auto before = [](const column& c, std::int32_t x) { return c.x < x; };
    const auto first = std::lower_bound(begin, end, left, before);
    auto last = first;
    if (right - left < 8)
      while (last != end && last->x <= right) ++last;
    else
      last = std::lower_bound(first, end, right + 1, before);
    return {std::size_t(first - parts_.columns.begin()), std::size_t(last - parts_.columns.begin())};
  }

  /// Calls `visit(begin, end)`, increasing, for the runs of points whose columns lie within `search_radius`
  /// [m] of (x, y) in plan, in each coordinate: all points nearer than that, and some others.
  template <class Visit>
  void for_each_run_near(double x, double y, double search_radius, const Visit& visit) const {
    if (x + search_radius < parts_.corner[0] || y + search_radius < parts_.corner[1]) return;
    const std::int32_t left = parts_.number(x - search_radius, 0),
                       right = parts_.number(x + search_radius, 0);
    const std::int32_t top =
        std::min(parts_.number(y + search_radius, 1), static_cast<std::int32_t>(rows()) - 1);
    for (std::int32_t row = parts_.number(y - search_radius, 1); row <= top; ++row) {
      const auto [begin, end] = columns_between(row, left, right);
      if (begin != end) visit(points_begin(cells_begin(begin)), points_begin(cells_begin(end)));
    }
  }

 private:
  parts parts_;
};

/// The columns within some cells of one. Moved from each column to the next, it searches for none. Refers to
/// the cells.
class column_window {
 public:
  static constexpr std::int32_t max_half_width = 3;  ///< cells that it reaches

  explicit column_window(const cell_columns& cells) : cells_(cells) {}

  void move_to(std::size_t column) {
    const cell_columns::column& center = cells_.column_at(column);
    const bool along = runs_known_ && center.y == y_ && center.x >= x_;
    x_ = center.x;
    y_ = center.y;
    for (std::int32_t k = 0; k <= 2 * max_half_width; ++k) {
      run& r = runs_[std::size_t(k)];
      if (along) {
        while (r.begin < r.last && cells_.column_at(r.begin).x < x_ - max_half_width) ++r.begin;
        while (r.end < r.last && cells_.column_at(r.end).x <= x_ + max_half_width) ++r.end;
      } else {
        const std::int32_t row = y_ + k - max_half_width;
        const auto [begin, end] = cells_.columns_between(row, x_ - max_half_width, x_ + max_half_width);
        const bool exists = row >= 0 && std::size_t(row) < cells_.rows();
        r = {begin, end, exists ? cells_.columns_end(std::size_t(row)) : end};
      }
    }
    runs_known_ = true;
  }

  /// Calls `visit(column)` for the columns within `search_radius` cells, along or across, and at least `from`
  /// away; increasing.
  template <class Visit>
  void for_each_within(std::int32_t search_radius, std::int32_t from, const Visit& visit) const {
    for (std::int32_t k = -search_radius; k <= search_radius; ++k) {
      const run& r = runs_[std::size_t(k + max_half_width)];
      const std::int32_t min_half_width = std::abs(k) >= from ? 0 : from;
      for (std::size_t c = r.begin; c < r.end; ++c) {
        const std::int32_t away = std::abs(cells_.column_at(c).x - x_);
        if (away <= search_radius && away >= min_half_width) visit(c);
      }
    }
  }

 private:
  struct run {
    std::size_t begin = 0, end = 0, last = 0;  // columns of a row, and where the row ends
  };
  const cell_columns& cells_;
  std::array<run, 2 * max_half_width + 1> runs_ = {};  // of the rows around
  std::int32_t x_ = 0, y_ = 0;
  bool runs_known_ = false;
};

}  // namespace globalmatch::detail
