// Triangle construction ([GM] 3.2.1): every stem with each two of its K nearest stems, each triangle once.
// In: stem positions. Out: triangles with canonical vertex order. Cost: O(n log n + n K^2).
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <tuple>
#include <vector>

#include "globalmatch/neighbors.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/position_set.hpp"

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
  std::array<double, 3> edges;                                   ///< [m] edges[i] lies opposite vertices[i]
  double plan_height = std::numeric_limits<double>::infinity();  ///< [m] in plan, over the edge longest there
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
  const Eigen::Vector3d a = at[v[1]] - at[v[0]], b = at[v[2]] - at[v[0]];
  if (a.x() * b.y() - a.y() * b.x() < 0) {
    std::swap(v[1], v[2]);
    std::swap(e[1], e[2]);
  }
  const double longest_in_plan = std::max({a.head<2>().norm(), b.head<2>().norm(), (a - b).head<2>().norm()});
  return {v, e, longest_in_plan > 0 ? std::abs(a.x() * b.y() - a.y() * b.x()) / longest_in_plan : 0};
}

/// All distinct local triangles, ordered by their sorted vertices.
inline std::vector<triangle> build_triangles(const position_set& stems, bool horizontal,
                                             const triangle_options& options = {}) {
  require_valid(options);
  const auto neighbors = std::size_t(options.neighbors);
  const neighbor_tree<double, 3> tree(stems.size(), [&](std::size_t i) {
    return Eigen::Vector3d(stems.at[i].x(), stems.at[i].y(), horizontal ? 0.0 : stems.at[i].z());
  });
  std::vector<std::uint64_t> triplets;  // vertices of each, the least one in the highest bits
  constexpr unsigned bits = 21;
  constexpr std::uint64_t mask = (std::uint64_t(1) << bits) - 1;
  if (stems.size() > mask) throw std::invalid_argument("triangles: more than two million stems");
  std::vector<neighbor<double>> nearest;
  for (stem_index i = 0; i < stems.size(); ++i) {
    tree.nearest(tree[i], neighbors + 1, nearest);
    std::erase_if(nearest, [&](const neighbor<double>& n) { return n.index == i; });
    nearest.resize(std::min(nearest.size(), neighbors));  // duplicates of stem i may have crowded it out
    for (std::size_t j = 0; j < nearest.size(); ++j)
      for (std::size_t k = j + 1; k < nearest.size(); ++k) {
        std::array<std::uint64_t, 3> v = {i, nearest[j].index, nearest[k].index};
        std::sort(v.begin(), v.end());
        triplets.push_back(v[0] << 2 * bits | v[1] << bits | v[2]);
      }
  }
  std::sort(triplets.begin(), triplets.end());
  triplets.erase(std::unique(triplets.begin(), triplets.end()), triplets.end());
  std::vector<triangle> triangles;
  triangles.reserve(triplets.size());
  for (const std::uint64_t t : triplets) {
    const auto vertex = [&](unsigned shift) { return static_cast<stem_index>(t >> shift & mask); };
    triangles.push_back(make_triangle(stems, {vertex(2 * bits), vertex(bits), vertex(0)}, horizontal));
  }
  return triangles;
}

/// Calls `visit(triangle)` for every order that the triangle may canonically have in another scan, where
/// edges differ by less than `tolerance` [m]: any vertex opposite an edge within twice the tolerance of the
/// longest may come first, and a triangle flatter than the tolerance, in plan where its sense of rotation is
/// told, may be turned over.
template <class Visit>
void for_each_admissible_order(const triangle& t, double tolerance, const Visit& visit) {
  const bool flat = t.plan_height < tolerance;
  for (std::size_t first = 0; first < 3; ++first) {
    if (t.edges[first] <= t.edges[0] - 2 * tolerance) continue;
    const std::size_t second = (first + 1) % 3, third = (first + 2) % 3;
    const auto order = [&](std::size_t i, std::size_t j, std::size_t k) {
      visit(triangle{{t.vertices[i], t.vertices[j], t.vertices[k]},
                     {t.edges[i], t.edges[j], t.edges[k]},
                     t.plan_height});
    };
    order(first, second, third);
    if (flat) order(first, third, second);
  }
}

}  // namespace globalmatch
