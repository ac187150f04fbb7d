// Local matching of every source triangle with every target triangle: the oracle of `match_locally`.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "globalmatch/local_matching.hpp"
#include "globalmatch/positions.hpp"
#include "globalmatch/triangles.hpp"

namespace globalmatch::oracles {

/// [GM] Eq. (4), with the condition that follows it.
inline std::optional<double> dissimilarity(const std::array<double, 3>& source,
                                           const std::array<double, 3>& target, double epsilon) {
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    if (std::abs(source[i] - target[i]) >= epsilon) return std::nullopt;
    sum += std::abs(source[i] - target[i]);
  }
  return sum;
}

/// Twice the area [m^2] of three stems in plan; positive when they are counter-clockwise seen from above.
inline double signed_parallelogram(const position_set& stems, const std::array<stem_index, 3>& v) {
  const detail::vec3 a = stems.at[v[1]] - stems.at[v[0]], b = stems.at[v[2]] - stems.at[v[0]];
  return a.x * b.y - a.y * b.x;
}

/// Whether the canonical order of the three stems could be `v` if they stood elsewhere by less than half the
/// tolerance each.
inline bool is_admissible(const position_set& stems, const std::array<stem_index, 3>& v, bool horizontal,
                          double epsilon) {
  std::array<double, 3> edges, horizontal_edges;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto &a = stems.at[v[(i + 1) % 3]], &b = stems.at[v[(i + 2) % 3]];
    edges[i] = stem_distance(a, b, horizontal);
    horizontal_edges[i] = stem_distance(a, b, true);
  }
  const double longest = *std::max_element(edges.begin(), edges.end());
  const double parallelogram = signed_parallelogram(stems, v);
  const double height =
      std::abs(parallelogram) / *std::max_element(horizontal_edges.begin(), horizontal_edges.end());
  return edges[0] > longest - 2 * epsilon && (parallelogram >= 0 || height < epsilon);
}

/// For every target triangle in its order the most similar source triangle, in whatever admissible order of
/// its vertices.
inline std::vector<triangle_pair> brute_force_pairs(const position_set& source_stems,
                                                    const std::vector<triangle>& source,
                                                    const std::vector<triangle>& target, bool horizontal,
                                                    double epsilon) {
  std::vector<triangle_pair> pairs;
  for (const triangle& t : target) {
    std::optional<triangle_pair> best;
    for (const triangle& s : source) {
      std::array<std::size_t, 3> order = {0, 1, 2};
      do {
        const std::array<stem_index, 3> v = {s.vertices[order[0]], s.vertices[order[1]],
                                             s.vertices[order[2]]};
        if (!is_admissible(source_stems, v, horizontal, epsilon)) continue;
        const auto d =
            dissimilarity({s.edges[order[0]], s.edges[order[1]], s.edges[order[2]]}, t.edges, epsilon);
        if (d && (!best || *d < best->dissimilarity)) best = triangle_pair{v, t.vertices, *d};
      } while (std::next_permutation(order.begin(), order.end()));
    }
    if (best) pairs.push_back(*best);
  }
  return pairs;
}

}  // namespace globalmatch::oracles
