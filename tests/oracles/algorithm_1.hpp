// Algorithm 1 of the paper as it stands there, by the rule of line 5 (agreement with the seed pair): the
// oracle of `consensus_sizes`. And the test of the urban method that the paper replaces.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/local_matching.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::oracles {

using namespace detail;

/// D_global, [GM] Eq. (5): over all edges of the two fully connected graphs of six vertices.
inline double global_dissimilarity(const position_set& source, const position_set& target,
                                   const triangle_pair& u1, const triangle_pair& u2, bool horizontal) {
  const auto graph = [](const position_set& stems, const std::array<stem_index, 3>& t1,
                        const std::array<stem_index, 3>& t2) {
    return std::array<vec3, 6>{stems.at[t1[0]], stems.at[t1[1]], stems.at[t1[2]],
                               stems.at[t2[0]], stems.at[t2[1]], stems.at[t2[2]]};
  };
  const auto g_source = graph(source, u1.source, u2.source), g_target = graph(target, u1.target, u2.target);
  double largest = 0;
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t j = i + 1; j < 6; ++j)
      largest = std::max(largest, std::abs(stem_distance(g_source[i], g_source[j], horizontal) -
                                           stem_distance(g_target[i], g_target[j], horizontal)));
  return largest;
}

/// The consensus set that grows from each pair, lines 2 to 9: indices into `pairs`, the seed first.
/// `agree(u1, u2)` is the test of line 5.
template <class Agree>
std::vector<std::vector<std::size_t>> consensus_sets(std::span<const triangle_pair> pairs,
                                                     const Agree& agree) {
  std::vector<std::vector<std::size_t>> sets(pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    poll_cancelled();
    sets[i].push_back(i);
    for (std::size_t j = 0; j < pairs.size(); ++j)
      if (i != j && agree(pairs[i], pairs[j])) sets[i].push_back(j);
  }
  return sets;
}

/// The test of line 5 by D_global.
inline auto globally_consistent(const position_set& source, const position_set& target, bool horizontal,
                                double epsilon) {
  return [&source, &target, horizontal, epsilon](const triangle_pair& u1, const triangle_pair& u2) {
    return global_dissimilarity(source, target, u1, u2, horizontal) < epsilon;
  };
}

inline std::vector<std::vector<std::size_t>> consensus_sets(const position_set& source,
                                                            const position_set& target,
                                                            std::span<const triangle_pair> pairs,
                                                            bool horizontal, double epsilon) {
  return consensus_sets(pairs, globally_consistent(source, target, horizontal, epsilon));
}

/// Lines 10 to 13: the corresponding vertices of the largest consensus set, each once, increasing.
template <class Agree>
std::vector<correspondence> largest_consensus(std::span<const triangle_pair> pairs, const Agree& agree) {
  const auto sets = consensus_sets(pairs, agree);
  const auto largest = std::max_element(sets.begin(), sets.end(),
                                        [](const auto& a, const auto& b) { return a.size() < b.size(); });
  std::vector<correspondence> correspondences;
  if (largest == sets.end()) return correspondences;
  for (const std::size_t u : *largest)
    for (std::size_t i = 0; i < 3; ++i) correspondences.push_back({pairs[u].source[i], pairs[u].target[i]});
  std::sort(correspondences.begin(), correspondences.end());
  correspondences.erase(std::unique(correspondences.begin(), correspondences.end()), correspondences.end());
  return correspondences;
}

inline std::vector<correspondence> largest_consensus(const position_set& source, const position_set& target,
                                                     std::span<const triangle_pair> pairs, bool horizontal,
                                                     double epsilon) {
  return largest_consensus(pairs, globally_consistent(source, target, horizontal, epsilon));
}

/// Whether two pairs agree by their centroids alone, as in the urban method (Yang et al. 2016) that [GM]
/// 3.2.3 finds ambiguous.
inline bool centroids_agree(const position_set& source, const position_set& target, const triangle_pair& u1,
                            const triangle_pair& u2, double epsilon) {
  const auto centroid = [](const position_set& stems, const std::array<stem_index, 3>& t) {
    return (stems.at[t[0]] + stems.at[t[1]] + stems.at[t[2]]) / 3;
  };
  const double in_source = (centroid(source, u1.source) - centroid(source, u2.source)).norm();
  const double in_target = (centroid(target, u1.target) - centroid(target, u2.target)).norm();
  return std::abs(in_source - in_target) < epsilon;
}

}  // namespace globalmatch::oracles
