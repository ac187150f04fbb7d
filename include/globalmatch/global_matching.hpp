// Global matching ([GM] 3.2.3, Algorithm 1): the largest consensus set of triangle pairs, and others that
// rival it, as ranked hypotheses. In: locally matched triangle pairs. Out: distinct hypotheses, best first.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <optional>
#include <set>
#include <span>
#include <stdexcept>
#include <unordered_map>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/distance_cells.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/hypothesis.hpp"
#include "globalmatch/local_matching.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch {

struct global_matching_options {
  int max_hypotheses = 10;  ///< distinct ones that are returned (ours)
  int max_seeds = 200;      ///< consensus sets that are verified for them (ours)
  /// A consensus set of this many triangle pairs ends the search ([GM] 3.2.3: "a sufficient number", without
  /// a value); 0: the search is exhaustive.
  std::size_t sufficient = 0;
};

/// Throws `std::invalid_argument` naming the field that makes no sense.
inline void require_valid(const global_matching_options& options) {
  if (options.max_hypotheses < 2)
    throw std::invalid_argument("global_matching.max_hypotheses must be at least 2");
  if (options.max_seeds < options.max_hypotheses)
    throw std::invalid_argument("global_matching.max_seeds must be at least max_hypotheses");
}

/// The stem correspondences of a triangle pair.
inline std::array<correspondence, 3> correspondences_of(const triangle_pair& pair) {
  return {
      {{pair.source[0], pair.target[0]}, {pair.source[1], pair.target[1]}, {pair.source[2], pair.target[2]}}};
}

/// Some triangle pairs of all, a bit for each.
using pair_set = std::vector<std::uint64_t>;

/// Which triangle pairs agree: D_global ([GM] Eq. (5)) is less than the tolerance. Agreement of triangle
/// pairs comes down to that of stem correspondences: those of one pair must all agree with those of the
/// other. So the consensus set of a seed pair are the pairs made of correspondences that agree with all three
/// of its own. Refers to the maps.
class consensus_finder {
 public:
  /// `epsilon` is epsilon [m]. Memory: quadratic in the stems, linear in the pairs.
  consensus_finder(const matching_context& both, std::span<const triangle_pair> pairs, double epsilon,
                   const execution& exec = {})
      : context_(both),
        epsilon_(epsilon),
        target_(both.target, both.horizontal, epsilon, exec),
        vertices_(pairs.size()) {
    number_of_.assign(context_.source.size() * target_.size(), none);
    for (const triangle_pair& pair : pairs)
      for (const correspondence& c : correspondences_of(pair)) number_of_[place(c)] = 0;
    for (stem_index s = 0; s < context_.source.size(); ++s)
      for (stem_index t = 0; t < target_.size(); ++t)
        if (std::uint32_t& number = number_of_[place({s, t})]; number != none) {
          number = static_cast<std::uint32_t>(correspondences_.size());
          correspondences_.push_back({s, t});
        }
    votes_.assign(correspondences_.size(), 0);
    first_pair_.assign(correspondences_.size() + 1, 0);
    for (std::size_t u = 0; u < pairs.size(); ++u)
      for (std::size_t i = 0; i < 3; ++i) {
        vertices_[u][i] = number_of_[place(correspondences_of(pairs[u])[i])];
        ++votes_[vertices_[u][i]];
      }
    for (auto& v : vertices_)
      std::sort(v.begin(), v.end(), [&](std::uint32_t a, std::uint32_t b) { return votes_[a] > votes_[b]; });
    for (const auto& v : vertices_) ++first_pair_[v[0] + 1];
    std::partial_sum(first_pair_.begin(), first_pair_.end(), first_pair_.begin());
    by_first_vertex_.resize(pairs.size());
    auto next = first_pair_;
    for (std::uint32_t u = 0; u < pairs.size(); ++u) by_first_vertex_[next[vertices_[u][0]]++] = u;
  }

