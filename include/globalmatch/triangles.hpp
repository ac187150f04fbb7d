// Triangle construction ([GM] 3.2.1): every stem with each two of its K nearest stems, each triangle once.
// In: stem positions. Out: triangles with canonical vertex order. Parallel over stems. Cost: O(n K^2).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/keyed_sort.hpp"
#include "globalmatch/detail/core/position_index.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch {

/// Which triangles of stems are built ([GM] 3.2.1).
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
  std::array<stem_index, 3> vertices;  ///< indices of stems
  std::array<double, 3> edges;         ///< [m] edges[i] lies opposite vertices[i]
  double horizontal_width =
      std::numeric_limits<double>::infinity();  ///< [m] horizontal, over the edge longest there
};

namespace detail {

/// The triangle of three stems in canonical order; of equal edges the one opposite the lower index counts as
/// longer.
inline triangle make_triangle(const position_set& stems, std::array<stem_index, 3> v, bool horizontal) {
  if (v[1] < v[0]) std::swap(v[0], v[1]);
  if (v[2] < v[1]) std::swap(v[1], v[2]);
  if (v[1] < v[0]) std::swap(v[0], v[1]);
  const auto& at = stems.at;
  const std::array<double, 3> e = {stem_distance(at[v[1]], at[v[2]], horizontal),
                                   stem_distance(at[v[2]], at[v[0]], horizontal),
                                   stem_distance(at[v[0]], at[v[1]], horizontal)};
  std::size_t i = e[1] > e[0] ? 1 : 0;
  if (e[2] > e[i]) i = 2;
  std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
  const vec3 a = at[v[j]] - at[v[i]], b = at[v[k]] - at[v[i]];
  const double doubled_area = a.x * b.y - a.y * b.x;
  if (doubled_area < 0) std::swap(j, k);
  const double longest_horizontally = std::max(std::max(a.xy().norm(), b.xy().norm()), (a - b).xy().norm());
  return {{v[i], v[j], v[k]},
          {e[i], e[j], e[k]},
          longest_horizontally > 0 ? std::abs(doubled_area) / longest_horizontally : 0};
}

/// Edge lengths [m] as a point that the triangle is found at.
inline std::array<float, 3> edge_point(const triangle& t) {
  return {float(t.edges[0]), float(t.edges[1]), float(t.edges[2])};
}

/// The stems nearest to stem `i` by (distance, index), at most `count`, not itself. `found` is reused memory.
inline void nearest_to(const position_set& stems, const position_index& index, std::size_t i,
                       std::size_t count, bool horizontal, std::vector<keyed>& found) {
  const vec3& center = stems.at[i];
  count = std::min(count, stems.size() - 1);
  found.clear();
  for (double radius = 1.5 * index.spacing(); found.size() < count; radius *= 2) {
    found.clear();
    index.for_each_within(center.x, center.y, radius, [&](stem_index j, double squared) {
      const double height = horizontal ? 0 : center.z - stems.at[j].z;
      squared += height * height;
      if (j != i && squared < radius * radius) found.push_back({key_of(squared), j});
    });
  }
  keep_first(found, count);
}

/// Sorts triangles of stems, increasing each, and removes those that are there twice.
inline void keep_distinct(std::vector<keyed>& triplets) {
  sort_keyed(triplets);
  std::size_t kept = 0;
  for (const keyed& t : triplets)
    if (kept == 0 || triplets[kept - 1] < t) triplets[kept++] = t;
  triplets.resize(kept);
}

/// A triangle in all orders that it may canonically have in another scan, at most six.
struct triangle_orders {
  std::array<triangle, 6> all;
  std::size_t count = 0;

  const triangle* begin() const { return all.data(); }
  const triangle* end() const { return all.data() + count; }
};

/// Where edges differ by less than `epsilon` [m] any vertex opposite an edge within twice that of the longest
/// may come first, and a triangle flatter than that, horizontally, where its sense of rotation is determined,
/// may be turned over.
inline triangle_orders admissible_orders(const triangle& t, double epsilon) {
  triangle_orders orders;
  const bool flat = t.horizontal_width < epsilon;
  const auto add = [&](std::size_t i, std::size_t j, std::size_t k) {
    orders.all[orders.count++] = {{t.vertices[i], t.vertices[j], t.vertices[k]},
                                  {t.edges[i], t.edges[j], t.edges[k]},
                                  t.horizontal_width};
  };
  for (std::size_t first = 0; first < 3; ++first) {
    if (t.edges[first] <= t.edges[0] - 2 * epsilon) continue;
    const std::size_t second = (first + 1) % 3, third = (first + 2) % 3;
    add(first, second, third);
    if (flat) add(first, third, second);
  }
  return orders;
}

}  // namespace detail

/// All distinct local triangles, ordered by their sorted vertices. Throws `std::invalid_argument` for options
/// that make no sense, and `operation_cancelled`.
inline std::vector<triangle> build_triangles(const position_set& stems, bool horizontal,
                                             const triangle_options& options = {},
                                             const execution& exec = {}) {
  using namespace detail;
  require_valid(options);
  constexpr std::size_t chunk = 32;
  const std::size_t size = stems.size();
  const position_index index(stems, exec);
  std::vector<std::vector<keyed>> found((size + chunk - 1) / chunk);  // sorted vertices
  parallel_chunks(exec, "triangles", size, chunk, [&](std::size_t begin, std::size_t end) {
    std::vector<keyed> nearest;
    for (std::size_t i = begin; i < end; ++i) {
      nearest_to(stems, index, i, std::size_t(options.neighbors), horizontal, nearest);
      for (std::size_t j = 0; j < nearest.size(); ++j)
        for (std::size_t k = j + 1; k < nearest.size(); ++k) {
          stem_index a = stem_index(i), b = stem_index(nearest[j].value), c = stem_index(nearest[k].value);
          if (b < a) std::swap(a, b);
          if (c < b) std::swap(b, c);
          if (b < a) std::swap(a, b);
          found[begin / chunk].push_back({key_of(a, b), c});
        }
    }
  });
  std::vector<std::vector<keyed>> by_least(found.size());  // those of as many stems each
  for (auto& own : found) {
    for (const keyed& t : own) by_least[first_of(t.key) / chunk].push_back(t);
    own = {};
  }
  const auto make = [&](std::size_t c, std::size_t) { keep_distinct(by_least[c]); };
  parallel_chunks(exec, "triangles", by_least.size(), 1, make);
  std::vector<std::size_t> first(by_least.size() + 1, 0);
  for (std::size_t c = 0; c < by_least.size(); ++c) first[c + 1] = first[c] + by_least[c].size();
  std::vector<triangle> triangles(first.back());
  const auto fill = [&](std::size_t c, std::size_t) {
    triangle* out = triangles.data() + first[c];
    for (const keyed& t : by_least[c])
      *out++ = make_triangle(stems, {first_of(t.key), second_of(t.key), stem_index(t.value)}, horizontal);
    by_least[c] = {};
  };
  parallel_chunks(exec, "triangles", by_least.size(), 1, fill);
  return triangles;
}

}  // namespace globalmatch
