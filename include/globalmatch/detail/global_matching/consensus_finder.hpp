// Consensus sets of triangle pairs ([GM] Eq. (5), Algorithm 1): which pairs agree. In: triangle pairs. Out:
// the consensus set of a seed. Memory: quadratic in the stems.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/distance_cells.hpp"
#include "globalmatch/detail/core/keyed_sort.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/local_matching.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::detail {

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
/// of its own. Refers to both sets of positions.
class consensus_finder {
 public:
  /// `epsilon` is epsilon [m]. Memory: quadratic in the stems, linear in the pairs.
  consensus_finder(const position_set& source, const position_set& target, bool horizontal,
                   std::span<const triangle_pair> pairs, double epsilon, const execution& exec = {})
      : source_(source),
        target_stems_(target),
        horizontal_(horizontal),
        epsilon_(epsilon),
        target_(target, horizontal, epsilon, exec),
        vertices_(pairs.size()) {
    number_of_.assign(source_.size() * target_.size(), none);
    for (const triangle_pair& pair : pairs)
      for (const correspondence& c : correspondences_of(pair)) number_of_[place(c)] = 0;
    for (stem_index s = 0; s < source_.size(); ++s)
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
    for (auto& v : vertices_) {  // that of most votes first; equal ones keep their order
      if (votes_[v[1]] > votes_[v[0]]) std::swap(v[0], v[1]);
      if (votes_[v[2]] > votes_[v[1]]) std::swap(v[1], v[2]);
      if (votes_[v[1]] > votes_[v[0]]) std::swap(v[0], v[1]);
    }
    for (const auto& v : vertices_) ++first_pair_[v[0] + 1];
    for (std::size_t c = 1; c < first_pair_.size(); ++c) first_pair_[c] += first_pair_[c - 1];
    by_first_vertex_.resize(pairs.size());
    auto next = first_pair_;
    for (std::uint32_t u = 0; u < pairs.size(); ++u) by_first_vertex_[next[vertices_[u][0]]++] = u;
  }

  std::size_t size() const { return vertices_.size(); }
  const position_set& source() const { return source_; }
  const position_set& target() const { return target_stems_; }
  /// Whether distances are those in the horizontal plane.
  bool horizontal() const { return horizontal_; }
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
    for (stem_index s = 0; s < source_.size(); ++s) {
      const double distance = stem_distance(source_.at[source], source_.at[s], horizontal_);
      const auto row = number_of_.begin() + std::ptrdiff_t(place({s, 0}));
      target_.for_each_at(target, distance, [&](stem_index t) {
        if (row[t] != none) visit(row[t]);
      });
    }
  }

  std::size_t place(const correspondence& c) const {
    return std::size_t(c.source) * target_.size() + c.target;
  }

  const position_set &source_, &target_stems_;
  bool horizontal_;
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
  std::vector<std::size_t> votes(finder.correspondences().size());
  for (const std::uint32_t u : consensus)
    for (const std::uint32_t c : finder.vertices(u)) ++votes[c];
  std::vector<keyed> order, chosen;
  for (std::size_t c = 0; c < votes.size(); ++c)
    if (votes[c] > 0) order.push_back({~std::uint64_t(votes[c]), c});  // correspondences increase
  sort_keyed(order);
  std::vector<bool> source_taken(finder.source().size()), target_taken(finder.target().size());
  for (const keyed& next : order) {
    const auto [s, t] = finder.correspondences()[next.value];
    if (source_taken[s] || target_taken[t]) continue;
    source_taken[s] = target_taken[t] = true;
    chosen.push_back({next.value, 0});
  }
  sort_keyed(chosen);
  std::vector<correspondence> pairs;
  for (const keyed& c : chosen) pairs.push_back(finder.correspondences()[c.key]);
  return pairs;
}

}  // namespace globalmatch::detail
