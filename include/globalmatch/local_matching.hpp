// Local matching ([GM] 3.2.2): for every target triangle the most similar source triangle.
// In: triangles of both maps. Out: congruent triangle pairs. Parallel over target triangles.
// Cost: target triangles times the source triangles whose longest edge is within the tolerance.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "globalmatch/execution.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/triangles.hpp"

namespace globalmatch {

/// Two triangles of which vertex i corresponds to vertex i ([GM] u).
struct triangle_pair {
  std::array<stem_index, 3> source, target;
  double dissimilarity = 0;  ///< [m] D_local, [GM] Eq. (4)
};

/// Sum of the differences of corresponding edges [m], or nothing when one of them is not less than
/// `tolerance`: D_local, [GM] Eq. (4).
inline std::optional<double> local_dissimilarity(const triangle& source, const triangle& target,
                                                 double tolerance) {
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double difference = std::abs(source.edges[i] - target.edges[i]);
    if (!(difference < tolerance)) return std::nullopt;
    sum += difference;
  }
  return sum;
}

inline namespace GLOBALMATCH_THREADING {

/// At most one pair for each target triangle, in their order. `tolerance` is epsilon [m]. Source triangles
/// are tried in every admissible vertex order; of equally similar ones the first wins.
inline std::vector<triangle_pair> match_locally(const std::vector<triangle>& source,
                                                const std::vector<triangle>& target, double tolerance,
                                                const execution& how = {}) {
  if (!(tolerance > 0)) throw std::invalid_argument("tolerance must be positive");
  struct candidate {
    triangle ordered;
    std::size_t source;
  };
  std::vector<candidate> candidates;
  for (std::size_t s = 0; s < source.size(); ++s)
    for_each_admissible_order(source[s], tolerance, [&](const triangle& ordered) {
      candidates.push_back({ordered, s});
    });
  std::stable_sort(candidates.begin(), candidates.end(), [](const candidate& a, const candidate& b) {
    return a.ordered.edges[0] < b.ordered.edges[0];
  });

  std::vector<std::optional<triangle_pair>> best_of(target.size());
  parallel_for(how, "local matching", target.size(), [&](std::size_t t) {
    const double longest = target[t].edges[0];
    auto c =
        std::lower_bound(candidates.begin(), candidates.end(), longest - tolerance,
                         [](const candidate& other, double edge) { return other.ordered.edges[0] < edge; });
    auto least = std::pair(std::numeric_limits<double>::infinity(), source.size());
    for (; c != candidates.end() && c->ordered.edges[0] <= longest + tolerance; ++c) {
      const auto dissimilarity = local_dissimilarity(c->ordered, target[t], tolerance);
      if (!dissimilarity || std::pair(*dissimilarity, c->source) >= least) continue;
      least = {*dissimilarity, c->source};
      best_of[t] = triangle_pair{c->ordered.vertices, target[t].vertices, *dissimilarity};
    }
  });
  std::vector<triangle_pair> pairs;
  for (const auto& best : best_of)
    if (best) pairs.push_back(*best);
  return pairs;
}

}  // namespace GLOBALMATCH_THREADING
}  // namespace globalmatch
