// Local matching ([GM] 3.2.2): for every target triangle the most similar source triangle.
// In: triangles of both maps. Out: congruent triangle pairs. Parallel over target triangles.
// Cost: target triangles times the source triangles whose edges are within some tolerances.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <vector>

#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/core/wrapped_grid.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/triangles.hpp"

namespace globalmatch {

/// Two triangles of which vertex i corresponds to vertex i ([GM] u).
struct triangle_pair {
  std::array<stem_index, 3> source = {}, target = {};  ///< indices of stems
  double dissimilarity = 0;                            ///< [m] D_local, [GM] Eq. (4)
};

namespace detail {

/// Sum of the differences of corresponding edges [m], or infinity when one of them is not less than
/// `epsilon`: D_local, [GM] Eq. (4).
inline double local_dissimilarity(const triangle& source, const triangle& target, double epsilon) {
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double difference = std::abs(source.edges[i] - target.edges[i]);
    if (!(difference < epsilon)) return std::numeric_limits<double>::infinity();
    sum += difference;
  }
  return sum;
}

}  // namespace detail

/// At most one pair for each target triangle, in their order. `epsilon` is epsilon [m]. Source triangles
/// are tried in every admissible vertex order; of equally similar ones the first wins.
inline std::vector<triangle_pair> match_locally(const std::vector<triangle>& source,
                                                const std::vector<triangle>& target, double epsilon,
                                                const execution& exec = {}) {
  using namespace detail;
  if (!(epsilon > 0)) throw std::invalid_argument("match_locally: epsilon must be positive");
  std::vector<triangle> candidates;
  candidates.reserve(source.size());
  for (const triangle& s : source)
    for (const triangle& ordered : admissible_orders(s, epsilon)) candidates.push_back(ordered);
  const triangle_grid by_edges(candidates.size(), float(epsilon), [&](std::size_t c) {
    return triangle_grid::item{edge_point(candidates[c]), {static_cast<std::uint32_t>(c), 0, 0}};
  });

  constexpr double none = std::numeric_limits<double>::infinity();
  std::vector<triangle_pair> best_of(target.size());
  parallel_for(exec, "local matching", target.size(), [&](std::size_t t) {
    // The grid rounds to floats: it may show too many, but hides none.
    const double rounding = 4 * std::numeric_limits<float>::epsilon() * (target[t].edges[0] + epsilon);
    double smallest = none;
    std::size_t best = candidates.size();
    by_edges.for_each_near(edge_point(target[t]), float(epsilon + rounding),
                           [&](const triangle_grid::item& near) {
                             const std::size_t c = near.label[0];
                             const double d = local_dissimilarity(candidates[c], target[t], epsilon);
                             if (d < smallest || (d == smallest && c < best)) smallest = d, best = c;
                           });
    if (smallest == none) return void(best_of[t].dissimilarity = none);
    best_of[t] = {candidates[best].vertices, target[t].vertices, smallest};
  });
  std::vector<triangle_pair> pairs;
  for (const triangle_pair& best : best_of)
    if (best.dissimilarity < none) pairs.push_back(best);
  return pairs;
}

}  // namespace globalmatch
