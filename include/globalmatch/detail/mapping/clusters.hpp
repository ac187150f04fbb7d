// Euclidean clusters ([GM] 3.1): points joined, directly or through others, by steps shorter than a link
// distance. Cost: O(n log n) and the number of links.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include "globalmatch/detail/core/disjoint_sets.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/mapping/cell_columns.hpp"
#include "globalmatch/detail/mapping/verticality.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/mapping_options.hpp"
#include "globalmatch/points.hpp"

namespace globalmatch::detail {

/// Groups of points in one flat array: cluster c is `members[first[c]] ... members[first[c + 1] - 1]`.
struct point_clusters {
  std::vector<point_index> members;      ///< increasing within each cluster
  std::vector<std::size_t> first = {0};  ///< one more entry than clusters

  std::size_t size() const { return first.size() - 1; }
  std::span<const point_index> operator[](std::size_t c) const {
    return std::span(members).subspan(first[c], first[c + 1] - first[c]);
  }
};

/// Joins cells, directly or through others, by steps of at most as many cells as either's surface extends;
/// only those that may be of a stem. Refers to the cells.
class cell_joiner {
 public:
  using cell_index = cell_columns::cell_index;

  cell_joiner(const cell_columns& cells, const std::vector<cell_surface>& surfaces,
              const verticality_options& options, const execution& exec)
      : cells_(cells), half_widths_(cells.cells()), sets_(cells.cells()) {
    parallel_for(exec, "clusters", cells.cells(), [&](std::size_t c) {
      half_widths_[c] = is_stem_cell(surfaces[c], options) ? surfaces[c].half_width : std::uint8_t(0);
    });
    // Blocks of rows are joined in themselves, each alone, then those that touch along their border.
    constexpr std::size_t rows_a_block = 128, window = column_window::max_half_width;
    parallel_for(
        exec, "clusters", (cells.rows() + rows_a_block - 1) / rows_a_block,
        [&](std::size_t block) { join_rows(block * rows_a_block, (block + 1) * rows_a_block); }, 1);
    for (std::size_t border = rows_a_block; border < cells.rows(); border += rows_a_block)
      join_rows(border - window, border + window);
  }

  /// Clusters of at least `min_points` points, in the order of their first cells.
  point_clusters clusters(std::size_t min_points) {
    const std::vector<point_index>& representatives = sets_.representatives();
    std::vector<std::uint32_t> points_of(cells_.cells(), 0), place(cells_.cells(), 0);
    for (cell_index c = 0; c < cells_.cells(); ++c)
      if (is_of_stem(c)) points_of[representatives[c]] += cells_.points_end(c) - cells_.points_begin(c);
    point_clusters found;
    for (cell_index c = 0; c < cells_.cells(); ++c) {
      if (points_of[c] == 0 || points_of[c] < min_points) continue;
      place[c] = static_cast<std::uint32_t>(found.first.back());
      found.first.push_back(place[c] + points_of[c]);
    }
    found.members.resize(found.first.back());
    for (cell_index c = 0; c < cells_.cells(); ++c) {
      const point_index representative = representatives[c];
      if (!is_of_stem(c) || points_of[representative] < min_points) continue;
      std::uint32_t& next = place[representative];
      for (std::uint32_t p = cells_.points_begin(c); p < cells_.points_end(c); ++p) found.members[next++] = p;
    }
    return found;
  }

 private:
  bool is_of_stem(std::size_t c) const { return half_widths_[c] > 0; }

  /// Joins the cells of some rows among each other.
  void join_rows(std::size_t first_row, std::size_t last_row) {
    const auto first_of_row = [&](std::size_t row) {
      return row < cells_.rows() ? cells_.columns_begin(row) : cells_.columns();
    };
    const std::size_t first = first_of_row(first_row), last = first_of_row(last_row);
    column_window window(cells_);
    for (std::size_t column = first; column < last; ++column) {
      if (column % 1024 == 0) poll_cancelled();
      std::int32_t max_half_width = 0;
      for (cell_index c = cells_.cells_begin(column); c < cells_.cells_end(column); ++c)
        max_half_width = std::max(max_half_width, std::int32_t(half_widths_[c]));
      if (max_half_width == 0) continue;
      window.move_to(column);
      window.for_each_within(max_half_width, 0, [&](std::size_t other) {
        // Cells of equal extent see each other: once is enough.
        if (other >= first && other < last && (max_half_width > 1 || other >= column))
          join_columns(column, other, max_half_width);
      });
    }
  }

  /// Joins the cells of a column to those of another that its cells, of at most `max_half_width`, extend to.
  void join_columns(std::size_t column, std::size_t other, std::int32_t max_half_width) {
    const auto &here = cells_.column_at(column), &there = cells_.column_at(other);
    const std::int32_t away = std::max(std::abs(here.x - there.x), std::abs(here.y - there.y));
    cell_index at = cells_.cells_begin(other);
    const cell_index last = cells_.cells_end(other);
    for (cell_index c = cells_.cells_begin(column); c < cells_.cells_end(column); ++c) {
      const std::int32_t half_width = half_widths_[c], height = cells_[c].height;
      if (half_width == 0 || away > half_width || (half_width == 1 && other < column)) continue;
      while (at < last && cells_[at].height < height - max_half_width) ++at;
      for (cell_index o = at; o < last && cells_[o].height <= height + half_width; ++o)
        if (cells_[o].height >= height - half_width && is_of_stem(o)) sets_.join(c, o);
    }
  }

  const cell_columns& cells_;
  std::vector<std::uint8_t> half_widths_;  // of each cell; 0: not of a stem
  disjoint_sets sets_;
};

/// Clusters of the cells that may be of a stem, of at least `min_points` points each. Members are the points
/// of their cells, positions in `cells.points()`. Cost: linear in the cells.
inline point_clusters cluster_cells(const cell_columns& cells, const std::vector<cell_surface>& surfaces,
                                    const verticality_options& options, std::size_t min_points,
                                    const execution& exec = {}) {
  return cell_joiner(cells, surfaces, options, exec).clusters(min_points);
}

}  // namespace globalmatch::detail