  std::size_t size() const { return vertices_.size(); }
  const matching_context& context() const { return context_; }
  double epsilon() const { return epsilon_; }
  const distance_cells& target_distances() const { return target_; }
  /// The distinct correspondences of the pairs, increasing. Their places here are their numbers.
  std::span<const correspondence> correspondences() const { return correspondences_; }
  /// Of each correspondence: the pairs that it is part of.
  std::span<const std::uint32_t> votes() const { return votes_; }
  /// The numbers of a pair's correspondences, that of most votes first.
  const std::array<std::uint32_t, 3>& vertices(std::size_t u) const { return vertices_[u]; }
  /// Votes for all correspondences of a pair: how much it promises before anything is compared.
  std::size_t votes_for(std::size_t u) const {
    const auto& [a, b, c] = vertices_[u];
    return std::size_t(votes_[a]) + votes_[b] + votes_[c];
  }

  /// No consensus set of a seed with this correspondence has more pairs: each takes three votes.
  std::size_t bound(std::uint32_t c) const {
    std::size_t votes = 0;
    for_each_agreeing(c, [&](std::uint32_t other) { votes += votes_[other]; });
    return 1 + votes / 3;
  }

  /// The pairs all of whose correspondences agree with this one. `agrees` is reused memory, and zeros between
  /// calls.
  pair_set agreeing_pairs(std::uint32_t c, std::vector<std::uint8_t>& agrees) const {
    agrees.resize(correspondences_.size());
    std::vector<std::uint32_t> agreeing;
    for_each_agreeing(c, [&](std::uint32_t other) {
      agrees[other] = 1;
      agreeing.push_back(other);
    });
    pair_set found((size() + 63) / 64);
    for (const std::uint32_t first : agreeing)
      for (std::size_t k = first_pair_[first]; k < first_pair_[first + 1]; ++k) {
        const std::uint32_t u = by_first_vertex_[k];
        if (agrees[vertices_[u][1]] && agrees[vertices_[u][2]]) found[u / 64] |= std::uint64_t(1) << u % 64;
      }
    for (const std::uint32_t other : agreeing) agrees[other] = 0;
    return found;
  }

  /// The consensus set of seed `u`, itself included, increasing ([GM] Algorithm 1, lines 2 to 9).
  std::vector<std::uint32_t> consensus(std::size_t u) const {
    std::vector<std::uint8_t> agrees;
    const auto& [a, b, c] = vertices_[u];
    const pair_set with_a = agreeing_pairs(a, agrees), with_b = agreeing_pairs(b, agrees),
                   with_c = agreeing_pairs(c, agrees);
    std::vector<std::uint32_t> members;
    for (std::size_t word = 0; word < with_a.size(); ++word) {
      std::uint64_t bits = with_a[word] & with_b[word] & with_c[word];
      if (word == u / 64) bits |= std::uint64_t(1) << u % 64;
      for (; bits != 0; bits &= bits - 1)
        members.push_back(static_cast<std::uint32_t>(64 * word + std::size_t(std::countr_zero(bits))));
    }
    return members;
  }

 private:
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

  /// Calls `visit(number)` for the correspondences that agree with this one: each other source stem looks for
  /// target stems as far away.
  template <class Visit>
  void for_each_agreeing(std::uint32_t c, const Visit& visit) const {
    const auto [source, target] = correspondences_[c];
    for (stem_index s = 0; s < context_.source.size(); ++s) {
      const double distance =
          stem_distance(context_.source.at[source], context_.source.at[s], context_.horizontal);
      const auto row = number_of_.begin() + std::ptrdiff_t(place({s, 0}));
      target_.for_each_at(target, distance, [&](stem_index t) {
        if (row[t] != none) visit(row[t]);
      });
    }
  }

  std::size_t place(const correspondence& c) const {
    return std::size_t(c.source) * target_.size() + c.target;
  }

