// The points of a cluster in narrow columns: stems are looked for in those that fill most height.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

#include "globalmatch/detail/core/local_points.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/points.hpp"

namespace globalmatch::detail {

constexpr double height_bin = 0.1;  // [m]

/// The greatest whole number not above v. (`std::floor` is a call where processors need not have an
/// instruction for it.)
inline std::int32_t whole_number(double v) {
  const auto toward_zero = static_cast<std::int32_t>(v);
  return toward_zero - (v < toward_zero);
}

/// The height bin of z as one of 64 bits. Bins repeat every 6.4 m, which is more than a stem shows in the
/// understory, so that clusters may climb a slope of any height.
inline std::uint64_t height_bit(double z) {
  return std::uint64_t(1) << (whole_number(z / height_bin) & 63);
}

/// A horizontal rectangle [m].
struct rectangle {
  vec2 low, high;

  rectangle widened(double by) const { return {low - vec2{by, by}, high + vec2{by, by}}; }
};
inline rectangle square_about(const vec2& center, double half) {
  return rectangle{center, center}.widened(half);
}

/// The points of a cluster in narrow columns, and which of them fill most height.
class column_raster {
 public:
  /// `members` must come column by column, as points in cells do.
  column_raster(const local_points& points, std::span<const point_index> members, double column_width)
      : members_(members), cell_(column_width / (2 * search_radius + 1)) {
    for (std::uint32_t k = 0; k < members.size(); ++k) {
      const point_index i = members[k];
      const auto x = whole_number(points.x[i] / cell_);
      const auto y = whole_number(points.y[i] / cell_);
      if (columns_.empty() || columns_.back().x != x || columns_.back().y != y) columns_.push_back({y, x, k});
      columns_.back().end = k + 1;
      columns_.back().filled |= height_bit(points.z[i]);
    }
    // With other cells than those the points are sorted by a column may come in several parts.
    std::sort(columns_.begin(), columns_.end());
    for (std::size_t c = 0; c < columns_.size(); ++c)
      rows_.resize(std::size_t(columns_[c].y - columns_.front().y) + 1, c);
    rows_.push_back(columns_.size());
    for (column& c : columns_) update(c);
  }

  struct place {
    vec2 center;
    int bins;
  };

  /// Middle of the column that fills most height bins, and how many.
  std::optional<place> densest() const {
    const auto best = std::max_element(columns_.begin(), columns_.end(),
                                       [](const column& a, const column& b) { return a.bins < b.bins; });
    if (best == columns_.end() || best->bins == 0) return std::nullopt;
    return place{{(best->x + 0.5) * cell_, (best->y + 0.5) * cell_}, best->bins};
  }

  /// How many points are left in the columns of a box.
  std::size_t count_in(const rectangle& box) const {
    std::size_t count = 0;
    for_each_column(box, [&](const column& c) {
      if (c.filled != 0) count += c.end - c.begin;
    });
    return count;
  }
  /// Calls `visit(member)` for every so many of them.
  template <class Visit>
  void for_each_in(const rectangle& box, std::size_t step, const Visit& visit) const {
    std::size_t skip = 0;
    for_each_column(box, [&](const column& c) {
      if (c.filled == 0) return;
      std::size_t k = c.begin + skip;
      for (; k < c.end; k += step) visit(members_[k]);
      skip = k - c.end;
    });
  }

  /// Takes out the columns of a box whose middle is such that `gone(x, y)`.
  template <class Gone>
  void remove(const rectangle& box, const Gone& gone) {
    for_each_column(box, [&](const column& c) {
      if (gone((c.x + 0.5) * cell_, (c.y + 0.5) * cell_)) const_cast<column&>(c).filled = 0;
    });
    for_each_column(box.widened(search_radius * cell_),
                    [&](const column& c) { update(const_cast<column&>(c)); });
  }

 private:
  static constexpr std::int32_t search_radius = 2;
  struct column {
    std::int32_t y, x;
    std::uint32_t begin, end = 0;
    std::uint64_t filled = 0;  // height bins
    int bins = 0;              // that it and those within reach fill
    bool operator<(const column& o) const { return std::tie(y, x, begin) < std::tie(o.y, o.x, o.begin); }
  };

  template <class Visit>
  void for_each_between(std::int32_t left, std::int32_t right, std::int32_t low, std::int32_t high,
                        const Visit& visit) const {
    if (columns_.empty()) return;
    const std::int32_t first = columns_.front().y;
    for (std::int32_t row = std::max(low, first); row <= std::min(high, columns_.back().y); ++row) {
      const auto begin = columns_.begin() + std::ptrdiff_t(rows_[std::size_t(row - first)]);
      const auto end = columns_.begin() + std::ptrdiff_t(rows_[std::size_t(row - first) + 1]);
      auto c = std::lower_bound(begin, end, left, [](const column& a, std::int32_t x) { return a.x < x; });
      for (; c != end && c->x <= right; ++c) visit(*c);
    }
  }
  template <class Visit>
  void for_each_column(const rectangle& box, const Visit& visit) const {
    const auto number = [&](double v) { return whole_number(v / cell_); };
    for_each_between(number(box.low.x), number(box.high.x), number(box.low.y), number(box.high.y), visit);
  }
  void update(column& c) {
    std::uint64_t around = 0;
    if (c.filled != 0)
      for_each_between(c.x - search_radius, c.x + search_radius, c.y - search_radius, c.y + search_radius,
                       [&](const column& other) { around |= other.filled; });
    c.bins = std::popcount(around);
  }

  std::span<const point_index> members_;
  double cell_;
  std::vector<column> columns_;    // row by row
  std::vector<std::size_t> rows_;  // where each begins, and the last one ends
};

}  // namespace globalmatch::detail
