// A grid over points of two or three dimensions that wraps around, so that its size follows from the number
// of points and not from how far apart they lie. In: points. Out: those in a box, in order of their cells.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

namespace globalmatch::detail {

/// Whether a point is within `radius` of `center` in every coordinate.
template <class T, std::size_t Dimension>
bool is_near(const std::array<T, Dimension>& p, const std::array<T, Dimension>& center, T radius) {
  bool near = true;
  for (std::size_t d = 0; d < Dimension; ++d) near &= std::abs(p[d] - center[d]) <= radius;
  return near;
}

/// Immutable; safe to query from several threads. A query looks at the points of the box's cells and at those
/// that far away places have wrapped onto them.
template <class T, std::size_t Dimension, class Label = std::uint32_t>
class wrapped_grid {
 public:
  using point = std::array<T, Dimension>;
  struct item {
    point at;
    Label label;
  };

  wrapped_grid() = default;

  /// Points in parts that may be sorted into cells at the same time. `cell` is the width of cells in the unit
  /// of the points, of which there are `count`. `for_each_of(part, parts, visit)` calls `visit(item)` for
  /// those of a part, the same twice. `run(parts, work)` calls `work(part)` for each. In a cell items keep
  /// their order, whatever the parts. Throws `std::length_error` for 2^32 points or more. Cost: O(count);
  /// counting needs another 4 bytes for each cell and part, and parts are fewer where that is more than the
  /// points need.
  template <class ForEachOf, class Run>
  wrapped_grid(std::size_t count, T cell, std::size_t parts, const ForEachOf& for_each_of, const Run& run)
      : per_unit_(1 / std::clamp(cell, min_cell, max_cell)) {
    if (count > std::numeric_limits<std::uint32_t>::max())
      throw std::length_error("a grid holds at most 2^32 - 1 points");
    while ((std::size_t(1) << (bits_ * Dimension)) < count / 2 && (bits_ + 1) * Dimension <= 30) ++bits_;
    const std::size_t cells = std::size_t(1) << (bits_ * Dimension);
    parts = std::min(parts, std::max<std::size_t>(1, count * sizeof(item) / (cells * sizeof(std::uint32_t))));
    std::vector<std::vector<std::uint32_t>> places(parts);  // counts first, then where items go
    run(parts, [&](std::size_t part) {
      places[part].assign(cells, 0);
      for_each_of(part, parts, [&](const item& i) { ++places[part][bucket(i.at)]; });
    });
    first_.assign(cells + 1, 0);
    std::uint32_t place = 0;
    for (std::size_t c = 0; c < cells; ++c) {
      for (auto& of_part : places) place += std::exchange(of_part[c], place);
      first_[c + 1] = place;
    }
    items_.reset(new item[count]);  // not filled with zeros: each part touches its own memory first
    run(parts, [&](std::size_t part) {
      for_each_of(part, parts, [&](const item& i) { items_[places[part][bucket(i.at)]++] = i; });
    });
  }

  /// `item_of(i)` returns item i of `count`.
  template <class ItemOf>
  wrapped_grid(std::size_t count, T cell, const ItemOf& item_of)
      : wrapped_grid(
            count, cell, 1,
            [&](std::size_t, std::size_t, const auto& visit) {
              for (std::size_t i = 0; i < count; ++i) visit(item_of(i));
            },
            [](std::size_t, const auto& work) { work(0); }) {}

  std::size_t size() const { return first_.empty() ? 0 : first_.back(); }

  /// Points in the cell of a point, on average over the points: few where the width of cells suits them.
  double mean_occupancy() const {
    double squares = 0;
    for (std::size_t b = 0; b + 1 < first_.size(); ++b)
      squares += std::pow(double(first_[b + 1] - first_[b]), 2);
    return size() == 0 ? 0 : squares / double(size());
  }

  /// Calls `visit(item)` for the points within `search_radius` of `center` in every coordinate, each once;
  /// the order depends on the points alone.
  template <class Visit>
  void for_each_near(const point& center, T search_radius, const Visit& visit) const {
    any_near(center, search_radius, [&](const item& i) {
      visit(i);
      return false;
    });
  }

  /// Whether `holds(item)` for one of them; the others are not looked at.
  template <class Holds>
  bool any_near(const point& center, T search_radius, const Holds& holds) const {
    if (size() == 0) return false;
    std::array<std::int64_t, Dimension> low, high;
    for (std::size_t d = 0; d < Dimension; ++d) {
      low[d] = cell_index(center[d] - search_radius);
      high[d] = std::min(cell_index(center[d] + search_radius), low[d] + (std::int64_t(1) << bits_) - 1);
    }
    const std::int64_t mask = (std::int64_t(1) << bits_) - 1;
    const auto in_buckets = [&](std::uint32_t first, std::uint32_t last) {
      for (std::uint32_t k = first_[first]; k < first_[last + 1]; ++k)
        if (is_near(items_[k].at, center, search_radius) && holds(items_[k])) return true;
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
  static constexpr T min_cell = T(1e-6), max_cell = T(1e6);  // cells; others would not be faster

  std::int64_t cell_index(T value) const {
    constexpr T far = T(1e15);  // beyond any map, within any integer
    const T cells = std::clamp(value * per_unit_, -far, far);
    const auto towards_zero = static_cast<std::int64_t>(cells);  // `std::floor` may be a call
    return towards_zero - (cells < T(towards_zero));
  }

  std::uint32_t bucket(const point& p) const {
    std::array<std::int64_t, Dimension> c;
    for (std::size_t d = 0; d < Dimension; ++d) c[d] = cell_index(p[d]);
    return bucket(c);
  }

  std::uint32_t bucket(const std::array<std::int64_t, Dimension>& c) const {
    const std::int64_t mask = (std::int64_t(1) << bits_) - 1;
    std::int64_t b = 0;
    for (std::size_t d = Dimension; d-- > 0;) b = (b << bits_) | (c[d] & mask);
    return static_cast<std::uint32_t>(b);
  }

  T per_unit_ = 1;
  unsigned bits_ = 0;                          // of the cell number in each dimension
  std::vector<std::uint32_t> first_ = {0, 0};  // where each cell's items begin
  std::shared_ptr<item[]> items_;
};

/// Three indices each, such as vertices, found by the edge lengths [m].
using triangle_grid = wrapped_grid<float, 3, std::array<std::uint32_t, 3>>;

}  // namespace globalmatch::detail
