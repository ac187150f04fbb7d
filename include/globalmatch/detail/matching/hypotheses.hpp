// Hypotheses: transforms with the stems they pair, ranked and distinct.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/rigid.hpp"
#include "globalmatch/detail/matching/matching_context.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::detail {

/// A hypothesis in the levelled local frames; the members are those of `globalmatch::hypothesis`.
struct local_hypothesis {
  std::vector<correspondence> correspondences;  ///< one to one, increasing
  rigid target_from_source;
  double inlier_threshold = 0;   ///< [m] stems this near each other were paired
  double log10_nfa = 0;          ///< see `evidence.hpp`
  double log10_nfa_poisson = 0;  ///< the same if stems stood at random
  evidence_source evidence = evidence_source::positions;
  double rms = 0;             ///< [m] distance of paired stems
  std::size_t consensus = 0;  ///< triangle pairs in its consensus set
};

/// The smaller NFA first, then that of more paired stems, then of nearer ones, then of larger
/// consensus sets.
inline bool ranks_before(const local_hypothesis& a, const local_hypothesis& b) {
  if (a.log10_nfa != b.log10_nfa) return a.log10_nfa < b.log10_nfa;
  if (a.correspondences.size() != b.correspondences.size())
    return a.correspondences.size() > b.correspondences.size();
  if (a.rms != b.rms) return a.rms < b.rms;
  return a.consensus > b.consensus;
}

/// Ranks hypotheses, the best first; equal ones keep their order. They are few.
inline void rank(std::vector<local_hypothesis>& hypotheses) {
  for (std::size_t i = 1; i < hypotheses.size(); ++i)
    for (std::size_t j = i; j > 0 && ranks_before(hypotheses[j], hypotheses[j - 1]); --j)
      std::swap(hypotheses[j], hypotheses[j - 1]);
}

/// Ranks hypotheses and forgets all but the `maximum` best.
inline void keep_best(std::vector<local_hypothesis>& hypotheses, std::size_t maximum) {
  rank(hypotheses);
  while (hypotheses.size() > maximum) hypotheses.pop_back();
}

/// Whether two hypotheses place the source stems paired by either at positions that differ by more than
/// `distance` [m] on average: they then are alternatives and not two views of one transform.
inline bool differ(const local_hypothesis& a, const local_hypothesis& b, const matching_context& context,
                   double distance) {
  double sum = 0;
  for (const local_hypothesis* h : {&a, &b})
    for (const correspondence& c : h->correspondences)
      sum += context.displacement(a.target_from_source, b.target_from_source, c.source);
  const std::size_t count = a.correspondences.size() + b.correspondences.size();
  return count == 0 || sum > distance * double(count);
}

/// Whether a triangle's transform would lead to a known hypothesis again: two correspondences fix a
/// transform, so two shared ones whose stems are apart are enough.
inline bool leads_to(const std::array<correspondence, 3>& triangle, const local_hypothesis& known,
                     const matching_context& context) {
  constexpr double apart = 2;  // [m] of two stems that fix a transform
  bool shared[3];
  for (std::size_t i = 0; i < 3; ++i) {
    const vec3 transformed = known.target_from_source * context.source.at[triangle[i].source];
    shared[i] = stem_distance(transformed, context.target.at[triangle[i].target],
                              context.horizontal_distances()) < 2 * known.inlier_threshold;
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    if (shared[i] && shared[j] &&
        stem_distance(context.target.at[triangle[i].target], context.target.at[triangle[j].target], true) >
            apart)
      return true;
  }
  return false;
}

/// Adds a hypothesis that the prior allows to distinct ones; where it is another view of some of them the
/// best of all stays.
inline void add_distinct(local_hypothesis&& h, std::vector<local_hypothesis>& hypotheses,
                         const matching_context& context) {
  if (!context.allows(h.target_from_source)) return;
  std::vector<local_hypothesis> others;
  others.reserve(hypotheses.size() + 1);
  for (local_hypothesis& other : hypotheses) {
    if (differ(h, other, context, 2 * std::max(h.inlier_threshold, other.inlier_threshold)))
      others.push_back(std::move(other));
    else if (!ranks_before(h, other))
      h = std::move(other);
  }
  others.push_back(std::move(h));
  hypotheses = std::move(others);
}

/// The hypothesis with source and target exchanged.
inline local_hypothesis reversed(local_hypothesis h) {
  h.target_from_source = h.target_from_source.inverse();
  for (correspondence& c : h.correspondences) std::swap(c.source, c.target);
  sort_correspondences(h.correspondences);
  return h;
}

}  // namespace globalmatch::detail
