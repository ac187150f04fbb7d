// Evidence: what speaks for a transform. This is the contract that each kind of evidence fulfils.
//
// A kind proposes hypotheses of its own, and scores any: with the number of false alarms (NFA), the number of
// transforms that are expected to do as well as this one if source and target had nothing to do with each
// other. Each kind has a null model, which says what is expected of unrelated maps:
//
//   position_evidence   how many stems are near others    null_model: density and lattice of the target
//   planting_evidence   how many gaps match, in a regular plantation     each place is a gap with their share
//                       residuals of positions, and of radii     residuals under all shifts of the lattice
//
// A new kind is a class like these, and a step of `add_evidence.hpp`.
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <vector>

#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/matching.hpp"

namespace globalmatch::detail {

/// What one kind of evidence makes of a transform.
struct evidence_score {
  double log10_nfa = 0;
  evidence_source source = evidence_source::positions;
  double log10_nfa_poisson = 0;  ///< of positions: the same if stems stood at random
};

template <class E>
concept evidence = requires(const E& kind, const local_hypothesis& h, std::size_t maximum) {
  { kind.propose(maximum) } -> std::same_as<std::vector<local_hypothesis>>;  // at most so many
  { kind.score(h) } -> std::same_as<evidence_score>;
};

/// The one rule that combines kinds: a hypothesis has the NFA of positions, or that of another kind where
/// this is smaller and below 0.01. The best of all transforms of a lattice has an NFA of about 1, and is no
/// evidence. Nor are a few stems at the edge of a plantation that happen to fit: where they are not many more
/// than at random, the lattices are not even aligned.
inline void combine(local_hypothesis& h, const evidence_score& other) {
  constexpr double significant = -2;
  const double combined = std::max(other.log10_nfa, h.log10_nfa_poisson);
  if (combined >= h.log10_nfa || combined >= significant) return;
  h.evidence = other.source;
  h.log10_nfa = combined;
}

}  // namespace globalmatch::detail
