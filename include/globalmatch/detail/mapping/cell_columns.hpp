// Points sorted into cubic cells, cells into columns, columns into rows: what stands near each other lies
// near each other in memory, and neighbours are found without a tree. In: local points. Out: the same,
// sorted.
#pragma once


#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/local_frame.hpp"
#include "globalmatch/detail/core/local_points.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/execution.hpp"

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

/// Sorts by key, equal ones as they came; a pass for every eight bits in which keys differ. `spare` is
/// reused.
template <class Entry>
void radix_sort(std::vector<Entry>& entries, std::vector<Entry>& spare) {
  constexpr unsigned bits = 8;
  constexpr std::uint64_t mask = (1u << bits) - 1;
  if (entries.size() < 64) {
    std::stable_sort(entries.begin(), entries.end(),
                     [](const Entry& a, const Entry& b) { return a.key < b.key; });
    return;
  }
  std::uint64_t differ = 0;
  for (const Entry& e : entries) differ |= e.key ^ entries.front().key;
  spare.resize(entries.size());
  std::array<std::uint32_t, mask + 1> place;
  for (unsigned shift = 0; shift < 64 && differ >> shift != 0; shift += bits) {
    if (((differ >> shift) & mask) == 0) continue;
    place.fill(0);
    for (const Entry& e : entries) ++place[(e.key >> shift) & mask];
    std::uint32_t sum = 0;
    for (std::uint32_t& p : place) sum += std::exchange(p, sum);
    for (const Entry& e : entries) spare[place[(e.key >> shift) & mask]++] = e;
    entries.swap(spare);
  }
}

/// Fills `cell_columns`.
class cell_sorter {
 public:
  /// Takes the points over, in parts that each may be of any size; one row after the other can then be sorted
  /// alone.
  cell_sorter(std::vector<local_points> parts, const local_frame& frame, double width)
      : parts_(std::move(parts)) {
    if (!(width > 0)) throw std::invalid_argument("cell width must be positive");
    result_.width = width;
    result_.per_meter = 1 / width;
    result_.points.frame = frame;
  }

  cell_columns sorted(const execution& exec);

 private:
  struct row_cells {
    std::vector<cell_columns::cell> cells;
    std::vector<cell_columns::column> columns;
  };
  struct entry {
    std::uint64_t key;  // column, then height
    std::uint32_t place;
  };

  /// Parts are taken in groups, since what is counted for each row is counted for each of these.
  static constexpr std::size_t max_groups = 64;

  /// Calls `work(group, part)`, in parallel for groups, in their order for parts.
  template <class Work>
  void for_each_part(const execution& exec, const Work& work) {
    const std::size_t groups = std::min(parts_.size(), max_groups);
    parallel_for(
        exec, "cells", groups,
        [&](std::size_t g) {
          for (std::size_t p = g * parts_.size() / groups; p < (g + 1) * parts_.size() / groups; ++p)
            work(g, parts_[p]);
        },
        1);
  }
  void find_bounds(const execution& exec);
  std::vector<std::uint32_t> sort_into_rows(const execution& exec);
  row_cells sort_row(std::uint32_t begin, std::uint32_t end, std::int32_t row);

  std::vector<local_points> parts_;
  std::size_t rows_ = 0;
  int height_bits_ = 0;  // of the number of the highest cell
  cell_columns::parts result_;
};

/// Finds the corner of the lowest cells, and how many rows and heights there are.
inline void cell_sorter::find_bounds(const execution& exec) {
  constexpr float infinite = std::numeric_limits<float>::infinity();
  struct box {
    float lowest[3] = {infinite, infinite, infinite}, highest[3] = {-infinite, -infinite, -infinite};
    void add(std::size_t axis, float low, float high) {
      lowest[axis] = std::min(lowest[axis], low);
      highest[axis] = std::max(highest[axis], high);
    }
  };
  std::vector<box> of_group(max_groups);
  for_each_part(exec, [&](std::size_t group, const local_points& points) {
    for (const float x : points.x) of_group[group].add(0, x, x);
    for (const float y : points.y) of_group[group].add(1, y, y);
    for (const float z : points.z) of_group[group].add(2, z, z);
  });
  box all;
  for (const box& b : of_group)
    for (std::size_t axis = 0; axis < 3; ++axis) all.add(axis, b.lowest[axis], b.highest[axis]);
  if (all.lowest[0] > all.highest[0]) return;  // no points
  for (std::size_t axis = 0; axis < 3; ++axis)
    result_.corner[axis] = std::floor(double(all.lowest[axis]) / result_.width) * result_.width;
  rows_ = std::size_t(result_.number(all.highest[1], 1)) + 1;
  height_bits_ = static_cast<int>(std::bit_width(std::uint32_t(result_.number(all.highest[2], 2))));
}

