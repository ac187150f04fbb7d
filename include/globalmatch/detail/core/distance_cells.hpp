// The stems of a map as each of them sees the others: in cells of distance. In: positions. Out: the stems at
// a distance from one of them. Memory and time: quadratic in the stems.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::detail {

/// Immutable; safe to query from several threads.
class distance_cells {
 public:
  /// `epsilon` [m] is that of the queries; distances are those in plan when `horizontal`.
  distance_cells(const position_set& stems, bool horizontal, double epsilon, const execution& exec = {})
      : size_(stems.size()), epsilon_(epsilon) {
    // A little wider than the tolerance, so that rounding cannot put alike distances two cells apart.
    per_meter_ = 1 / std::max(epsilon * (1 + 1e-9), min_cell);
    vec3 low = size_ > 0 ? stems.at.front() : vec3{}, high = low;
    for (const vec3& p : stems.at)
      for (int axis = 0; axis < 3; ++axis) {
        low[axis] = std::min(low[axis], p[axis]);
        high[axis] = std::max(high[axis], p[axis]);
      }
    cells_ = 1;
    if (size_ > 0) cells_ += 1 + std::size_t(std::min((high - low).norm() * per_meter_, max_cells));
    first_.assign(size_ * (cells_ + 1), 0);
    entries_.resize(size_ * size_);
    near_.assign(size_ * cells_, 0);
    const auto sort_row = [&](std::size_t i) {
      const auto first = std::span(first_).subspan(i * (cells_ + 1), cells_ + 1);
      std::vector<double> distances(size_);
      for (stem_index j = 0; j < size_; ++j) {
        distances[j] = stem_distance(stems.at[i], stems.at[j], horizontal);
        ++first[cell(distances[j])];
      }
      std::uint32_t place = 0;
      for (std::uint32_t& f : first)
        f = place += f;  // where each cell ends; placing makes it where it begins
      for (std::size_t j = size_; j-- > 0;)
        entries_[i * size_ + --first[cell(distances[j])]] = {distances[j], static_cast<stem_index>(j)};
      if (countable(size_))
        for (std::size_t c = 0; c < cells_; ++c) {
          const auto [begin, end] = around(i, c);
          near_[i * cells_ + c] = static_cast<std::int16_t>(end - begin);
        }
    };
    parallel_for(exec, "global matching", size_, sort_row, 16);
  }

  std::size_t size() const { return size_; }
  std::size_t cells() const { return cells_; }
  /// The cell of a distance [m]. Distances that differ by less than the tolerance are in the same one or in
  /// neighbors.
  std::size_t cell(double distance) const {
    return static_cast<std::size_t>(std::min(distance * per_meter_, double(cells_ - 1)));
  }

  /// Calls `visit(j)` for the stems whose distance from stem `i` differs by less than the tolerance.
  template <class Visit>
  void for_each_at(stem_index i, double distance, const Visit& visit) const {
    const auto [begin, end] = around(i, cell(distance));
    const auto row = entries_.begin() + std::ptrdiff_t(i * size_);
    for (auto e = row + begin; e != row + end; ++e)
      if (std::abs(distance - e->distance) < epsilon_) visit(e->stem);
  }

  /// Whether so many stems can be counted in cells.
  static bool countable(std::size_t stems) { return stems <= std::numeric_limits<std::int16_t>::max(); }
  /// For each cell how many stems are in it and its neighbors, as stem `i` sees them: no fewer than
  /// `for_each_at` visits. Zeros when the stems are not countable.
  std::span<const std::int16_t> counts(stem_index i) const {
    return std::span(near_).subspan(i * cells_, cells_);
  }

 private:
  static constexpr double min_cell = 1e-6;    // [m] cells; no scan is more precise
  static constexpr double max_cells = 16000;  // what is further away is in the last

  struct entry {
    double distance;  // [m]
    stem_index stem;
  };
  struct range {
    std::uint32_t begin, end;
  };

  /// Where a cell and its neighbors are in a stem's row.
  range around(std::size_t i, std::size_t cell) const {
    const auto* first = &first_[i * (cells_ + 1)];
    return {first[cell - (cell > 0)], first[std::min(cell + 2, cells_)]};
  }

  std::size_t size_, cells_;
  double epsilon_, per_meter_;
  std::vector<std::uint32_t> first_;  // of each stem's cells, in its row
  std::vector<entry> entries_;        // a row for each stem
  std::vector<std::int16_t> near_;
};

}  // namespace globalmatch::detail
