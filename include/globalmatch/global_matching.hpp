// Global matching ([GM] 3.2.3, Algorithm 1): the largest consensus set of triangle pairs, and others that
// rival it, as ranked hypotheses. In: locally matched triangle pairs. Out: distinct hypotheses, best first.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
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
  /// A consensus set of this many triangle pairs ends the search ([GM] 3.2.3: "a sufficient number", without
  /// a value); 0: the search is exhaustive.
  std::size_t sufficient = 0;
};

/// Throws `std::invalid_argument` naming the field that makes no sense.
inline void require_valid(const global_matching_options& options) {
  if (options.most_hypotheses < 2)
    throw std::invalid_argument("global_matching.most_hypotheses must be at least 2");
  if (options.most_seeds < options.most_hypotheses)
    throw std::invalid_argument("global_matching.most_seeds must be at least most_hypotheses");
}

namespace detail {

/// The stems of a map as each of them sees the others: nearest first. Memory quadratic in the stems.
class distance_order {
 public:
  struct entry {
    double distance;  // [m]
    stem_index stem;
  };

  distance_order(const position_set& stems, bool horizontal, const execution& how)
      : size_(stems.size()), entries_(size_ * size_) {
    const auto sort_row = [&](std::size_t i) {
      const auto row = entries_.begin() + std::ptrdiff_t(i * size_);
      for (stem_index j = 0; j < size_; ++j)
        row[j] = {stem_distance(stems.at[i], stems.at[j], horizontal), j};
      std::sort(row, row + std::ptrdiff_t(size_), [](const entry& a, const entry& b) {
        return a.distance < b.distance || (a.distance == b.distance && a.stem < b.stem);
      });
    };
    parallel_for(how, "global matching", size_, sort_row, 16);
  }
  std::span<const entry> around(stem_index i) const { return std::span(entries_).subspan(i * size_, size_); }

 private:
  std::size_t size_;
  std::vector<entry> entries_;
};

}  // namespace detail

/// Which triangle pairs agree: D_global ([GM] Eq. (5)) is less than the tolerance. Agreement of triangle
/// pairs comes down to that of stem correspondences: those of one pair must all agree with those of the
/// other. So the consensus set of a seed pair are the pairs made of correspondences that agree with all three
/// of its own. Refers to what it is made from.
class consensus_finder {
 public:
  /// `tolerance` is epsilon [m]. Memory: quadratic in the stems, linear in the pairs.
  consensus_finder(const map_pair& maps, std::span<const triangle_pair> pairs, double tolerance,
                   const execution& how = {})
      : source_(maps.source, maps.horizontal, how),
        target_(maps.target, maps.horizontal, how),
        target_count_(maps.target.size()),
        tolerance_(tolerance),
        vertices_(pairs.size()) {
    for (const triangle_pair& pair : pairs)
      for (std::size_t i = 0; i < 3; ++i) correspondences_.push_back({pair.source[i], pair.target[i]});
    std::sort(correspondences_.begin(), correspondences_.end());
    correspondences_.erase(std::unique(correspondences_.begin(), correspondences_.end()),
                           correspondences_.end());
    number_of_.assign(maps.source.size() * target_count_, none);
    for (std::uint32_t c = 0; c < correspondences_.size(); ++c) number_of_[place(correspondences_[c])] = c;

    votes_.assign(correspondences_.size(), 0);
    first_pair_.assign(correspondences_.size() + 1, 0);
    for (std::size_t u = 0; u < pairs.size(); ++u)
      for (std::size_t i = 0; i < 3; ++i) {
        vertices_[u][i] = number_of_[place({pairs[u].source[i], pairs[u].target[i]})];
        ++votes_[vertices_[u][i]];
      }
    votes_at_.assign(number_of_.size(), 0);
    for (std::uint32_t c = 0; c < correspondences_.size(); ++c)
      votes_at_[place(correspondences_[c])] = votes_[c];
    for (auto& v : vertices_)
      std::sort(v.begin(), v.end(), [&](std::uint32_t a, std::uint32_t b) { return votes_[a] > votes_[b]; });
    for (const auto& v : vertices_) ++first_pair_[v[0] + 1];
    std::partial_sum(first_pair_.begin(), first_pair_.end(), first_pair_.begin());
    by_first_vertex_.resize(pairs.size());
    auto next = first_pair_;
    for (std::uint32_t u = 0; u < pairs.size(); ++u) by_first_vertex_[next[vertices_[u][0]]++] = u;
  }