/// Moves the points into rows, in their order; returns where each row begins, and where the last one ends.
inline std::vector<std::uint32_t> cell_sorter::sort_into_rows(const execution& exec) {
  std::vector<std::uint32_t> place(max_groups * rows_, 0), first(rows_ + 1, 0);
  for_each_part(exec, [&](std::size_t group, const local_points& points) {
    std::uint32_t* counts = place.data() + group * rows_;
    for (const float y : points.y) ++counts[result_.number(y, 1)];
  });
  std::uint32_t sum = 0;
  for (std::size_t row = 0; row < rows_; ++row) {
    first[row] = sum;
    for (std::size_t group = 0; group < max_groups; ++group)
      sum += std::exchange(place[group * rows_ + row], sum);
  }
  first[rows_] = sum;
  local_points& moved = result_.points;
  moved.resize(sum);
  for_each_part(exec, [&](std::size_t group, local_points& points) {
    std::uint32_t* next = place.data() + group * rows_;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::uint32_t to = next[result_.number(points.y[i], 1)]++;
      moved.x[to] = points.x[i], moved.y[to] = points.y[i], moved.z[to] = points.z[i];
      moved.index[to] = points.index[i];
    }
    points = {};
  });
  return first;
}

/// Sorts the points of a row by column and height. Cells and columns are numbered from the row's first.
inline cell_sorter::row_cells cell_sorter::sort_row(std::uint32_t begin, std::uint32_t end,
                                                    std::int32_t row) {
  local_points& points = result_.points;
  const std::uint64_t heights = (std::uint64_t(1) << height_bits_) - 1;
  std::vector<entry> entries(end - begin), spare;
  for (std::uint32_t i = begin; i < end; ++i)
    entries[i - begin] = {std::uint64_t(result_.number(points.x[i], 0)) << height_bits_ |
                              std::uint64_t(result_.number(points.z[i], 2)),
                          i};
  radix_sort(entries, spare);
  local_points moved;
  moved.resize(entries.size());
  row_cells found;
  std::uint64_t before = std::numeric_limits<std::uint64_t>::max();
  for (std::uint32_t k = 0; k < entries.size(); ++k) {
    const auto& [key, i] = entries[k];
    moved.x[k] = points.x[i], moved.y[k] = points.y[i], moved.z[k] = points.z[i];
    moved.index[k] = points.index[i];
    if (key == before) continue;
    if (key >> height_bits_ != before >> height_bits_)
      found.columns.push_back({static_cast<std::int32_t>(key >> height_bits_), row,
                               static_cast<cell_columns::cell_index>(found.cells.size())});
    found.cells.push_back({static_cast<std::int32_t>(key & heights), begin + k});
    before = key;
  }
  const auto at = static_cast<std::ptrdiff_t>(begin);
  std::copy(moved.x.begin(), moved.x.end(), points.x.begin() + at);
  std::copy(moved.y.begin(), moved.y.end(), points.y.begin() + at);
  std::copy(moved.z.begin(), moved.z.end(), points.z.begin() + at);
  std::copy(moved.index.begin(), moved.index.end(), points.index.begin() + at);
  return found;
}

inline cell_columns cell_sorter::sorted(const execution& exec) {
  find_bounds(exec);
  const std::vector<std::uint32_t> first = sort_into_rows(exec);
  std::vector<row_cells> of_row(rows_);
  parallel_for(
      exec, "cells", rows_,
      [&](std::size_t row) {
        of_row[row] = sort_row(first[row], first[row + 1], static_cast<std::int32_t>(row));
      },
      8);

  std::size_t cells = 0, columns = 0;
  for (const row_cells& row : of_row) cells += row.cells.size(), columns += row.columns.size();
  result_.cells.reserve(cells + 1);
  result_.columns.reserve(columns + 1);
  for (row_cells& row : of_row) {
    result_.rows.push_back(result_.columns.size());
    const auto before = static_cast<cell_columns::cell_index>(result_.cells.size());
    for (cell_columns::column& c : row.columns) c.first += before;
    result_.cells.insert(result_.cells.end(), row.cells.begin(), row.cells.end());
    result_.columns.insert(result_.columns.end(), row.columns.begin(), row.columns.end());
    row = {};
  }
  result_.rows.push_back(result_.columns.size());
  result_.columns.push_back({0, 0, static_cast<cell_columns::cell_index>(result_.cells.size())});
  result_.cells.push_back({0, static_cast<std::uint32_t>(result_.points.size())});
  return cell_columns(std::move(result_));
}

/// Sorts points into cells of `width` [m]. Cost: linear in the points; parallel. Throws
/// `std::invalid_argument` when `width` is not positive. Points more than two million cells from the lowest
/// share the outermost cells.
inline cell_columns sort_into_cells(local_points points, double width, const execution& exec = {}) {
  const local_frame frame = points.frame;
  std::vector<local_points> parts;
  parts.push_back(std::move(points));
  return cell_sorter(std::move(parts), frame, width).sorted(exec);
}
}  // namespace globalmatch::detail
