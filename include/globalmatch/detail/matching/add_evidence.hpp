// Scoring ranked hypotheses by all kinds of evidence: positions first and, in a regular plantation where
// these do not decide, its gaps and residuals.
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "globalmatch/detail/matching/evidence.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/detail/matching/indexed_matching.hpp"
#include "globalmatch/detail/matching/lattice_alternatives.hpp"
#include "globalmatch/detail/matching/matching_context.hpp"
#include "globalmatch/detail/matching/planting_evidence.hpp"
#include "globalmatch/detail/matching/planting_lattice.hpp"
#include "globalmatch/detail/matching/position_evidence.hpp"
#include "globalmatch/detail/matching/refine_threshold.hpp"
#include "globalmatch/detail/matching/robust_fit.hpp"
#include "globalmatch/detail/matching/verify.hpp"
#include "globalmatch/detail/matching/visibility_evidence.hpp"

namespace globalmatch::detail {

/// Refits the best of ranked hypotheses, scores the others at its threshold, and adds those of the lattice
/// that it may be confused with: what a coarse threshold makes of an alternative counts for nothing where a
/// fine one explains the stems.
inline void refine(std::vector<local_hypothesis>& hypotheses, position_evidence& positions,
                   const matching_context& context) {
  local_hypothesis best = std::move(hypotheses.front());
  fit_robustly(best, context);
  positions.include_lattice_of(best);
  const evidence_score scored = positions.score(best);
  best.log10_nfa = scored.log10_nfa;
  best.log10_nfa_poisson = scored.log10_nfa_poisson;
  const local_hypothesis before = best;
  const bool changed = refine_threshold(best, positions, context);
  const double inlier_threshold = best.inlier_threshold;
  std::vector<local_hypothesis> alternatives = lattice_alternatives(best, context);
  if (changed) alternatives.push_back(before);
  for (std::size_t i = 1; i < hypotheses.size(); ++i) alternatives.push_back(std::move(hypotheses[i]));
  hypotheses.clear();
  hypotheses.push_back(std::move(best));
  for (local_hypothesis& alternative : alternatives) {
    positions.refit(alternative, {&inlier_threshold, 1});
    add_distinct(std::move(alternative), hypotheses, context);
  }
  rank(hypotheses);
}

/// Adds the hypotheses of another kind of evidence, scores all by both kinds, and ranks them. Stems are
/// paired within `search_radius` [m] first, as far as they are on the lattice.
template <evidence Evidence>
void add_evidence(const Evidence& other, double search_radius, const position_evidence& positions,
                  const matching_context& context, std::vector<local_hypothesis>& hypotheses) {
  constexpr std::size_t maximum = 16;  // transforms of the lattice that are tried
  std::vector<local_hypothesis> candidates = other.propose(maximum);
  // A few stems that happen to fit closely are a hypothesis as well, though most stems place it elsewhere.
  for (const local_hypothesis& h : hypotheses)
    if (auto with_all_stems =
            verify(context, context.pair_stems(h.target_from_source, search_radius), search_radius))
      candidates.push_back(std::move(*with_all_stems));
  for (local_hypothesis& h : candidates) {
    // On a lattice the NFA is as large at any threshold; that of what was found so far may not fit.
    const double inlier_threshold = threshold_from_residuals(context, h, positions.pairing());
    positions.refit(h, {&inlier_threshold, 1});
    combine(h, other.score(h));
    add_distinct(std::move(h), hypotheses, context);
  }
  rank(hypotheses);
}

/// The lattices of both maps, where the target is a regular plantation.
struct plantation {
  std::optional<lattice_shifts> source, target;
};

/// Asks the evidence of a plantation where positions do not decide.
inline void add_planting_evidence(const plantation& planted, const position_evidence& positions,
                                  const matching_context& context,
                                  std::vector<local_hypothesis>& hypotheses) {
  const auto is_decided = [&] { return hypotheses.front().log10_nfa <= sufficient_log10_nfa; };
  if (!planted.target || is_decided()) return;
  const double search_radius = planted.target->search_radius();
  planting_evidence planting(context, planted.source, *planted.target, hypotheses);
  add_evidence(planting, search_radius, positions, context, hypotheses);
  if (is_decided()) return;
  planting.use_residuals(hypotheses);
  add_evidence(planting, search_radius, positions, context, hypotheses);
}

/// Puts the hypothesis first that visibility and positions together support best, where positions do not
/// decide: at its threshold the others are scored.
inline void put_first_by_visibility(const scan_views& views, const matching_context& context,
                                    std::vector<local_hypothesis>& hypotheses) {
  if (hypotheses.front().log10_nfa <= sufficient_log10_nfa) return;
  const visibility_evidence visibility(context, views);
  if (!visibility.is_known()) return;
  std::vector<double> log10_nfas;
  for (const local_hypothesis& h : hypotheses) log10_nfas.push_back(visibility.score(h).log10_nfa);
  const auto first = std::min_element(log10_nfas.begin(), log10_nfas.end()) - log10_nfas.begin();
  std::rotate(hypotheses.begin(), hypotheses.begin() + first, hypotheses.begin() + first + 1);
}

/// Asks the evidence of visibility where nothing else decides. Not for plantations: between the rows of one
/// that is placed on another scanners see past no stems, wherever along the rows it is.
inline void add_visibility_evidence(const scan_views& views, const matching_context& context,
                                    std::vector<local_hypothesis>& hypotheses) {
  if (hypotheses.front().log10_nfa <= sufficient_log10_nfa) return;
  const visibility_evidence visibility(context, views);
  if (!visibility.is_known()) return;
  for (local_hypothesis& h : hypotheses) {
    const evidence_score scored = visibility.score(h);
    if (scored.log10_nfa >= h.log10_nfa) continue;
    h.log10_nfa = scored.log10_nfa;
    h.evidence = scored.source;
  }
  rank(hypotheses);
}

}  // namespace globalmatch::detail