  std::size_t size() const { return vertices_.size(); }
  std::size_t correspondence_count() const { return correspondences_.size(); }
  /// The numbers of a pair's correspondences, that of most pairs first.
  const std::array<std::uint32_t, 3>& vertices(std::size_t u) const { return vertices_[u]; }
  /// Votes for all correspondences of a pair: how much it promises before anything is compared.
  std::size_t votes(std::size_t u) const {
    const auto& [a, b, c] = vertices_[u];
    return std::size_t(votes_[a]) + votes_[b] + votes_[c];
  }

  /// Calls `visit(number)` for the correspondences that agree with this one: one sweep over the distances
  /// from its two stems.
  template <class Visit>
  void for_each_agreeing(std::uint32_t c, const Visit& visit) const {
    for_each_alike(c, [&](std::size_t place) {
      if (number_of_[place] != none) visit(number_of_[place]);
    });
  }

  /// No consensus set of a seed with this correspondence has more pairs: each takes three votes.
  std::size_t bound(std::uint32_t c) const {
    std::size_t votes = 0;
    for_each_alike(c, [&](std::size_t place) { votes += votes_at_[place]; });
    return 1 + votes / 3;
  }

  /// Calls `visit(v)` for the pairs that agree with seed `u`, in any order, but not for `u` itself ([GM]
  /// Algorithm 1, lines 2 to 9). `agreeing` is reused memory.
  template <class Visit>
  void for_each_member(std::size_t u, std::vector<std::uint8_t>& agreeing, const Visit& visit) const {
    agreeing.assign(correspondences_.size(), 0);
    std::vector<std::uint32_t> with_all;
    for (const std::uint32_t c : vertices_[u])
      for_each_agreeing(c, [&](std::uint32_t other) {
        if (++agreeing[other] == 3) with_all.push_back(other);
      });
    for (const std::uint32_t c : with_all)
      for (std::size_t k = first_pair_[c]; k < first_pair_[c + 1]; ++k) {
        const std::uint32_t v = by_first_vertex_[k];
        if (v != u && agreeing[vertices_[v][1]] == 3 && agreeing[vertices_[v][2]] == 3) visit(v);
      }
  }

  /// Size of the consensus set of seed `u`, itself included.
  std::size_t consensus_size(std::size_t u, std::vector<std::uint8_t>& agreeing) const {
    std::size_t size = 1;
    for_each_member(u, agreeing, [&](std::uint32_t) { ++size; });
    return size;
  }

  /// The consensus set of seed `u`, itself included, increasing.
  std::vector<std::uint32_t> consensus(std::size_t u) const {
    std::vector<std::uint32_t> members = {static_cast<std::uint32_t>(u)};
    std::vector<std::uint8_t> agreeing;
    for_each_member(u, agreeing, [&](std::uint32_t v) { members.push_back(v); });
    std::sort(members.begin(), members.end());
    return members;
  }

 private:
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

  /// Calls `visit(place)` for the places, source by target, of stems as far from those of `c`.
  template <class Visit>
  void for_each_alike(std::uint32_t c, const Visit& visit) const {
    const auto sources = source_.around(correspondences_[c].source);
    const auto targets = target_.around(correspondences_[c].target);
    std::size_t low = 0;
    for (const auto& s : sources) {
      // Subtracted as in the test below, so that rounding cannot part the two.
      while (low < targets.size() && s.distance - targets[low].distance >= tolerance_) ++low;
      const std::size_t row = std::size_t(s.stem) * target_count_;
      for (std::size_t k = low; k < targets.size() && targets[k].distance - s.distance < tolerance_; ++k)
        visit(row + targets[k].stem);
    }
  }

