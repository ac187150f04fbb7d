// Euclidean clusters ([GM] 3.1): points joined, directly or through others, by steps shorter than a link
// distance. Cost: O(n log n) and the number of links.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include "globalmatch/detail/core/local_points.hpp"
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

/// Disjoint sets whose representative is their least member, so that the order of joining does not matter.
class disjoint_sets {
 public:
  explicit disjoint_sets(std::size_t count) : parent_(count) {
    for (std::size_t i = 0; i < count; ++i) parent_[i] = static_cast<point_index>(i);
  }
  point_index find(point_index i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  /// That of each member. It is never greater than any other, so that one pass tells all.
  const std::vector<point_index>& representatives() {
    for (point_index& parent : parent_) parent = parent_[parent];
    return parent_;
  }
  void join(point_index i, point_index j) {
    i = find(i);
    j = find(j);
    if (i < j)
      parent_[j] = i;
    else
      parent_[i] = j;
  }

 private:
  std::vector<point_index> parent_;
};

/// Cells joined, directly or through others, by steps of at most as many cells as either's surface reaches;
/// only those that may be of a stem. Each cluster holds at least `min_points`
/// points; its members are the points of its cells, positions in `cells.points()`. Cost: linear in the cells.
inline point_clusters cluster_cells(const cell_columns& cells, const std::vector<cell_surface>& surfaces,
                                    const verticality_options& options, std::size_t min_points,
                                    const execution& exec = {}) {
  using cell_index = cell_columns::cell_index;
  disjoint_sets sets(cells.cells());
  std::vector<std::uint8_t> half_width_of(cells.cells());  // 0: not of a stem
  parallel_for(exec, "clusters", cells.cells(), [&](std::size_t c) {
    half_width_of[c] = is_stem_cell(surfaces[c], options) ? surfaces[c].half_width : std::uint8_t(0);
  });
  const auto join_around = [&](std::size_t column, std::size_t first_column, std::size_t last_column,
                               column_window& window) {
    std::int32_t max_half_width = 0;
    for (cell_index c = cells.cells_begin(column); c < cells.cells_end(column); ++c)
      max_half_width = std::max(max_half_width, std::int32_t(half_width_of[c]));
    if (max_half_width == 0) return;
    window.move_to(column);
    const auto& here = cells.column_at(column);
    window.for_each_within(max_half_width, 0, [&](std::size_t other) {
      // Cells of equal reach see each other: once is enough.
      if (other < first_column || other >= last_column || (max_half_width == 1 && other < column)) return;
      const auto& there = cells.column_at(other);
      const std::int32_t away = std::max(std::abs(here.x - there.x), std::abs(here.y - there.y));
      cell_index at = cells.cells_begin(other);
      const cell_index last = cells.cells_end(other);
      for (cell_index c = cells.cells_begin(column); c < cells.cells_end(column); ++c) {
        const std::int32_t half_width = half_width_of[c], height = cells[c].height;
        if (half_width == 0 || away > half_width || (half_width == 1 && other < column)) continue;
        while (at < last && cells[at].height < height - max_half_width) ++at;
        for (cell_index o = at; o < last && cells[o].height <= height + half_width; ++o)
          if (cells[o].height >= height - half_width && half_width_of[o] > 0) sets.join(c, o);
      }
    });
  };
  // Blocks of rows are joined in themselves, each alone, then those that touch along their border.
  constexpr std::size_t rows_a_block = 128, window_half_width = column_window::max_half_width;
  const std::size_t blocks = (cells.rows() + rows_a_block - 1) / rows_a_block;
  const auto first_of_row = [&](std::size_t row) {
    return row < cells.rows() ? cells.columns_begin(row) : cells.columns();
  };
  parallel_for(
      exec, "clusters", blocks,
      [&](std::size_t block) {
        column_window window(cells);
        const std::size_t first = first_of_row(block * rows_a_block),
                          last = first_of_row((block + 1) * rows_a_block);
        for (std::size_t column = first; column < last; ++column) join_around(column, first, last, window);
      },
      1);
  column_window window(cells);
  for (std::size_t border = rows_a_block; border < cells.rows(); border += rows_a_block) {
    const std::size_t first = first_of_row(border - window_half_width),
                      last = first_of_row(border + window_half_width);
    for (std::size_t column = first; column < last; ++column) join_around(column, first, last, window);
  }

  const std::vector<point_index>& representatives = sets.representatives();
  std::vector<std::uint32_t> points_of(cells.cells(), 0), place(cells.cells(), 0);
  for (cell_index c = 0; c < cells.cells(); ++c)
    if (half_width_of[c] > 0) points_of[representatives[c]] += cells.points_end(c) - cells.points_begin(c);
  point_clusters clusters;
  for (cell_index c = 0; c < cells.cells(); ++c) {
    if (points_of[c] == 0 || points_of[c] < min_points) continue;
    place[c] = static_cast<std::uint32_t>(clusters.first.back());
    clusters.first.push_back(place[c] + points_of[c]);
  }
  clusters.members.resize(clusters.first.back());
  for (cell_index c = 0; c < cells.cells(); ++c) {
    const point_index representative = representatives[c];
    if (half_width_of[c] == 0 || points_of[representative] < min_points) continue;
    std::uint32_t& next = place[representative];
    for (std::uint32_t p = cells.points_begin(c); p < cells.points_end(c); ++p) clusters.members[next++] = p;
  }
  return clusters;
}

}  // namespace globalmatch::detail