  const matching_context& context_;
  double epsilon_;
  distance_cells target_;
  std::vector<std::array<std::uint32_t, 3>> vertices_;
  std::vector<correspondence> correspondences_;
  std::vector<std::uint32_t> number_of_;  // of a correspondence, by place: source by target
  std::vector<std::uint32_t> votes_;
  std::vector<std::size_t> first_pair_;  // where those begin whose first vertex it is
  std::vector<std::uint32_t> by_first_vertex_;
};

/// The stem correspondences of a consensus set, each stem at most once: those that most triangle pairs vote
/// for.
inline std::vector<correspondence> vote_correspondences(const consensus_finder& finder,
                                                        std::span<const std::uint32_t> consensus) {
  std::vector<std::ptrdiff_t> votes(finder.correspondences().size());
  for (const std::uint32_t u : consensus)
    for (const std::uint32_t c : finder.vertices(u)) ++votes[c];
  std::vector<std::pair<std::ptrdiff_t, correspondence>> order;
  for (std::size_t c = 0; c < votes.size(); ++c)
    if (votes[c] > 0) order.push_back({-votes[c], finder.correspondences()[c]});
  std::sort(order.begin(), order.end());
  std::set<stem_index> sources, targets;
  std::vector<correspondence> chosen;
  for (const auto& [minus_votes, c] : order) {
    if (sources.contains(c.source) || targets.contains(c.target)) continue;
    sources.insert(c.source);
    targets.insert(c.target);
    chosen.push_back(c);
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

inline namespace GLOBALMATCH_THREADING {

/// Bounds on consensus sets that cost next to nothing: all votes for correspondences that agree with one of
/// the seed's, three for each member. Of those with many votes each is looked at; those with few are
/// only counted, distance by distance, as if each pair of stems were one. Refers to the finder.
class vote_bounds {
 public:
  explicit vote_bounds(const consensus_finder& finder, const execution& exec = {})
      : finder_(finder), context_(finder.context()) {
    // As many as a motion pairs at most: with few wrong ones those of the largest set.
    const auto votes = finder.votes();
    const std::size_t maximum = std::min({votes.size(), context_.source.size(), context_.target.size()});
    std::vector<std::uint32_t> order(votes.size());
    std::iota(order.begin(), order.end(), 0u);
    std::nth_element(order.begin(), order.begin() + std::ptrdiff_t(maximum), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return votes[a] > votes[b]; });
    few_ = maximum < votes.size() ? votes[order[maximum]] : 0;
    for (const std::uint32_t c : std::span(order).first(maximum)) {
      if (votes[c] <= few_) continue;
      popular_.push_back(finder.correspondences()[c]);
      votes_above_few_.push_back(votes[c] - few_);
    }
    target_distances_.resize(context_.target.size() * popular_.size());
    const auto measure = [&](std::size_t t) {
      double* distance = target_distances_.data() + t * popular_.size();
      for (const correspondence& p : popular_)
        *distance++ = stem_distance(context_.target.at[t], context_.target.at[p.target], context_.horizontal);
    };
    parallel_for(exec, "global matching", context_.target.size(), measure, 64);
  }

  /// Calls `visit(number, bound)` for the numbers of some correspondences, of which those with one source
  /// stem follow each other.
  template <class Visit>
  void for_each(std::span<const std::uint32_t> numbers, const Visit& visit) const {
    const distance_cells& cells = finder_.target_distances();
    const auto& at = context_.source.at;
    const double epsilon = finder_.epsilon();
    if (!distance_cells::countable(std::max(context_.source.size(), context_.target.size()))) {
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
        for (const Eigen::Vector3d& p : at)
          ++counts[cells.cell(stem_distance(at[s], p, context_.horizontal))];
        source_distances.clear();
        for (const correspondence& p : popular_)
          source_distances.push_back(stem_distance(at[s], at[p.source], context_.horizontal));
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
  const matching_context& context_;
  std::vector<correspondence> popular_;
  std::vector<std::int64_t> votes_above_few_;  // of the popular ones
  std::int64_t few_ = 0;                       // no other has more votes
  std::vector<double> target_distances_;       // from each target stem to those of the popular ones
};

/// The pairs that agree with a correspondence, kept as long as there is room. Refers to the finder.
class agreements {
 public:
  static constexpr std::size_t room = 1024;

  explicit agreements(const consensus_finder& finder) : finder_(finder) {}

  /// Makes ready what is asked for, of no more than `room` correspondences.
  void prepare(std::span<const std::uint32_t> numbers, const execution& exec = {}) {
    if (pairs_with_.size() + numbers.size() > room) pairs_with_.clear();
    std::vector<std::pair<std::uint32_t, pair_set*>> missing;
    for (const std::uint32_t c : numbers)
      if (const auto [entry, is_new] = pairs_with_.try_emplace(c); is_new)
        missing.push_back({c, &entry->second});
    parallel_chunks(exec, "global matching", missing.size(), 8, [&](std::size_t begin, std::size_t end) {
      std::vector<std::uint8_t> agrees;
      for (std::size_t k = begin; k < end; ++k)
        *missing[k].second = finder_.agreeing_pairs(missing[k].first, agrees);
    });
  }

  /// No seed with this correspondence has a larger consensus set.
  std::size_t bound(std::uint32_t c) const {
    std::size_t size = 1;  // the seed, which need not agree with itself
    for (const std::uint64_t bits : pairs_with_.at(c)) size += std::size_t(std::popcount(bits));
    return size;
  }

  /// Size of the consensus set of seed `u`, itself included.
  std::size_t consensus_size(std::size_t u) const {
    const auto& [a, b, c] = finder_.vertices(u);
    const pair_set &with_a = pairs_with_.at(a), &with_b = pairs_with_.at(b), &with_c = pairs_with_.at(c);
    const auto all = [&](std::size_t word) { return with_a[word] & with_b[word] & with_c[word]; };
    std::size_t size = (all(u / 64) >> u % 64 & 1) == 0;
    for (std::size_t word = 0; word < with_a.size(); ++word) size += std::size_t(std::popcount(all(word)));
    return size;
  }

 private:
  const consensus_finder& finder_;
  std::unordered_map<std::uint32_t, pair_set> pairs_with_;
};

/// Lowers the bound of each pair to that of each of its correspondences, as long as it is `at_least`.
/// `bound_all(numbers, of_correspondence)` bounds correspondences, whose numbers increase.
template <class BoundAll>
void lower_bounds(const consensus_finder& finder, std::size_t at_least, std::vector<std::size_t>& bounds,
                  const BoundAll& bound_all) {
  constexpr std::size_t unknown = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> of_correspondence(finder.correspondences().size(), unknown);
  for (std::size_t i = 0; i < 3; ++i) {  // those of most votes first: they rule out most
    std::vector<std::uint32_t> wanted;
    for (std::size_t u = 0; u < bounds.size(); ++u)
      if (const std::uint32_t c = finder.vertices(u)[i];
          bounds[u] >= at_least && of_correspondence[c] == unknown) {
        of_correspondence[c] = 0;
        wanted.push_back(c);
      }
    std::sort(wanted.begin(), wanted.end());
    bound_all(std::span<const std::uint32_t>(wanted), of_correspondence);
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

/// A seed and the size of its consensus set.
struct seed_consensus {
  std::size_t seed, size;

  /// Algorithm 1, line 10: the larger set, of equally large ones that of the first seed.
  bool beats(const seed_consensus& other) const {
    return size > other.size || (size == other.size && seed < other.seed);
  }
};

/// The best of some seeds, all of them looked at. At most a third of `agreements::room`.
inline seed_consensus best_seed(const consensus_finder& finder, std::span<const std::uint32_t> seeds,
                                agreements& agreeing, const execution& exec = {}) {
  std::vector<std::uint32_t> vertices;
  for (const std::uint32_t u : seeds)
    vertices.insert(vertices.end(), finder.vertices(u).begin(), finder.vertices(u).end());
  agreeing.prepare(vertices, exec);
  std::vector<std::size_t> sizes(seeds.size());
  parallel_for(
      exec, "global matching", seeds.size(),
      [&](std::size_t k) { sizes[k] = agreeing.consensus_size(seeds[k]); }, 32);
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
  std::size_t visited = 0;
};

/// The largest consensus set: the one that Algorithm 1 finds, without looking at seeds that cannot win. With
/// `sufficient` > 0 the search ends when a set of this size is found. At least one pair is needed.
inline consensus_search largest_consensus(const consensus_finder& finder, std::size_t sufficient = 0,
                                          const execution& exec = {}) {
  constexpr std::size_t batch = 256;
  agreements agreeing(finder);
  std::vector<std::uint32_t> order(finder.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return finder.votes_for(a) > finder.votes_for(b);
  });
  std::size_t visited = std::min(batch, order.size());
  seed_consensus best = best_seed(finder, std::span(order).first(visited), agreeing, exec);
  const auto done = [&] { return sufficient > 0 && best.size >= sufficient; };
  if (visited == order.size() || done()) return {best, std::move(order), visited};

  auto bounds = consensus_bounds(finder, best.size, exec);
  const auto promises_more = [&](std::uint32_t a, std::uint32_t b) { return bounds[a] > bounds[b]; };
  const auto can_win = [&](std::uint32_t u) { return bounds[u] >= best.size; };
  std::stable_sort(order.begin(), order.end(), promises_more);
  std::vector<std::uint32_t> seeds(order.begin(), std::partition_point(order.begin(), order.end(), can_win));
  lower_bounds_by_agreement(finder, best.size, bounds, agreeing, exec);
  std::stable_sort(seeds.begin(), seeds.end(), promises_more);
  for (std::size_t begin = 0; begin < seeds.size() && !done(); begin += batch) {
    const auto next = std::span(seeds).subspan(begin, std::min(batch, seeds.size() - begin));
    const auto end = std::partition_point(next.begin(), next.end(), can_win);
    if (end == next.begin()) break;
    visited += std::size_t(end - next.begin());
    const seed_consensus other = best_seed(finder, {next.begin(), end}, agreeing, exec);
    if (other.beats(best)) best = other;
  }
  return {best, std::move(order), visited};
}

/// Distinct hypotheses, verified over all stems, best first: that of the largest consensus set, and those of
/// the sets that promise most among the pairs it does not explain. `epsilon` is epsilon [m]. `tested`
/// receives the number of consensus sets that were counted.
inline std::vector<hypothesis> match_globally(const matching_context& context,
                                              std::span<const triangle_pair> pairs, double epsilon,
                                              const global_matching_options& options = {},
                                              const execution& exec = {}, std::size_t* tested = nullptr) {
  require_valid(options);
  if (pairs.empty()) return {};
  const consensus_finder finder(context, pairs, epsilon, exec);
  const consensus_search search = largest_consensus(finder, options.sufficient, exec);
  if (tested) *tested = search.visited;
  std::vector<hypothesis> hypotheses;
  const auto verify_seed = [&](std::size_t seed) {
    const auto consensus = finder.consensus(seed);
    auto h = verify(context, vote_correspondences(finder, consensus), epsilon);
    if (!h) return;
    h->consensus = consensus.size();
    add_distinct(std::move(*h), hypotheses, context);
  };
  verify_seed(search.best.seed);
  int verified = 1;
  for (const std::uint32_t seed : search.order) {
    if (verified == options.max_seeds || hypotheses.size() == std::size_t(options.max_hypotheses)) break;
    const auto explains = [&](const hypothesis& h) {
      return leads_to(correspondences_of(pairs[seed]), h, context);
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