  std::size_t place(const correspondence& c) const {
    return std::size_t(c.source) * target_count_ + c.target;
  }

  detail::distance_order source_, target_;
  std::size_t target_count_;
  double tolerance_;
  std::vector<std::array<std::uint32_t, 3>> vertices_;  // of each pair, as numbers of correspondences
  std::vector<correspondence> correspondences_;         // distinct, increasing
  std::vector<std::uint32_t> number_of_;                // of a correspondence, by place: source by target
  std::vector<std::uint32_t> votes_;                    // pairs with this correspondence, ...
  std::vector<std::uint32_t> votes_at_;                 // ... and by place: found in one step instead of two
  std::vector<std::size_t> first_pair_;                 // where those begin whose first vertex it is
  std::vector<std::uint32_t> by_first_vertex_;
};

/// The stem correspondences of a triangle pair.
inline std::array<correspondence, 3> correspondences_of(const triangle_pair& pair) {
  return {
      {{pair.source[0], pair.target[0]}, {pair.source[1], pair.target[1]}, {pair.source[2], pair.target[2]}}};
}

/// The stem correspondences of a consensus set, each stem at most once: those that most triangle pairs vote
/// for.
inline std::vector<correspondence> vote_correspondences(std::span<const triangle_pair> pairs,
                                                        std::span<const std::uint32_t> consensus) {
  std::map<correspondence, int> votes;
  for (const std::uint32_t u : consensus)
    for (std::size_t i = 0; i < 3; ++i) ++votes[{pairs[u].source[i], pairs[u].target[i]}];
  std::vector<std::pair<int, correspondence>> order;
  for (const auto& [c, count] : votes) order.push_back({-count, c});
  std::sort(order.begin(), order.end());
  std::map<stem_index, stem_index> target_of, source_of;
  std::vector<correspondence> chosen;
  for (const auto& entry : order) {
    const correspondence& c = entry.second;
    if (target_of.contains(c.source) || source_of.contains(c.target)) continue;
    target_of[c.source] = c.target;
    source_of[c.target] = c.source;
    chosen.push_back(c);
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

inline namespace GLOBALMATCH_THREADING {

/// For each pair a number that the consensus set grown from it does not exceed; once it is less than
/// `at_least` it is not made any better.
inline std::vector<std::size_t> consensus_bounds(const consensus_finder& finder, std::size_t at_least,
                                                 const execution& how = {}) {
  constexpr std::size_t unknown = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> of_correspondence(finder.correspondence_count(), unknown);
  std::vector<std::size_t> bounds(finder.size(), unknown);
  for (std::size_t i = 0; i < 3; ++i) {  // those of most pairs first: they rule out most
    std::vector<std::uint32_t> wanted;
    for (std::size_t u = 0; u < bounds.size(); ++u)
      if (bounds[u] >= at_least && of_correspondence[finder.vertices(u)[i]] == unknown) {
        of_correspondence[finder.vertices(u)[i]] = 0;
        wanted.push_back(finder.vertices(u)[i]);
      }
    parallel_for(
        how, "global matching", wanted.size(),
        [&](std::size_t k) { of_correspondence[wanted[k]] = finder.bound(wanted[k]); }, 64);
    for (std::size_t u = 0; u < bounds.size(); ++u)
      bounds[u] = std::min(bounds[u], of_correspondence[finder.vertices(u)[i]]);
  }
  return bounds;
}

/// A seed and the size of its consensus set.
struct seed_consensus {
  std::size_t seed, size;

  /// Algorithm 1, line 10: the larger set, of equally large ones that of the first seed.
  bool beats(const seed_consensus& other) const {
    return size > other.size || (size == other.size && seed < other.seed);
  }
};

/// The best of some seeds, all of them looked at.
inline seed_consensus best_seed(const consensus_finder& finder, std::span<const std::uint32_t> seeds,
                                const execution& how = {}) {
  std::vector<std::size_t> sizes(seeds.size());
  parallel_chunks(how, "global matching", seeds.size(), 8, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint8_t> agreeing;
    for (std::size_t k = begin; k < end; ++k) sizes[k] = finder.consensus_size(seeds[k], agreeing);
  });
  seed_consensus best{seeds.front(), sizes.front()};
  for (std::size_t k = 1; k < seeds.size(); ++k)
    if (const seed_consensus other{seeds[k], sizes[k]}; other.beats(best)) best = other;
  return best;
}

/// The seeds in decreasing order of what they promise, the best of all of them, and how many had to be looked
/// at.
struct consensus_search {
  seed_consensus best;
  std::vector<std::uint32_t> order;
  std::size_t looked_at = 0;
};

/// The largest consensus set: the one that Algorithm 1 finds, without looking at seeds that cannot win. With
/// `sufficient` > 0 the search ends when a set of this size is found. At least one pair is needed.
inline consensus_search largest_consensus(const consensus_finder& finder, std::size_t sufficient = 0,
                                          const execution& how = {}) {
  constexpr std::size_t batch = 128;
  std::vector<std::uint32_t> order(finder.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return finder.votes(a) > finder.votes(b); });
  std::size_t looked_at = std::min(batch, order.size());
  seed_consensus best = best_seed(finder, std::span(order).first(looked_at), how);
  if (sufficient > 0 && best.size >= sufficient) return {best, std::move(order), looked_at};

  const auto bounds = consensus_bounds(finder, best.size, how);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return bounds[a] > bounds[b]; });
  for (std::size_t begin = 0; begin < order.size(); begin += batch) {
    const auto can_win = [&](std::uint32_t u) { return bounds[u] >= best.size; };
    const auto next = std::span(order).subspan(begin, std::min(batch, order.size() - begin));
    const auto end = std::partition_point(next.begin(), next.end(), can_win);
    if (end == next.begin()) break;
    looked_at += std::size_t(end - next.begin());
    const seed_consensus other = best_seed(finder, {next.begin(), end}, how);
    if (other.beats(best)) best = other;
    if (sufficient > 0 && best.size >= sufficient) break;
  }
  return {best, std::move(order), looked_at};
}

