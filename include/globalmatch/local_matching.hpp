// Local matching ([GM] 3.2.2): for every target triangle the most similar source triangle.
// In: triangles of both maps. Out: congruent triangle pairs. Parallel over target triangles.
// Cost: target triangles times the source triangles whose edges are within some tolerances.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/core/wrapped_grid.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/triangles.hpp"

namespace globalmatch {

/// Two triangles of which vertex i corresponds to vertex i ([GM] u).
struct triangle_pair {
  std::array<stem_index, 3> source, target;
  double dissimilarity = 0;  ///< [m] D_local, [GM] Eq. (4)
};

/// Sum of the differences of corresponding edges [m], or nothing when one of them is not less than
/// `epsilon`: D_local, [GM] Eq. (4).
inline std::optional<double> local_dissimilarity(const triangle& source, const triangle& target,
                                                 double epsilon) {
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double difference = std::abs(source.edges[i] - target.edges[i]);
    if (!(difference < epsilon)) return std::nullopt;
    sum += difference;
  }
  return sum;
}

/// At most one pair for each target triangle, in their order. `epsilon` is epsilon [m]. Source triangles
/// are tried in every admissible vertex order; of equally similar ones the first wins.
inline std::vector<triangle_pair> match_locally(const std::vector<triangle>& source,
                                                const std::vector<triangle>& target, double epsilon,
                                                const execution& exec = {}) {
  if (!(epsilon > 0)) throw std::invalid_argument("tolerance must be positive");
  std::vector<triangle> candidates;
  candidates.reserve(source.size());
  for (const triangle& s : source)
    for_each_admissible_order(s, epsilon, [&](const triangle& ordered) { candidates.push_back(ordered); });
  using grid = detail::wrapped_grid<float, 3>;
  const grid by_edges(candidates.size(), float(epsilon), [&](std::size_t c) {
    return grid::item{edge_point(candidates[c]), static_cast<std::uint32_t>(c)};
  });

  std::vector<std::optional<triangle_pair>> best_of(target.size());
  detail::parallel_for(exec, "local matching", target.size(), [&](std::size_t t) {
    // The grid rounds to floats: it may show too many, but hides none.
    const double rounding = 4 * std::numeric_limits<float>::epsilon() * (target[t].edges[0] + epsilon);
    auto best = std::pair(std::numeric_limits<double>::infinity(), candidates.size());
    by_edges.for_each_near(edge_point(target[t]), float(epsilon + rounding), [&](const grid::item& near) {
      const triangle& ordered = candidates[near.label];
      const auto dissimilarity = local_dissimilarity(ordered, target[t], epsilon);
      if (!dissimilarity || std::pair(*dissimilarity, std::size_t(near.label)) >= best) return;
      best = {*dissimilarity, near.label};
      best_of[t] = triangle_pair{ordered.vertices, target[t].vertices, *dissimilarity};
    });
  });
  std::vector<triangle_pair> pairs;
  for (const auto& best : best_of)
    if (best) pairs.push_back(*best);
  return pairs;
}
}  // namespace globalmatch
