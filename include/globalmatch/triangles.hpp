// Triangle construction ([GM] 3.2.1): every stem with each two of its K nearest stems, each triangle once.
// In: stem positions. Out: triangles with canonical vertex order. Parallel over stems.
// Cost: O(n log n + n K^2).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <vector>

#include "globalmatch/detail/core/neighbor.hpp"
#include "globalmatch/detail/core/neighbors.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch {

struct triangle_options {
  int neighbors = 20;  ///< K ([GM] 3.2.1: 20); maps of up to K + 1 stems thus give all their triangles
};

/// Throws `std::invalid_argument` naming the field that makes no sense.
inline void require_valid(const triangle_options& options) {
  if (options.neighbors < 2) throw std::invalid_argument("triangles.neighbors must be at least 2");
}

/// Three stems. Canonical order: the vertex opposite the longest edge first, then counter-clockwise seen from
/// above.
struct triangle {
  std::array<stem_index, 3> vertices;
  std::array<double, 3> edges;  ///< [m] edges[i] lies opposite vertices[i]
  double horizontal_width =
      std::numeric_limits<double>::infinity();  ///< [m] in plan, over the edge longest there
};

/// The triangle of three stems in canonical order; of equal edges the one opposite the lower index counts as
/// longer.
inline triangle make_triangle(const position_set& stems, std::array<stem_index, 3> v, bool horizontal) {
  std::sort(v.begin(), v.end());
  const auto& at = stems.at;
  std::array<double, 3> e = {stem_distance(at[v[1]], at[v[2]], horizontal),
                             stem_distance(at[v[2]], at[v[0]], horizontal),
                             stem_distance(at[v[0]], at[v[1]], horizontal)};
  const auto longest = std::max_element(e.begin(), e.end()) - e.begin();
  std::rotate(v.begin(), v.begin() + longest, v.end());
  std::rotate(e.begin(), e.begin() + longest, e.end());
  const detail::vec3 a = at[v[1]] - at[v[0]], b = at[v[2]] - at[v[0]];
  if (a.x * b.y - a.y * b.x < 0) {
    std::swap(v[1], v[2]);
    std::swap(e[1], e[2]);
  }
  const double longest_horizontally =
      std::max({a.xy().norm(), b.xy().norm(), (a - b).xy().norm()});
  return {v, e,
          longest_horizontally > 0 ? std::abs(a.x * b.y - a.y * b.x) / longest_horizontally : 0};
}

/// Edge lengths [m] as a point that the triangle is found at.
inline std::array<float, 3> edge_point(const triangle& t) {
  return {float(t.edges[0]), float(t.edges[1]), float(t.edges[2])};
}

/// All distinct local triangles, ordered by their sorted vertices. Throws `std::invalid_argument` for options
/// that make no sense, and `operation_cancelled`.
inline std::vector<triangle> build_triangles(const position_set& stems, bool horizontal,
                                             const triangle_options& options = {},
                                             const execution& exec = {}) {
  require_valid(options);
  const std::size_t size = stems.size();
  const std::size_t neighbors =
      std::min(std::size_t(options.neighbors), size - std::min<std::size_t>(size, 1));
  const detail::neighbor_tree<double, 3> tree(size, [&](std::size_t i) {
    return Eigen::Vector3d(stems.at[i].x, stems.at[i].y, horizontal ? 0.0 : stems.at[i].z);
  });
  constexpr std::size_t chunk = 32;
  using triplet = std::array<stem_index, 3>;  // sorted
  std::vector<std::vector<triplet>> found((size + chunk - 1) / chunk);
  detail::parallel_chunks(exec, "triangles", size, chunk, [&](std::size_t begin, std::size_t end) {
    auto& own = found[begin / chunk];
    own.reserve((end - begin) * neighbors * (std::max<std::size_t>(neighbors, 1) - 1) / 2);
    std::vector<detail::neighbor<double>> nearest;
    for (std::size_t i = begin; i < end; ++i) {
      tree.nearest(tree[i], neighbors + 1, nearest);
      std::erase_if(nearest, [&](const detail::neighbor<double>& n) { return n.index == i; });
      nearest.resize(std::min(nearest.size(), neighbors));  // duplicates of stem i may have crowded it out
      for (std::size_t j = 0; j < nearest.size(); ++j)
        for (std::size_t k = j + 1; k < nearest.size(); ++k) {
          triplet t = {static_cast<stem_index>(i), nearest[j].index, nearest[k].index};
          std::sort(t.begin(), t.end());
          own.push_back(t);
        }
    }
  });
  std::vector<std::vector<triplet>> by_least(found.size());  // those of as many stems each
  for (auto& own : found) {
    for (const triplet& t : own) by_least[t[0] / chunk].push_back(t);
    own = {};
  }
  std::vector<std::vector<triangle>> made(by_least.size());
  detail::parallel_for(
      exec, "triangles", by_least.size(),
      [&](std::size_t c) {
        auto& triplets = by_least[c];
        std::sort(triplets.begin(), triplets.end());
        triplets.erase(std::unique(triplets.begin(), triplets.end()), triplets.end());
        made[c].reserve(triplets.size());
        for (const triplet& t : triplets) made[c].push_back(make_triangle(stems, t, horizontal));
      },
      1);
  std::vector<triangle> triangles;
  std::size_t count = 0;
  for (const auto& own : made) count += own.size();
  triangles.reserve(count);
  for (auto& own : made) {
    triangles.insert(triangles.end(), own.begin(), own.end());
    own = {};
  }
  return triangles;
}

/// Calls `visit(triangle)` for every order that the triangle may canonically have in another scan, where
/// edges differ by less than `epsilon` [m]: any vertex opposite an edge within twice the tolerance of the
/// longest may come first, and a triangle flatter than the tolerance, in plan where its sense of rotation is
/// told, may be turned over.
template <class Visit>
void for_each_admissible_order(const triangle& t, double epsilon, const Visit& visit) {
  const bool flat = t.horizontal_width < epsilon;
  for (std::size_t first = 0; first < 3; ++first) {
    if (t.edges[first] <= t.edges[0] - 2 * epsilon) continue;
    const std::size_t second = (first + 1) % 3, third = (first + 2) % 3;
    const auto order = [&](std::size_t i, std::size_t j, std::size_t k) {
      visit(triangle{{t.vertices[i], t.vertices[j], t.vertices[k]},
                     {t.edges[i], t.edges[j], t.edges[k]},
                     t.horizontal_width});
    };
    order(first, second, third);
    if (flat) order(first, third, second);
  }
}

}  // namespace globalmatch