/// Distinct hypotheses, verified over all stems, best first: that of the largest consensus set, and those of
/// the sets that promise most among the pairs it does not explain. `tolerance` is epsilon [m]. `tested`
/// receives the number of consensus sets that were counted.
inline std::vector<hypothesis> match_globally(const map_pair& maps, std::span<const triangle_pair> pairs,
                                              double tolerance, const global_matching_options& options = {},
                                              const execution& how = {}, std::size_t* tested = nullptr) {
  require_valid(options);
  if (pairs.empty()) return {};
  const consensus_finder finder(maps, pairs, tolerance, how);
  const consensus_search search = largest_consensus(finder, options.sufficient, how);
  if (tested) *tested = search.looked_at;
  std::vector<hypothesis> hypotheses;
  const auto verify_seed = [&](std::size_t seed) {
    const auto consensus = finder.consensus(seed);
    auto h = verify(maps, vote_correspondences(pairs, consensus), tolerance);
    if (!h) return;
    h->consensus = consensus.size();
    add_distinct(std::move(*h), hypotheses, maps);
  };
  verify_seed(search.best.seed);
  int verified = 1;
  for (const std::uint32_t seed : search.order) {
    if (verified == options.most_seeds || hypotheses.size() == std::size_t(options.most_hypotheses)) break;
    const auto explains = [&](const hypothesis& h) {
      return leads_to(correspondences_of(pairs[seed]), h, maps);
    };
    if (std::any_of(hypotheses.begin(), hypotheses.end(), explains)) continue;
    verify_seed(seed);
    ++verified;
  }
  rank(hypotheses);
  return hypotheses;
}

}  // namespace GLOBALMATCH_THREADING
}  // namespace globalmatch
