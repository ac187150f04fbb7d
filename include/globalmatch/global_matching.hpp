// Global matching ([GM] 3.2.3, Algorithm 1): the largest consensus set of triangle pairs. In: locally matched
// triangle pairs. Out: stem correspondences.
#pragma once

#include <cstddef>
#include <span>
#include <stdexcept>
#include <vector>

#include "globalmatch/detail/global_matching/consensus_finder.hpp"
#include "globalmatch/detail/global_matching/consensus_search.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/local_matching.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch {

/// Options of the largest consensus set ([GM] 3.2.3).
struct global_matching_options {
  int max_hypotheses = 10;  ///< distinct ones that are returned (ours)
  int max_seeds = 200;      ///< consensus sets that are verified for them (ours)
  /// A consensus set of this many triangle pairs ends the search ([GM] 3.2.3: "a sufficient number", without
  /// a value); 0: the search is exhaustive.
  std::size_t sufficient = 0;
};

/// Throws `std::invalid_argument` naming the field that makes no sense.
inline void require_valid(const global_matching_options& options) {
  if (options.max_hypotheses < 2) throw std::invalid_argument("global.max_hypotheses must be at least 2");
  if (options.max_seeds < options.max_hypotheses)
    throw std::invalid_argument("global.max_seeds must be at least max_hypotheses");
}

/// Triangle pairs that agree, and what they vote for.
struct consensus_set {
  std::vector<correspondence> correspondences;  ///< of stems, one to one, increasing
  std::size_t size = 0;                         ///< triangle pairs in it
};

/// The largest consensus set of triangle pairs, that of the first seed of equally large ones; empty without
/// pairs. `pairs` are those of `match_locally`, from the triangles of `source` and `target`, whose heights
/// count unless `horizontal`. `epsilon` [m] is the largest difference of corresponding distances. Throws
/// `std::invalid_argument` naming a bad option, and for pairs of other positions. Memory: quadratic in the
/// stems.
inline consensus_set match_globally(const position_set& source, const position_set& target, bool horizontal,
                                    std::span<const triangle_pair> pairs, double epsilon,
                                    const global_matching_options& options = {}, const execution& exec = {}) {
  require_valid(options);
  if (!(epsilon > 0)) throw std::invalid_argument("match_globally: epsilon must be positive");
  for (const triangle_pair& pair : pairs)
    for (std::size_t i = 0; i < 3; ++i)
      if (pair.source[i] >= source.size() || pair.target[i] >= target.size())
        throw std::invalid_argument("match_globally: pairs are not of triangles of these positions");
  if (pairs.empty()) return {};
  const detail::consensus_finder finder(source, target, horizontal, pairs, epsilon, exec);
  const auto members =
      finder.consensus(detail::largest_consensus(finder, options.sufficient, exec).best.seed);
  return {detail::vote_correspondences(finder, members), members.size()};
}

}  // namespace globalmatch
