// Upper bounds of the sizes of consensus sets, so that seeds that cannot win are not looked at.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "globalmatch/detail/core/distance_cells.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/global_matching/consensus_finder.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::detail {

/// Bounds on consensus sets that cost next to nothing: all votes for correspondences that agree with one of
/// the seed's, three for each member. Of those with many votes each is looked at; those with few are
/// only counted, distance by distance, as if each pair of stems were one. Refers to the finder.
class vote_bounds {
 public:
  explicit vote_bounds(const consensus_finder& finder, const execution& exec = {}) : finder_(finder) {
    // As many as a motion pairs at most: with few wrong ones those of the largest set.
    const auto votes = finder.votes();
    const std::size_t maximum = std::min({votes.size(), finder_.source().size(), finder_.target().size()});
    std::vector<keyed> order;  // by most votes
    for (std::size_t c = 0; c < votes.size(); ++c) order.push_back({~std::uint64_t(votes[c]), c});
    keep_first(order, maximum + 1);
    few_ = maximum < votes.size() ? votes[order[maximum].value] : 0;
    for (const keyed& next : order) {
      if (votes[next.value] <= few_) continue;
      popular_.push_back(finder.correspondences()[next.value]);
      votes_above_few_.push_back(votes[next.value] - few_);
    }
    target_distances_.resize(finder_.target().size() * popular_.size());
    const auto measure = [&](std::size_t t) {
      double* distance = target_distances_.data() + t * popular_.size();
      for (const correspondence& p : popular_)
        *distance++ =
            stem_distance(finder_.target().at[t], finder_.target().at[p.target], finder_.horizontal());
    };
    parallel_for(exec, "global matching", finder_.target().size(), measure, 64);
  }

  /// Calls `visit(number, bound)` for the numbers of some correspondences, of which those with one source
  /// stem follow each other.
  template <class Visit>
  void for_each(std::span<const std::uint32_t> numbers, const Visit& visit) const {
    const distance_cells& cells = finder_.target_distances();
    const auto& at = finder_.source().at;
    const double epsilon = finder_.epsilon();
    if (!distance_cells::countable(std::max(finder_.source().size(), finder_.target().size()))) {
      for (const std::uint32_t number : numbers) visit(number, std::numeric_limits<std::size_t>::max());
      return;
    }
    std::optional<stem_index> source;
    std::vector<std::int16_t> counts;      // source stems in each cell of distance
    std::vector<double> source_distances;  // of the popular ones
    for (const std::uint32_t number : numbers) {
      const auto [s, t] = finder_.correspondences()[number];
      if (source != s) {
        source = s;
        counts.assign(cells.cells(), 0);
        for (const vec3& p : at) ++counts[cells.cell(stem_distance(at[s], p, finder_.horizontal()))];
        source_distances.clear();
        for (const correspondence& p : popular_)
          source_distances.push_back(stem_distance(at[s], at[p.source], finder_.horizontal()));
      }
      const double* target_distances = target_distances_.data() + t * popular_.size();
      std::int64_t votes = 0;
      for (std::size_t p = 0; p < popular_.size(); ++p)
        votes += std::abs(source_distances[p] - target_distances[p]) < epsilon ? votes_above_few_[p] : 0;
      const auto near = cells.counts(t);
      int common = 0;
      for (std::size_t c = 0; c < counts.size(); ++c) common += counts[c] * near[c];
      visit(number, 1 + std::size_t(votes + few_ * common) / 3);
    }
  }

 private:
  const consensus_finder& finder_;
  std::vector<correspondence> popular_;
  std::vector<std::int64_t> votes_above_few_;  // of the popular ones
  std::int64_t few_ = 0;                       // no other has more votes
  std::vector<double> target_distances_;       // from each target stem to those of the popular ones
};

/// The pairs that agree with a correspondence, kept as long as there is room. Refers to the finder.
class agreements {
 public:
  static constexpr std::size_t room = 1024;

  explicit agreements(const consensus_finder& finder)
      : finder_(finder), pairs_with_(finder.correspondences().size()) {}

  /// Makes ready what is asked for, of no more than `room` correspondences.
  void prepare(std::span<const std::uint32_t> numbers, const execution& exec = {}) {
    if (kept_.size() + numbers.size() > room) {
      for (const std::uint32_t c : kept_) pairs_with_[c] = {};
      kept_.clear();
    }
    const std::size_t first_missing = kept_.size();
    for (const std::uint32_t c : numbers)
      if (pairs_with_[c].empty()) {
        pairs_with_[c].resize(1);
        kept_.push_back(c);
      }
    const std::span<const std::uint32_t> missing = std::span(kept_).subspan(first_missing);
    parallel_chunks(exec, "global matching", missing.size(), 8, [&](std::size_t begin, std::size_t end) {
      std::vector<std::uint8_t> agrees;
      for (std::size_t k = begin; k < end; ++k)
        pairs_with_[missing[k]] = finder_.agreeing_pairs(missing[k], agrees);
    });
  }

