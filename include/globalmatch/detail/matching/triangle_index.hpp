// The local triangles of a stem map, found by their edge lengths, as star trackers find theirs. In: stem
// positions. Out: for a triangle the congruent ones. Cost: linear in the stems for the index, and
// independent of them for each query.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "globalmatch/detail/core/neighbor.hpp"
#include "globalmatch/detail/core/position_index.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/core/wrapped_grid.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/positions.hpp"
#include "globalmatch/triangles.hpp"

namespace globalmatch::detail {

/// Stems around a stem that make triangles with it in small maps ([GM] 3.2.1: K = 20).
inline constexpr std::size_t exhaustive_neighbors = 20;

/// For every `step`th stem its `count` horizontally nearest, by (distance, index), in one flat array; fewer
/// when the map has fewer. Parallel.
inline std::vector<stem_index> nearest_stems(const position_index& stems, std::size_t count,
                                             const execution& exec = {}, std::size_t step = 1) {
  count = std::min(count, stems.size() - std::min<std::size_t>(stems.size(), 1));
  const std::size_t asking = (stems.size() + step - 1) / step;
  std::vector<stem_index> nearest(asking * count);
  parallel_chunks(exec, "neighbors", asking, 1024, [&](std::size_t begin, std::size_t end) {
    std::vector<neighbor<double>> found;
    for (std::size_t i = begin; i < end; ++i) {
      stems.nearest(i * step, count, found);
      for (std::size_t k = 0; k < count; ++k) nearest[i * count + k] = found[k].index;
    }
  });
  return nearest;
}

/// The triangles that stems of a map make with two of their nearest stems, found by edge lengths.
class triangle_index {
 public:
  triangle_index() = default;

  /// Every `step`th stem makes triangles, with `neighbors` nearest stems. `cell` [m] is the finest tolerance
  /// that is asked for, as a rule.
  triangle_index(const position_set& stems, const position_index& index, bool horizontal,
                 std::size_t neighbors, const execution& exec = {}, std::size_t step = 1,
                 float cell = 0.05f) {
    step = std::max<std::size_t>(step, 1);
    const auto nearest = nearest_stems(index, neighbors, exec, step);
    const std::size_t makers = (stems.size() + step - 1) / step;
    neighbors = makers == 0 ? 0 : nearest.size() / makers;
    if (neighbors < 2) return;
    constexpr std::size_t chunk = 1024, max_parts = 8;
    std::vector<std::vector<triangle_grid::item>> made((makers + chunk - 1) / chunk);
    parallel_chunks(exec, "triangle index", makers, chunk, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const auto maker = static_cast<stem_index>(i * step);
        for_each_own_triangle(nearest, neighbors, step, maker, [&](stem_index a, stem_index b) {
          const triangle t = make_triangle(stems, {maker, a, b}, horizontal);
          made[begin / chunk].push_back({edge_point(t), t.vertices});
        });
      }
    });
    std::size_t count = 0;
    for (const auto& of_chunk : made) count += of_chunk.size();
    const std::size_t parts = std::min({made.size(), std::size_t(thread_count(exec)), max_parts});
    triangles_ = triangle_grid(
        count, cell, parts,
        [&](std::size_t part, std::size_t all, const auto& visit) {
          for (std::size_t c = part * made.size() / all; c < (part + 1) * made.size() / all; ++c)
            for (const triangle_grid::item& i : made[c]) visit(i);
        },
        [&](std::size_t all, const auto& work) { parallel_for(exec, "triangle cells", all, work, 1); });
  }

  std::size_t size() const { return triangles_.size(); }

  /// Calls `visit(vertices)` for the triangles whose edges differ by no more than `epsilon` [m], to the
  /// precision of a float.
  template <class Visit>
  void for_each_like(const triangle& t, double epsilon, const Visit& visit) const {
    triangles_.for_each_near(edge_point(t), float(epsilon), [&](const auto& item) { visit(item.label); });
  }

 private:
  /// Each triangle belongs to the least of its makers that have the other two among their nearest.
  template <class Visit>
  static void for_each_own_triangle(const std::vector<stem_index>& nearest, std::size_t neighbors,
                                    std::size_t step, stem_index maker, const Visit& visit) {
    const auto of = [&](stem_index s) { return std::span(nearest).subspan(s / step * neighbors, neighbors); };
    const auto makes = [&](stem_index s, stem_index a, stem_index b) {
      if (s % step != 0) return false;
      const auto n = of(s);
      return std::find(n.begin(), n.end(), a) != n.end() && std::find(n.begin(), n.end(), b) != n.end();
    };
    const auto own = of(maker);
    for (std::size_t j = 0; j < neighbors; ++j)
      for (std::size_t k = j + 1; k < neighbors; ++k) {
        const stem_index a = own[j], b = own[k];
        if ((a < maker && makes(a, maker, b)) || (b < maker && makes(b, maker, a))) continue;
        visit(a, b);
      }
  }

  triangle_grid triangles_;
};
}  // namespace globalmatch::detail
