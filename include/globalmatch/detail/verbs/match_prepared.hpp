// One search of stem matching composed: propose hypotheses, refine each over all stems, score them against
// the null model, decide.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/matching/add_evidence.hpp"
#include "globalmatch/detail/matching/decision.hpp"
#include "globalmatch/detail/matching/position_evidence.hpp"
#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "globalmatch/detail/matching/prior.hpp"
#include "globalmatch/detail/matching/robust_fit.hpp"
#include "globalmatch/detail/matching/scale_fit.hpp"
#include "globalmatch/detail/matching/uncertainty.hpp"
#include "globalmatch/detail/matching/vertical_fit.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/matching_options.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::detail {

/// From the levelled local frames of two position sets to the frames and indices of their callers.
inline hypothesis in_caller_frames(local_hypothesis&& h, const position_set& source,
                                   const position_set& target) {
  for (correspondence& c : h.correspondences) c = {source.original[c.source], target.original[c.target]};
  sort_correspondences(h.correspondences);
  const rigid transform =
      target.frame.local_from_scan().inverse() * h.target_from_source * source.frame.local_from_scan();
  return {std::move(h.correspondences),
          to_eigen(transform),
          h.inlier_threshold,
          h.log10_nfa,
          h.log10_nfa_poisson,
          h.evidence,
          h.rms,
          h.consensus};
}

/// Removes alternatives that are not significant, but for the next best one.
inline void remove_insignificant(std::vector<local_hypothesis>& hypotheses, const decision_options& options) {
  std::size_t kept = std::min<std::size_t>(2, hypotheses.size());
  for (std::size_t i = kept; i < hypotheses.size(); ++i) {
    local_hypothesis& h = hypotheses[i];
    if (std::min(h.log10_nfa, h.log10_nfa_poisson) > max_log10_nfa(options)) continue;
    if (kept != i) hypotheses[kept] = std::move(h);
    ++kept;
  }
  while (hypotheses.size() > kept) hypotheses.pop_back();
}

/// The vertical fit of the best hypothesis, which gets its height and its rotation.
inline local_vertical_fit fit_vertical_of(local_hypothesis& best, const matching_context& context,
                                          const matching_options& options) {
  if (options.dof == degrees_of_freedom::six) return fit_of_rotated(best, context);
  return fit_vertical(best, context, !options.dof, options.horizontal);
}

/// Decides on the hypotheses, which are in the frames of `context`, and writes all to `result` in the frames
/// of the caller.
inline void conclude(matching& result, std::vector<local_hypothesis>&& hypotheses,
                     const matching_context& context, const matching_options& options) {
  decision decided = decide(hypotheses, context, options.decision);
  result.outcome = decided.outcome;
  result.reason = std::move(decided.reason);
  result.probability = probability_of(hypotheses, options.decision);
  if (result.outcome == outcome::ambiguous)  // one of two that are about as good, or of more
    result.probability = std::min(result.probability, 0.5);
  if (hypotheses.empty()) {
    result.inlier_threshold = options.inlier_threshold.value_or(proposal_thresholds[3]);
    return;
  }
  local_hypothesis& best = hypotheses.front();
  if (result.outcome == outcome::registered) {
    const local_vertical_fit vertical = fit_vertical_of(best, context, options);
    result.scale = fit_scale(best, context);
    if (auto local = uncertainty_of(best, context, vertical)) {
      if (result.scale)
        add_distortion(local->covariance, *result.scale, radius_of_pairs(best, context.source));
      result.uncertainty.emplace(in_caller_frame(*local, context.target.frame));
    }
    result.vertical.emplace(vertical.fit);
    if (options.dof == degrees_of_freedom::six && result.uncertainty) {  // and what errors have in common
      result.vertical->sigma = std::hypot(height_sigma(*result.uncertainty), vertical.fit.sigma);
      if (vertical.fit.sigma > 0) set_height_variance(*result.uncertainty, height_variance(*result.vertical));
    }
  }
  result.inlier_threshold = best.inlier_threshold;
  result.funnel.consensus = best.consensus;
  result.funnel.correspondences = best.correspondences.size();
  poll_cancelled();
  result.hypotheses.reserve(hypotheses.size());
  for (local_hypothesis& h : hypotheses)
    result.hypotheses.push_back(in_caller_frames(std::move(h), context.source, context.target));
  if (result.outcome == outcome::registered)
    result.target_from_source.emplace(result.hypotheses.front().target_from_source);
}

inline void require_prepared_for(const prepared_stems& target, const position_set& source,
                                 const matching_options& options) {
  if (options.dof == degrees_of_freedom::six && !(source.has_heights && target.stems.has_heights))
    throw std::invalid_argument("dof: six degrees of freedom need heights in both maps");
  const bool horizontal_distances = options.dof != degrees_of_freedom::six;
  if (options.proposal == proposal::triangle_index && horizontal_distances != target.horizontal_distances)
    throw std::invalid_argument(
        horizontal_distances ? "target was prepared for distances in space; prepare it with dof four"
                             : "target was prepared for horizontal distances; prepare it with dof six");
}

