// Points sorted into cubic cells, cells into columns: what stands near each other lies near each other in
// memory, and neighbours are found without a search. In: local points. Out: their order, and the cells.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <vector>

#include "globalmatch/local_points.hpp"
#include "globalmatch/radix_order.hpp"

namespace globalmatch {

/// Occupied cells of a cubic grid, column by column, each from the lowest cell up; columns row by row.
/// Immutable.
class cell_columns {
 public:
  using cell_index = std::uint32_t;
  struct column {
    std::int32_t x, y;  // of its cells
    cell_index first;   // of its cells
  };

  cell_columns() = default;

  /// Cost: linear in the points. Throws `std::invalid_argument` when `width` [m] is not positive. Points more
  /// than two million cells from the lowest ones share the outermost cells.
  cell_columns(const local_points& points, double width) : width_(width) {
    if (!(width > 0)) throw std::invalid_argument("cell_columns: width must be positive");
    if (points.size() == 0) return;
    const auto lowest = [](const std::vector<float>& values) {
      return double(*std::min_element(values.begin(), values.end()));
    };
    const std::array<double, 3> corner = {lowest(points.x), lowest(points.y), lowest(points.z)};
    for (std::size_t d = 0; d < 3; ++d) lowest_[d] = std::floor(corner[d] / width);
    std::vector<std::uint64_t> keys(points.size());
    for (std::size_t i = 0; i < keys.size(); ++i)
      keys[i] = (cell_of(points.y[i], 1) << 42) | (cell_of(points.x[i], 0) << 21) | cell_of(points.z[i], 2);
    order_ = radix_order(keys);
    for (std::size_t k = 0; k < order_.size(); ++k) {
      const std::uint64_t key = keys[order_[k]], before = k > 0 ? keys[order_[k - 1]] : ~key;
      if (key == before) continue;
      if (key >> 21 != before >> 21)
        columns_.push_back({std::int32_t((key >> 21) & most), std::int32_t(key >> 42),
                            static_cast<cell_index>(heights_.size())});
      heights_.push_back(std::int32_t(key & most));
      first_.push_back(static_cast<std::uint32_t>(k));
    }
    first_.push_back(static_cast<std::uint32_t>(order_.size()));
  }

  double width() const { return width_; }
  std::size_t cells() const { return heights_.size(); }
  const std::vector<column>& columns() const { return columns_; }
  /// Number of the cell above the lowest height.
  std::int32_t height(cell_index c) const { return heights_[c]; }
  /// One past the last cell of a column.
  cell_index last(std::size_t column) const {
    return column + 1 < columns_.size() ? columns_[column + 1].first : static_cast<cell_index>(cells());
  }
  /// Points, cell by cell; positions in what the cells were made of.
  const std::vector<std::uint32_t>& order() const { return order_; }
  /// Where the points of a cell begin in `order()`, and where those of the next one do.
  std::uint32_t first_point(cell_index c) const { return first_[c]; }

  /// Calls `visit(column)` for the columns from (x - reach, y - reach) to (x + reach, y + reach) around one.
  /// Cost: a search in each row.
  template <class Visit>
  void for_each_column_around(const column& center, std::int32_t reach, const Visit& visit) const {
    for (std::int32_t y = center.y - reach; y <= center.y + reach; ++y) {
      const auto before = [&](const column& c, std::int32_t x) { return c.y < y || (c.y == y && c.x < x); };
      auto c = std::lower_bound(columns_.begin(), columns_.end(), center.x - reach, before);
      for (; c != columns_.end() && c->y == y && c->x <= center.x + reach; ++c)
        visit(std::size_t(c - columns_.begin()));
    }
  }

  /// Calls `visit(begin, end)` for the runs of `order()` that hold the points within `reach` [m] of (x, y) in
  /// plan, in each coordinate, and some others. Cost: a search in each row.
  template <class Visit>
  void for_each_run_near(double x, double y, double reach, const Visit& visit) const {
    if (columns_.empty()) return;
    const auto low = [&](double v, std::size_t d) { return std::int32_t(cell_of(v - reach, d)); };
    const auto high = [&](double v, std::size_t d) { return std::int32_t(cell_of(v + reach, d)); };
    const std::int32_t left = low(x, 0), right = high(x, 0), top = high(y, 1);
    for (std::int32_t row = low(y, 1); row <= top; ++row) {
      const auto before = [&](const column& c, std::int32_t at) {
        return c.y < row || (c.y == row && c.x < at);
      };
      const auto begin = std::lower_bound(columns_.begin(), columns_.end(), left, before);
      const auto end = std::lower_bound(begin, columns_.end(), right + 1, before);
      if (begin == end) continue;
      visit(first_[begin->first], first_[last(std::size_t(end - columns_.begin()) - 1)]);
    }
  }

 private:
  static constexpr std::uint64_t most = (std::uint64_t(1) << 21) - 1;

  std::uint64_t cell_of(double value, std::size_t dimension) const {
    const double cell = std::floor(value / width_) - lowest_[dimension];
    return static_cast<std::uint64_t>(std::clamp(cell, 0.0, double(most)));
  }

  double width_ = 1;                     // [m]
  std::array<double, 3> lowest_ = {};    // cells from the origin
  std::vector<std::uint32_t> order_;     // points
  std::vector<std::uint32_t> first_;     // points of each cell, in `order_`; one more than cells
  std::vector<std::int32_t> heights_;    // of cells
  std::vector<column> columns_;
};

}  // namespace globalmatch
