// A grid that points are added to one by one. In: points. Out: those in a box.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "globalmatch/detail/core/wrapped_grid.hpp"

namespace globalmatch::detail {

/// Cells are lists in a hash table. Where all points are known beforehand a `wrapped_grid` is faster.
template <class T, std::size_t Dimension, class Label = std::uint32_t>
class growing_grid {
 public:
  using point = std::array<T, Dimension>;
  struct item {
    point at;
    Label label;
  };

  /// `width`: of cells, in the unit of the points.
  explicit growing_grid(T width) : per_unit_(1 / width) {}

  std::size_t size() const { return items_.size(); }

  void add(const item& added) {
    items_.push_back(added);
    next_.push_back(none);
    if (items_.size() > heads_.size())
      rehash();
    else
      link(std::uint32_t(items_.size() - 1));
  }

  /// Calls `visit(item)` for the points within `search_radius` of `center` in every coordinate, each once.
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
    if (items_.empty()) return false;
    cell low, high;
    for (std::size_t d = 0; d < Dimension; ++d) {
      low[d] = index_of(center[d] - search_radius);
      high[d] = index_of(center[d] + search_radius);
    }
    cell c = low;
    while (true) {
      for (std::uint32_t i = heads_[bucket(c)]; i != none; i = next_[i])
        if (cell_of(items_[i].at) == c && is_near(items_[i].at, center, search_radius) && holds(items_[i]))
          return true;
      std::size_t d = 0;
      while (d < Dimension && c[d] == high[d]) c[d] = low[d], ++d;
      if (d == Dimension) return false;
      ++c[d];
    }
  }

 private:
  static constexpr std::uint32_t none = ~std::uint32_t(0);
  using cell = std::array<std::int64_t, Dimension>;

  std::int64_t index_of(T value) const { return std::int64_t(std::floor(value * per_unit_)); }
  cell cell_of(const point& p) const {
    cell c;
    for (std::size_t d = 0; d < Dimension; ++d) c[d] = index_of(p[d]);
    return c;
  }
  std::size_t bucket(const cell& c) const {
    std::uint64_t hash = 0;
    for (const std::int64_t index : c) hash = (hash + std::uint64_t(index)) * 0x9e3779b97f4a7c15u;
    return std::size_t(hash >> 32) & (heads_.size() - 1);
  }
  void link(std::uint32_t i) {
    std::uint32_t& head = heads_[bucket(cell_of(items_[i].at))];
    next_[i] = head;
    head = i;
  }
  void rehash() {
    heads_.assign(std::max<std::size_t>(64, 4 * heads_.size()), none);
    for (std::uint32_t i = 0; i < items_.size(); ++i) link(i);
  }

  T per_unit_;
  std::vector<item> items_;
  std::vector<std::uint32_t> heads_, next_;  // of the buckets, and of each item
};

}  // namespace globalmatch::detail
