// The local triangles of a stem map, findable by their edge lengths, as star trackers find theirs. In: stem
// positions. Out: for a triangle those that look alike. Cost: linear in the stems for the index, and
// independent of them for each query.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "globalmatch/execution.hpp"
#include "globalmatch/neighbors.hpp"
#include "globalmatch/plan_index.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/position_set.hpp"
#include "globalmatch/triangles.hpp"
#include "globalmatch/wrapped_grid.hpp"

namespace globalmatch {

inline namespace GLOBALMATCH_THREADING {

/// For each stem its `count` nearest in plan, by (distance, index), in one flat array; fewer when the map has
/// fewer. Parallel.
inline std::vector<stem_index> nearest_stems(const plan_index& stems, std::size_t count,
                                             const execution& how = {}) {
  count = std::min(count, stems.size() - std::min<std::size_t>(stems.size(), 1));
  std::vector<stem_index> nearest(stems.size() * count);
  parallel_chunks(how, "neighbors", stems.size(), 1024, [&](std::size_t begin, std::size_t end) {
    std::vector<neighbor<double>> found;
    for (std::size_t i = begin; i < end; ++i) {
      stems.nearest(i, count, found);
      for (std::size_t k = 0; k < count; ++k) nearest[i * count + k] = found[k].index;
    }
  });
  return nearest;
}

/// The triangles that each stem of a map makes with two of its nearest stems, findable by edge lengths.
class triangle_index {
 public:
  triangle_index() = default;

  /// `neighbors` nearest stems of each stem are looked at.
  triangle_index(const position_set& stems, const plan_index& plan, bool horizontal, std::size_t neighbors,
                 const execution& how = {}) {
    const auto nearest = nearest_stems(plan, neighbors, how);
    neighbors = stems.size() == 0 ? 0 : nearest.size() / stems.size();
    if (neighbors < 2) return;
    constexpr std::size_t chunk = 1024;
    struct made {
      std::vector<std::array<stem_index, 3>> vertices;
      std::vector<std::array<float, 3>> edges;
    };
    std::vector<made> of_chunk((stems.size() + chunk - 1) / chunk);
    parallel_chunks(how, "triangle index", stems.size(), chunk, [&](std::size_t begin, std::size_t end) {
      made& own = of_chunk[begin / chunk];
      for (auto i = static_cast<stem_index>(begin); i < end; ++i)
        for_each_own_triangle(nearest, neighbors, i, [&](stem_index a, stem_index b) {
          const triangle t = make_triangle(stems, {i, a, b}, horizontal);
          own.vertices.push_back(t.vertices);
          own.edges.push_back({float(t.edges[0]), float(t.edges[1]), float(t.edges[2])});
        });
    });
    std::size_t count = 0;
    for (const made& own : of_chunk) count += own.vertices.size();
    vertices_.reserve(count);
    std::vector<std::array<float, 3>> edges;
    edges.reserve(count);
    for (made& own : of_chunk) {
      vertices_.insert(vertices_.end(), own.vertices.begin(), own.vertices.end());
      edges.insert(edges.end(), own.edges.begin(), own.edges.end());
      own = {};
    }
    constexpr float cell = 0.2f;  // [m]
    grid_ = wrapped_grid<float, 3>(count, cell, [&](std::size_t i) { return edges[i]; });
  }

  std::size_t size() const { return vertices_.size(); }

  /// Calls `visit(vertices)` for the triangles whose edges differ by less than `tolerance` [m].
  template <class Visit>
  void for_each_like(const triangle& t, double tolerance, const Visit& visit) const {
    if (vertices_.empty()) return;
    grid_.for_each_near({float(t.edges[0]), float(t.edges[1]), float(t.edges[2])}, float(tolerance),
                        [&](const auto& item) { visit(vertices_[item.index]); });
  }

 private:
  /// Each triangle belongs to the least of the stems that have the other two among their nearest.
  template <class Visit>
  static void for_each_own_triangle(const std::vector<stem_index>& nearest, std::size_t neighbors,
                                    stem_index i, const Visit& visit) {
    const auto of = [&](stem_index s) { return std::span(nearest).subspan(s * neighbors, neighbors); };
    const auto knows = [&](stem_index s, stem_index a, stem_index b) {
      const auto n = of(s);
      return std::find(n.begin(), n.end(), a) != n.end() && std::find(n.begin(), n.end(), b) != n.end();
    };
    const auto own = of(i);
    for (std::size_t j = 0; j < neighbors; ++j)
      for (std::size_t k = j + 1; k < neighbors; ++k) {
        const stem_index a = own[j], b = own[k];
        if ((a < i && knows(a, i, b)) || (b < i && knows(b, i, a))) continue;
        visit(a, b);
      }
  }

  std::vector<std::array<stem_index, 3>> vertices_;
  wrapped_grid<float, 3> grid_;
};

}  // namespace GLOBALMATCH_THREADING
}  // namespace globalmatch
