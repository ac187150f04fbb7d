// Sorts points into the cells of `cell_columns`. Cost: linear in the points; parallel.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/local_frame.hpp"
#include "globalmatch/detail/core/local_points.hpp"
#include "globalmatch/detail/core/sort_by_key.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/mapping/cell_columns.hpp"
#include "globalmatch/execution.hpp"

namespace globalmatch::detail {

/// Fills `cell_columns`.
class cell_sorter {
 public:
  /// Takes the points over, in parts that each may be of any size; one row after the other can then be sorted
  /// alone.
  cell_sorter(parted_points points, const local_frame& frame, double width) : points_(std::move(points)) {
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

  /// Parts are taken in groups, since what is counted for each row is counted for each of these.
  static constexpr std::size_t max_groups = 64;

  /// Calls `work(group, part)`, in parallel for groups, in their order for parts.
  template <class Work>
  void for_each_part(const execution& exec, const Work& work) const {
    const auto& parts = points_.parts;
    const std::size_t groups = std::min(parts.size(), max_groups);
    parallel_for(
        exec, "cells", groups,
        [&](std::size_t g) {
          for (std::size_t p = g * parts.size() / groups; p < (g + 1) * parts.size() / groups; ++p)
            work(g, parts[p]);
        },
        1);
  }
  void find_bounds(const execution& exec);
  std::vector<std::uint32_t> sort_into_rows(const execution& exec);
  row_cells sort_row(std::uint32_t begin, std::uint32_t end, std::int32_t row);

  parted_points points_;
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
  for_each_part(exec, [&](std::size_t group, const parted_points::part& part) {
    const auto add = [&](std::size_t axis, const unset_vector<float>& values) {
      for (std::size_t i = part.begin; i < part.end; ++i) of_group[group].add(axis, values[i], values[i]);
    };
    add(0, part.points->x), add(1, part.points->y), add(2, part.points->z);
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
  for_each_part(exec, [&](std::size_t group, const parted_points::part& part) {
    std::uint32_t* counts = place.data() + group * rows_;
    for (std::size_t i = part.begin; i < part.end; ++i) ++counts[result_.number(part.points->y[i], 1)];
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
  for_each_part(exec, [&](std::size_t group, const parted_points::part& part) {
    const local_points& points = *part.points;
    std::uint32_t* next = place.data() + group * rows_;
    for (std::size_t i = part.begin; i < part.end; ++i) {
      const std::uint32_t to = next[result_.number(points.y[i], 1)]++;
      moved.x[to] = points.x[i], moved.y[to] = points.y[i], moved.z[to] = points.z[i];
      moved.index[to] = points.index[i];
    }
  });
  points_ = {};
  return first;
}

/// Sorts the points of a row by column and height. Cells and columns are numbered from the row's first.
inline cell_sorter::row_cells cell_sorter::sort_row(std::uint32_t begin, std::uint32_t end,
                                                    std::int32_t row) {
  local_points& points = result_.points;
  const std::uint64_t heights = (std::uint64_t(1) << height_bits_) - 1;
  std::vector<keyed_place> entries(end - begin), spare;  // by column, then height
  for (std::uint32_t i = begin; i < end; ++i)
    entries[i - begin] = {std::uint64_t(result_.number(points.x[i], 0)) << height_bits_ |
                              std::uint64_t(result_.number(points.z[i], 2)),
                          i};
  sort_by_key(entries, spare);
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
  return cell_sorter(parted_points(std::move(points)), frame, width).sorted(exec);
}
}  // namespace globalmatch::detail