  /// No seed with this correspondence has a larger consensus set.
  std::size_t bound(std::uint32_t c) const {
    std::size_t size = 1;  // the seed, which need not agree with itself
    for (const std::uint64_t bits : pairs_with_[c]) size += std::size_t(std::popcount(bits));
    return size;
  }

  /// Size of the consensus set of seed `u`, itself included.
  std::size_t consensus_size(std::size_t u) const {
    const auto& [a, b, c] = finder_.vertices(u);
    const pair_set &with_a = pairs_with_[a], &with_b = pairs_with_[b], &with_c = pairs_with_[c];
    const auto all = [&](std::size_t word) { return with_a[word] & with_b[word] & with_c[word]; };
    std::size_t size = (all(u / 64) >> u % 64 & 1) == 0;
    for (std::size_t word = 0; word < with_a.size(); ++word) size += std::size_t(std::popcount(all(word)));
    return size;
  }

 private:
  const consensus_finder& finder_;
  std::vector<pair_set> pairs_with_;  // of each correspondence; empty where not kept
  std::vector<std::uint32_t> kept_;
};

/// Lowers the bound of each pair to that of each of its correspondences, as long as it is `at_least`.
/// `bound_all(numbers, of_correspondence)` bounds correspondences, whose numbers increase.
template <class BoundAll>
void lower_bounds(const consensus_finder& finder, std::size_t at_least, std::vector<std::size_t>& bounds,
                  const BoundAll& bound_all) {
  constexpr std::size_t unknown = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> of_correspondence(finder.correspondences().size(), unknown);
  for (std::size_t i = 0; i < 3; ++i) {  // those of most votes first: they rule out most
    std::vector<keyed> wanted;
    for (std::size_t u = 0; u < bounds.size(); ++u)
      if (const std::uint32_t c = finder.vertices(u)[i];
          bounds[u] >= at_least && of_correspondence[c] == unknown) {
        of_correspondence[c] = 0;
        wanted.push_back({c, 0});
      }
    sort_keyed(wanted);
    std::vector<std::uint32_t> numbers;
    for (const keyed& c : wanted) numbers.push_back(static_cast<std::uint32_t>(c.key));
    bound_all(std::span<const std::uint32_t>(numbers), of_correspondence);
    for (std::size_t u = 0; u < bounds.size(); ++u)
      bounds[u] = std::min(bounds[u], of_correspondence[finder.vertices(u)[i]]);
  }
}

/// For each pair a number that the consensus set grown from it does not exceed, from votes; once it is less
/// than `at_least` it is not made any better.
inline std::vector<std::size_t> consensus_bounds(const consensus_finder& finder, std::size_t at_least,
                                                 const execution& exec = {}) {
  const vote_bounds by_votes(finder, exec);
  std::vector<std::size_t> bounds(finder.size(), std::numeric_limits<std::size_t>::max());
  lower_bounds(finder, at_least, bounds, [&](std::span<const std::uint32_t> numbers, auto& bound_of) {
    parallel_chunks(exec, "global matching", numbers.size(), 512, [&](std::size_t begin, std::size_t end) {
      by_votes.for_each(numbers.subspan(begin, end - begin), [&](std::uint32_t c, std::size_t bound) {
        bound_of[c] = bound < at_least ? bound : finder.bound(c);
      });
    });
  });
  return bounds;
}

/// Lowers bounds further, by the pairs that agree with each correspondence.
inline void lower_bounds_by_agreement(const consensus_finder& finder, std::size_t at_least,
                                      std::vector<std::size_t>& bounds, agreements& agreeing,
                                      const execution& exec = {}) {
  lower_bounds(finder, at_least, bounds, [&](std::span<const std::uint32_t> numbers, auto& bound_of) {
    for (std::size_t begin = 0; begin < numbers.size(); begin += agreements::room) {
      const auto some = numbers.subspan(begin, std::min(agreements::room, numbers.size() - begin));
      agreeing.prepare(some, exec);
      for (const std::uint32_t c : some) bound_of[c] = agreeing.bound(c);
    }
  });
}

}  // namespace globalmatch::detail
