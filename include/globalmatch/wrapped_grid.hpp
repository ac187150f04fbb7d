// A grid over points of two or three dimensions that wraps around, so that its size follows from the number
// of points and not from how far apart they lie. In: points. Out: those in a box, in order of their cells.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace globalmatch {

/// Immutable; safe to query from several threads. Built in O(n); a query looks at the points of the box's
/// cells and at those that far away places have wrapped onto them.
template <class T, std::size_t Dimension>
class wrapped_grid {
 public:
  using point = std::array<T, Dimension>;
  struct item {
    point at;
    std::uint32_t index;
  };

  wrapped_grid() = default;

  /// `at(i)` returns point i of `count` as a `point`; `cell` is the width of cells in the unit of the points.
  template <class At>
  wrapped_grid(std::size_t count, T cell, const At& at) : per_unit_(1 / cell) {
    while ((std::size_t(1) << (bits_ * Dimension)) < count / 2 && (bits_ + 1) * Dimension <= 30) ++bits_;
    std::vector<std::uint32_t> cell_of(count);
    first_.assign((std::size_t(1) << (bits_ * Dimension)) + 1, 0);
    for (std::size_t i = 0; i < count; ++i) {
      std::array<std::int64_t, Dimension> c;
      const point p = at(i);
      for (std::size_t d = 0; d < Dimension; ++d) c[d] = cell_index(p[d]);
      cell_of[i] = bucket(c);
      ++first_[cell_of[i] + 1];
    }
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    items_.resize(count);
    std::vector<std::uint32_t> place(first_.begin(), first_.end() - 1);
    for (std::uint32_t i = 0; i < count; ++i) items_[place[cell_of[i]]++] = {at(i), i};
  }

  std::size_t size() const { return items_.size(); }

  /// Points in the cell of a point, on average over the points: few where the width of cells suits them.
  double crowding() const {
    double squares = 0;
    for (std::size_t b = 0; b + 1 < first_.size(); ++b)
      squares += std::pow(double(first_[b + 1] - first_[b]), 2);
    return items_.empty() ? 0 : squares / double(items_.size());
  }

  /// Calls `visit(item)` for the points within `reach` of `center` in every coordinate, each once; the order
  /// depends on the points alone.
  template <class Visit>
  void for_each_near(const point& center, T reach, const Visit& visit) const {
    any_near(center, reach, [&](const item& i) {
      visit(i);
      return false;
    });
  }

  /// Whether `holds(item)` for one of them; the others are not looked at.
  template <class Holds>
  bool any_near(const point& center, T reach, const Holds& holds) const {
    std::array<std::int64_t, Dimension> low, high;
    for (std::size_t d = 0; d < Dimension; ++d) {
      low[d] = cell_index(center[d] - reach);
      high[d] = std::min(cell_index(center[d] + reach), low[d] + (std::int64_t(1) << bits_) - 1);
    }
    const std::int64_t mask = (std::int64_t(1) << bits_) - 1;
    const auto in_buckets = [&](std::uint32_t first, std::uint32_t last) {
      for (std::uint32_t k = first_[first]; k < first_[last + 1]; ++k)
        if (is_near(items_[k].at, center, reach) && holds(items_[k])) return true;
      return false;
    };
    std::array<std::int64_t, Dimension> c = low;
    while (true) {
      c[0] = low[0];
      const std::uint32_t begin = bucket(c);
      c[0] = high[0];
      const std::uint32_t end = bucket(c);
      if (begin <= end) {
        if (in_buckets(begin, end)) return true;
      } else {  // the row of cells wraps around
        if (in_buckets(begin, begin | static_cast<std::uint32_t>(mask))) return true;
        if (in_buckets(end & ~static_cast<std::uint32_t>(mask), end)) return true;
      }
      std::size_t d = 1;
      while (d < Dimension && c[d] == high[d]) c[d] = low[d], ++d;
      if (d == Dimension) return false;
      ++c[d];
    }
  }

 private:
  std::int64_t cell_index(T value) const {
    constexpr T far = T(1e15);  // beyond any map, within any integer
    const T cells = std::clamp(value * per_unit_, -far, far);
    const auto towards_zero = static_cast<std::int64_t>(cells);  // `std::floor` may be a call
    return towards_zero - (cells < T(towards_zero));
  }

  std::uint32_t bucket(const std::array<std::int64_t, Dimension>& c) const {
    const std::int64_t mask = (std::int64_t(1) << bits_) - 1;
    std::int64_t b = 0;
    for (std::size_t d = Dimension; d-- > 0;) b = (b << bits_) | (c[d] & mask);
    return static_cast<std::uint32_t>(b);
  }

  static bool is_near(const point& p, const point& center, T reach) {
    bool near = true;
    for (std::size_t d = 0; d < Dimension; ++d) near &= std::abs(p[d] - center[d]) <= reach;
    return near;
  }

  T per_unit_ = 1;
  unsigned bits_ = 0;                          // of the cell number in each dimension
  std::vector<std::uint32_t> first_ = {0, 0};  // where each cell's items begin
  std::vector<item> items_;
};

}  // namespace globalmatch