/// Says of maps on equal lattices, of which no transform is better than others, that it is this.
inline void tell_of_lattices(matching& result, const plantation& planted, std::size_t stems) {
  constexpr double enough = 0.5;  // of the stems are paired, or none as each transform pairs as many
  const bool few =
      result.funnel.correspondences > 0 && double(result.funnel.correspondences) < enough * double(stems);
  if (result.outcome != outcome::not_registered || !planted.source || !planted.target || few) return;
  const auto agree = [&](const vec2& a, const vec2& b) {
    return std::abs(a.norm() - b.norm()) < planted.target->search_radius();
  };
  if (!agree(planted.source->first, planted.target->first) ||
      !agree(planted.source->second, planted.target->second))
    return;
  result.outcome = outcome::ambiguous;
  result.probability = std::min(result.probability, 0.5);
  result.reason =
      "matching: the stems of both maps stand on a lattice, and fit as well when they are shifted along it; "
      "gaps in it, or stems beside it, are needed to distinguish them";
}

/// The prior of the options between two maps, of which the caller's source is the second one where they are
/// `swapped`.
inline std::optional<local_prior> prior_between(const position_set& source, const position_set& target,
                                                const matching_options& options, bool swapped) {
  if (!options.prior || source.size() == 0 || target.size() == 0) return std::nullopt;
  return swapped ? local_prior(*options.prior, target, source).reversed()
                 : local_prior(*options.prior, source, target);
}

/// Matches positions against a prepared map; their frames may be levelled by different ups. `swapped`: the
/// prepared map is the caller's source; `exhaustive` as in `position_evidence`; `views`: what the scanners of
/// `source` and `target` saw, if that is known.
inline matching match_prepared(const position_set& source, const prepared_stems& target,
                               const matching_options& options, const execution& exec, bool swapped = false,
                               bool exhaustive = true, const scan_views* views = nullptr) {
  require_prepared_for(target, source, options);
  const parallel_scope scope(exec, "verification");
  matching result;
  const bool horizontal =
      !options.dof || options.horizontal || !source.has_heights || !target.stems.has_heights;
  const matching_context context(source, target.stems, std::make_shared<position_index>(source, exec),
                                 target.index, horizontal, options.dof.value_or(degrees_of_freedom::four),
                                 exec, prior_between(source, target.stems, options, swapped));
  plantation planted;
  if (target.background->has_lattice())
    planted = {find_lattice(*context.source_index), find_lattice(*context.target_index)};
  result.funnel.source_stems = source.size() + source.coincident;
  result.funnel.target_stems = target.stems.size() + target.stems.coincident;
  result.funnel.source_coincident = source.coincident;
  result.funnel.target_coincident = target.stems.coincident;

  position_evidence positions(context, target, options, result.funnel, exhaustive);
  if (const auto& lattice = swapped ? planted.source : planted.target)
    result.lattice.emplace(planting_lattice{to_eigen(lattice->first), to_eigen(lattice->second)});
  if (planted.target && context.prior && context.prior->separates(planted.target->first.norm())) {
    positions.leave_out_lattice();
    planted = {};
  }
  std::vector<local_hypothesis> hypotheses = positions.propose(max_hypotheses);
  if (planted.source || planted.target) views = nullptr;
  if (!hypotheses.empty()) {
    if (views) put_first_by_visibility(*views, context, hypotheses);
    refine(hypotheses, positions, context);
    add_planting_evidence(planted, positions, context, hypotheses);
    if (views && !positions.may_be_planted()) add_visibility_evidence(*views, context, hypotheses);
    keep_best(hypotheses, max_hypotheses);
    complete_pairs(hypotheses.front(), context, positions.pairing());
    // Refitting may have moved them away from the prior, which was counted in their favour.
    std::erase_if(hypotheses, [&](const auto& h) { return !context.allows(h.target_from_source); });
    remove_insignificant(hypotheses, options.decision);
  }
  if (swapped) {
    for (local_hypothesis& h : hypotheses) h = reversed(std::move(h));
    std::swap(result.funnel.source_stems, result.funnel.target_stems);
    std::swap(result.funnel.source_coincident, result.funnel.target_coincident);
    std::swap(result.funnel.source_triangles, result.funnel.target_triangles);
  }
  conclude(result, std::move(hypotheses), swapped ? context.reversed() : context, options);
  tell_of_lattices(result, planted, std::min(source.size(), target.stems.size()));
  return result;
}

/// Matches sets of positions by one way of measuring distances: the larger one is indexed, the smaller one
/// queries.
inline matching match_once(position_set source, position_set target, const matching_options& options,
                           const execution& exec, const scan_views* views, bool exhaustive = true) {
  if (options.proposal == proposal::algorithm_1)
    return match_prepared(source, without_triangles(std::move(target), true, exec), options, exec, false,
                          true, views);
  const bool horizontal_distances = options.dof != degrees_of_freedom::six,
             swapped = source.size() > target.size();
  if (swapped) std::swap(source, target);
  scan_views in_order;
  if (views) in_order = swapped ? views->reversed() : *views;
  const prepared_stems prepared =
      prepare_stems(std::move(target), horizontal_distances, exec, source.size(), exhaustive);
  return match_prepared(source, prepared, options, exec, swapped, exhaustive, views ? &in_order : nullptr);
}

}  // namespace globalmatch::detail
