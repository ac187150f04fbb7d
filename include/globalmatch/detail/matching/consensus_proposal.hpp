// Hypotheses by Algorithm 1 of [GM]: the largest consensus set of all congruent triangles, and others beside
// it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/global_matching/consensus_finder.hpp"
#include "globalmatch/detail/global_matching/consensus_search.hpp"
#include "globalmatch/detail/matching/verify.hpp"
#include "globalmatch/global_matching.hpp"
#include "globalmatch/local_matching.hpp"

namespace globalmatch::detail {

/// Distinct hypotheses, verified over all stems, best first: that of the largest consensus set, and those of
/// the sets that promise most among the pairs it does not explain. `epsilon` in metres. `tested` receives the
/// number of consensus sets that were counted.
inline std::vector<local_hypothesis> propose_by_consensus(const matching_context& context,
                                                          std::span<const triangle_pair> pairs,
                                                          double epsilon,
                                                          const global_matching_options& options = {},
                                                          std::size_t* tested = nullptr) {
  require_valid(options);
  if (pairs.empty()) return {};
  const consensus_finder finder(context.source, context.target, context.horizontal, pairs, epsilon,
                                context.exec);
  const consensus_search search = largest_consensus(finder, options.sufficient, context.exec);
  if (tested) *tested = search.visited;
  std::vector<local_hypothesis> hypotheses;
  const auto verify_seed = [&](std::size_t seed) {
    const auto consensus = finder.consensus(seed);
    auto h = verify(context, vote_correspondences(finder, consensus), epsilon);
    if (!h) return;
    h->consensus = consensus.size();
    add_distinct(std::move(*h), hypotheses, context);
  };
  const auto is_explained = [&](std::size_t seed) {
    for (const local_hypothesis& h : hypotheses)
      if (leads_to(correspondences_of(pairs[seed]), h, context)) return true;
    return false;
  };
  verify_seed(search.best.seed);
  int verified = 1;
  for (const std::uint32_t seed : search.order) {
    if (verified == options.max_seeds || hypotheses.size() == std::size_t(options.max_hypotheses)) break;
    poll_cancelled();
    if (is_explained(seed)) continue;
    verify_seed(seed);
    ++verified;
  }
  rank(hypotheses);
  return hypotheses;
}

}  // namespace globalmatch::detail
