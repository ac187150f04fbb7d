// Points sorted into cubic cells, cells into columns, columns into rows: what stands near each other lies
// near each other in memory, and neighbours are found without a tree. In: local points. Out: the same,
// sorted.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "globalmatch/execution.hpp"
#include "globalmatch/local_points.hpp"

namespace globalmatch {

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
    double width = 1;                   // [m]
    std::array<double, 3> lowest = {};  // numbers of the lowest cells, from the origin
    local_points points;
    std::vector<cell> cells;
    std::vector<column> columns;
    std::vector<std::size_t> rows;
  };
  static constexpr std::int32_t most = (1 << 21) - 1;  ///< number of the last cell along each axis

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

  /// Calls `visit(begin, end)`, increasing, for the runs of points whose columns lie within `reach` [m] of
  /// (x, y) in plan, in each coordinate: all points nearer than that, and some others.
  template <class Visit>
  void for_each_run_near(double x, double y, double reach, const Visit& visit) const {
    const auto clamped = [](double v) {
      return static_cast<std::int32_t>(std::clamp(v, -1.0, double(most)));
    };
    const auto number = [&](double v, double lowest) {
      return clamped(std::floor(v / parts_.width) - lowest);
    };
    const std::int32_t left = number(x - reach, parts_.lowest[0]),
                       right = number(x + reach, parts_.lowest[0]);
    const std::int32_t top =
        std::min(number(y + reach, parts_.lowest[1]), static_cast<std::int32_t>(rows()) - 1);
    for (std::int32_t row = std::max(number(y - reach, parts_.lowest[1]), 0); row <= top; ++row) {
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
  static constexpr std::int32_t widest = 3;  ///< cells that it reaches

  explicit column_window(const cell_columns& cells) : cells_(cells) {}

  void move_to(std::size_t column) {
    const cell_columns::column& center = cells_.column_at(column);
    const bool along = runs_known_ && center.y == y_ && center.x >= x_;
    x_ = center.x;
    y_ = center.y;
    for (std::int32_t k = 0; k <= 2 * widest; ++k) {
      run& r = runs_[std::size_t(k)];
      if (along) {
        while (r.begin < r.last && cells_.column_at(r.begin).x < x_ - widest) ++r.begin;
        while (r.end < r.last && cells_.column_at(r.end).x <= x_ + widest) ++r.end;
      } else {
        const std::int32_t row = y_ + k - widest;
        const auto [begin, end] = cells_.columns_between(row, x_ - widest, x_ + widest);
        const bool exists = row >= 0 && std::size_t(row) < cells_.rows();
        r = {begin, end, exists ? cells_.columns_end(std::size_t(row)) : end};
      }
    }
    runs_known_ = true;
  }

  /// Calls `visit(column)` for the columns within `reach` cells, increasing.
  template <class Visit>
  void for_each_within(std::int32_t reach, const Visit& visit) const {
    for (std::int32_t k = widest - reach; k <= widest + reach; ++k) {
      const run& r = runs_[std::size_t(k)];
      for (std::size_t c = r.begin; c < r.end; ++c)
        if (std::abs(cells_.column_at(c).x - x_) <= reach) visit(c);
    }
  }

 private:
  struct run {
    std::size_t begin = 0, end = 0, last = 0;  // columns of a row, and where the row ends
  };
  const cell_columns& cells_;
  std::array<run, 2 * widest + 1> runs_ = {};  // of the rows around
  std::int32_t x_ = 0, y_ = 0;
  bool runs_known_ = false;
};

namespace detail {

/// Sorts by key, equal ones as they came; a pass for every 11 bits in which keys differ. `spare` is reused.
template <class Entry>
void radix_sort(std::vector<Entry>& entries, std::vector<Entry>& spare) {
  constexpr unsigned bits = 11;
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

inline namespace GLOBALMATCH_THREADING {

/// Fills `cell_columns`.
class cell_sorter {
 public:
  /// Takes the points over; one row after the other can then be sorted alone.
  cell_sorter(local_points points, double width) {
    if (!(width > 0)) throw std::invalid_argument("cell width must be positive");
    result_.width = width;
    result_.points = std::move(points);
  }

  cell_columns sorted(const execution& how);

 private:
  struct row_cells {
    std::vector<cell_columns::cell> cells;
    std::vector<cell_columns::column> columns;
  };
  struct entry {
    std::uint64_t key;  // column, then height
    std::uint32_t place;
  };

  static constexpr std::size_t chunk = std::size_t(1) << 16;

  std::int32_t number(float v, std::size_t dimension) const {
    const double cell = std::floor(double(v) / result_.width) - result_.lowest[dimension];
    return static_cast<std::int32_t>(std::clamp(cell, 0.0, double(cell_columns::most)));
  }
  void find_lowest(const execution& how);
  std::vector<std::uint32_t> sort_into_rows(const execution& how);
  row_cells sort_row(std::uint32_t begin, std::uint32_t end, std::int32_t row);

  cell_columns::parts result_;
};

inline void cell_sorter::find_lowest(const execution& how) {
  const local_points& points = result_.points;
  if (points.size() == 0) return;
  std::vector<Eigen::Array3f> lowest_of((points.size() + chunk - 1) / chunk);
  parallel_chunks(how, "cells", points.size(), chunk, [&](std::size_t begin, std::size_t end) {
    Eigen::Array3f lowest = points[begin].array();
    for (std::size_t i = begin; i < end; ++i) lowest = lowest.min(points[i].array());
    lowest_of[begin / chunk] = lowest;
  });
  Eigen::Array3f lowest = lowest_of.front();
  for (const Eigen::Array3f& l : lowest_of) lowest = lowest.min(l);
  for (int d = 0; d < 3; ++d) result_.lowest[std::size_t(d)] = std::floor(double(lowest[d]) / result_.width);
}

/// Moves the points into rows, in their order; returns where each row begins, and where the last one ends.
inline std::vector<std::uint32_t> cell_sorter::sort_into_rows(const execution& how) {
  local_points& points = result_.points;
  unset_vector<std::int32_t> row_of(points.size());
  parallel_chunks(how, "cells", points.size(), chunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) row_of[i] = number(points.y[i], 1);
  });
  const std::size_t rows =
      std::size_t(row_of.empty() ? 0 : *std::max_element(row_of.begin(), row_of.end()) + 1);
  const std::size_t chunks = (points.size() + chunk - 1) / chunk;
  std::vector<std::uint32_t> place(chunks * rows, 0), first(rows + 1, 0);
  parallel_chunks(how, "cells", points.size(), chunk, [&](std::size_t begin, std::size_t end) {
    std::uint32_t* counts = place.data() + begin / chunk * rows;
    for (std::size_t i = begin; i < end; ++i) ++counts[row_of[i]];
  });
  std::uint32_t sum = 0;
  for (std::size_t row = 0; row < rows; ++row) {
    first[row] = sum;
    for (std::size_t c = 0; c < chunks; ++c) sum += std::exchange(place[c * rows + row], sum);
  }
  if (rows > 0) first[rows] = sum;
  local_points moved;
  moved.frame = points.frame;
  moved.resize(points.size());
  parallel_chunks(how, "cells", points.size(), chunk, [&](std::size_t begin, std::size_t end) {
    std::uint32_t* next = place.data() + begin / chunk * rows;
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t to = next[row_of[i]]++;
      moved.x[to] = points.x[i], moved.y[to] = points.y[i], moved.z[to] = points.z[i];
      moved.index[to] = points.index[i];
    }
  });
  points = std::move(moved);
  return first;
}

/// Sorts the points of a row by column and height. Cells and columns are numbered from the row's first.
inline cell_sorter::row_cells cell_sorter::sort_row(std::uint32_t begin, std::uint32_t end,
                                                    std::int32_t row) {
  constexpr unsigned height_bits = 21;
  local_points& points = result_.points;
  std::vector<entry> entries(end - begin), spare;
  for (std::uint32_t i = begin; i < end; ++i)
    entries[i - begin] = {
        std::uint64_t(number(points.x[i], 0)) << height_bits | std::uint64_t(number(points.z[i], 2)), i};
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
    if (key >> height_bits != before >> height_bits)
      found.columns.push_back({static_cast<std::int32_t>(key >> height_bits), row,
                               static_cast<cell_columns::cell_index>(found.cells.size())});
    found.cells.push_back({static_cast<std::int32_t>(key & cell_columns::most), begin + k});
    before = key;
  }
  const auto at = static_cast<std::ptrdiff_t>(begin);
  std::copy(moved.x.begin(), moved.x.end(), points.x.begin() + at);
  std::copy(moved.y.begin(), moved.y.end(), points.y.begin() + at);
  std::copy(moved.z.begin(), moved.z.end(), points.z.begin() + at);
  std::copy(moved.index.begin(), moved.index.end(), points.index.begin() + at);
  return found;
}

inline cell_columns cell_sorter::sorted(const execution& how) {
  find_lowest(how);
  const std::vector<std::uint32_t> first = sort_into_rows(how);
  const std::size_t rows = first.size() - 1;
  std::vector<row_cells> of_row(rows);
  parallel_for(
      how, "cells", rows,
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

}  // namespace GLOBALMATCH_THREADING
}  // namespace detail

inline namespace GLOBALMATCH_THREADING {

/// Sorts points into cells of `width` [m]. Cost: linear in the points; parallel. Throws
/// `std::invalid_argument` when `width` is not positive. Points more than two million cells from the lowest
/// share the outermost cells.
inline cell_columns sort_into_cells(local_points points, double width, const execution& how = {}) {
  return detail::cell_sorter(std::move(points), width).sorted(how);
}

}  // namespace GLOBALMATCH_THREADING
}  // namespace globalmatch
