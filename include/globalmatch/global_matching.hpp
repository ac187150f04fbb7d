// Global matching ([GM] 3.2.3, Algorithm 1): the largest consensus sets of triangle pairs, as ranked
// hypotheses. In: locally matched triangle pairs. Out: distinct hypotheses, best first. Cost: quadratic in
// the pairs; parallel.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <numeric>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "globalmatch/execution.hpp"
#include "globalmatch/hypothesis.hpp"
#include "globalmatch/local_matching.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/position_set.hpp"

namespace globalmatch {

struct global_matching_options {
  int most_hypotheses = 10;  ///< distinct ones that are returned (ours)
  int most_seeds = 200;      ///< consensus sets that are verified for them (ours)
};

/// Throws `std::invalid_argument` naming the field that makes no sense.
inline void require_valid(const global_matching_options& options) {
  if (options.most_hypotheses < 2)
    throw std::invalid_argument("global_matching.most_hypotheses must be at least 2");
  if (options.most_seeds < options.most_hypotheses)
    throw std::invalid_argument("global_matching.most_seeds must be at least most_hypotheses");
}

namespace detail {

/// Distances [m] between all stems of a map.
class distance_table {
 public:
  distance_table(const position_set& stems, bool horizontal) : size_(stems.size()), values_(size_ * size_) {
    for (std::size_t i = 0; i < size_; ++i)
      for (std::size_t j = 0; j < size_; ++j)
        values_[i * size_ + j] = stem_distance(stems.at[i], stems.at[j], horizontal);
  }
  double operator()(stem_index i, stem_index j) const { return values_[i * size_ + j]; }

 private:
  std::size_t size_;
  std::vector<double> values_;
};

}  // namespace detail

/// Whether two triangle pairs agree: D_global ([GM] Eq. (5)) is less than `tolerance` [m]. Only edges between
/// the two triangles count, since those within each agree already.
inline bool globally_consistent(const triangle_pair& a, const triangle_pair& b,
                                const detail::distance_table& source, const detail::distance_table& target,
                                double tolerance) {
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      if (!(std::abs(source(a.source[i], b.source[j]) - target(a.target[i], b.target[j])) < tolerance))
        return false;
  return true;
}

/// The stem correspondences of a consensus set, each stem at most once: those that most triangle pairs vote
/// for.
inline std::vector<correspondence> vote_correspondences(std::span<const triangle_pair> consensus) {
  std::map<correspondence, int> votes;
  for (const triangle_pair& pair : consensus)
    for (std::size_t i = 0; i < 3; ++i) ++votes[{pair.source[i], pair.target[i]}];
  std::vector<std::pair<int, correspondence>> order;
  for (const auto& [c, count] : votes) order.push_back({-count, c});
  std::sort(order.begin(), order.end());
  std::vector<correspondence> chosen;
  for (const auto& entry : order) {
    const correspondence& c = entry.second;
    const bool taken = std::any_of(chosen.begin(), chosen.end(), [&](const correspondence& other) {
      return other.source == c.source || other.target == c.target;
    });
    if (!taken) chosen.push_back(c);
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

inline namespace GLOBALMATCH_THREADING {

/// Size of the consensus set that grows from each pair as its seed ([GM] Algorithm 1): how many pairs agree
/// with it, itself included.
inline std::vector<std::size_t> consensus_sizes(const map_pair& maps, std::span<const triangle_pair> pairs,
                                                double tolerance, const execution& how = {}) {
  const detail::distance_table source(maps.source, maps.horizontal), target(maps.target, maps.horizontal);
  std::vector<std::size_t> sizes(pairs.size(), 1);
  parallel_for(
      how, "global matching", pairs.size(),
      [&](std::size_t i) {
        for (std::size_t j = 0; j < pairs.size(); ++j)
          if (i != j && globally_consistent(pairs[i], pairs[j], source, target, tolerance)) ++sizes[i];
      },
      64);
  return sizes;
}

/// The distinct hypotheses with the largest consensus sets, verified over all stems, best first. `tolerance`
/// is epsilon [m].
inline std::vector<hypothesis> match_globally(const map_pair& maps, std::span<const triangle_pair> pairs,
                                              double tolerance, const global_matching_options& options = {},
                                              const execution& how = {}) {
  require_valid(options);
  const auto sizes = consensus_sizes(maps, pairs, tolerance, how);
  std::vector<std::size_t> seeds(pairs.size());
  std::iota(seeds.begin(), seeds.end(), std::size_t(0));
  std::stable_sort(seeds.begin(), seeds.end(),
                   [&](std::size_t a, std::size_t b) { return sizes[a] > sizes[b]; });

  const detail::distance_table source(maps.source, maps.horizontal), target(maps.target, maps.horizontal);
  std::vector<hypothesis> hypotheses;
  // Two correspondences fix a motion: a seed that shares two with a known hypothesis would lead to it again.
  const auto explained = [&](const triangle_pair& pair) {
    return std::any_of(hypotheses.begin(), hypotheses.end(), [&](const hypothesis& h) {
      int shared = 0;
      for (std::size_t i = 0; i < 3; ++i)
        shared += stem_distance(h.target_from_source * maps.source.at[pair.source[i]],
                                maps.target.at[pair.target[i]], maps.horizontal) < 2 * tolerance;
      return shared >= 2;
    });
  };
  int verified = 0;
  for (const std::size_t seed : seeds) {
    if (verified == options.most_seeds || hypotheses.size() == std::size_t(options.most_hypotheses)) break;
    if (explained(pairs[seed])) continue;
    std::vector<triangle_pair> consensus;
    for (const triangle_pair& pair : pairs)
      if (&pair == &pairs[seed] || globally_consistent(pairs[seed], pair, source, target, tolerance))
        consensus.push_back(pair);
    ++verified;
    auto h = verify(maps, vote_correspondences(consensus), tolerance);
    if (!h) continue;
    h->consensus = consensus.size();
    const auto twin = std::find_if(hypotheses.begin(), hypotheses.end(), [&](const hypothesis& other) {
      return !differ(*h, other, maps.source, 2 * tolerance);
    });
    if (twin == hypotheses.end())
      hypotheses.push_back(std::move(*h));
    else if (ranks_before(*h, *twin))
      *twin = std::move(*h);
  }
  std::stable_sort(hypotheses.begin(), hypotheses.end(), ranks_before);
  return hypotheses;
}

}  // namespace GLOBALMATCH_THREADING
}  // namespace globalmatch
