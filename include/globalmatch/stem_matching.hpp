// Stem matching ([GM] 3.2): two sets of stem positions -> the motion between their scans. Needs no ground, no
// scan.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/position_index.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/matching/background_density.hpp"
#include "globalmatch/detail/matching/consensus_proposal.hpp"
#include "globalmatch/detail/matching/decision.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/detail/matching/indexed_matching.hpp"
#include "globalmatch/detail/matching/lattice_alignment.hpp"
#include "globalmatch/detail/matching/lattice_alternatives.hpp"
#include "globalmatch/detail/matching/lattice_gaps.hpp"
#include "globalmatch/detail/matching/lattice_residuals.hpp"
#include "globalmatch/detail/matching/null_model.hpp"
#include "globalmatch/detail/matching/planting_lattice.hpp"
#include "globalmatch/detail/matching/robust_fit.hpp"
#include "globalmatch/detail/matching/triangle_index.hpp"
#include "globalmatch/detail/matching/uncertainty.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/global_matching.hpp"
#include "globalmatch/local_matching.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/matching_options.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/positions.hpp"
#include "globalmatch/triangles.hpp"

namespace globalmatch {

namespace detail {

inline matching cancelled_matching(const operation_cancelled& e) {
  matching result;
  result.outcome = outcome::cancelled;
  result.reason = e.what();
  return result;
}

/// From the levelled local frames of two position sets to the frames and indices of their callers.
inline hypothesis in_caller_frames(local_hypothesis&& h, const position_set& source,
                                   const position_set& target) {
  for (correspondence& c : h.correspondences) c = {source.original[c.source], target.original[c.target]};
  std::sort(h.correspondences.begin(), h.correspondences.end());
  return {std::move(h.correspondences),
          to_eigen(target.frame.local_from_scan().inverse() * h.target_from_source *
                   source.frame.local_from_scan()),
          h.inlier_threshold,
          h.log10_nfa,
          h.log10_nfa_poisson,
          h.evidence,
          h.rms,
          h.consensus};
}

}  // namespace detail

/// A stem map that many others are matched against: its stems, and what is looked up in them. Immutable once
/// made, owns its data, may be shared by threads.
struct prepared_map {
  position_set stems;
  std::shared_ptr<const detail::position_index> index;
  std::shared_ptr<const detail::background_density> background;  ///< what chance can do among its stems
  detail::triangle_index triangles;
  bool horizontal_distances = true;  ///< edges of the triangles are measured in plan
};

namespace detail {

/// Tolerances [m] that hypotheses are proposed at, and those that they may be paired at in the end: scans of
/// one instrument agree to centimetres, mobile lidar to decimetres, field surveys to half a metre.
inline constexpr std::array proposal_thresholds = {0.05, 0.1, 0.2, 0.4};
inline constexpr std::array pairing_thresholds = {0.02, 0.028, 0.04, 0.057, 0.08, 0.113,
                                                  0.16, 0.226, 0.32, 0.45,  0.64, 0.9};

inline prepared_map without_triangles(position_set stems, bool horizontal_distances, const execution& exec) {
  detail::report_progress(exec, "plan index", 0);
  prepared_map map{std::move(stems), nullptr, nullptr, {}, horizontal_distances};
  map.index = std::make_shared<detail::position_index>(map.stems, exec);
  map.background = std::make_shared<detail::background_density>(map.stems, map.index);
  return map;
}

/// `min_queried`: maps that are matched against it have so many stems or more, and the triangles of only
/// some of its own are found by them.
inline prepared_map prepare_positions(position_set stems, bool horizontal_distances,
                                      const indexed_matching_options& options, const execution& exec,
                                      std::size_t min_queried = 0) {
  prepared_map map = without_triangles(std::move(stems), horizontal_distances, exec);
  const int neighbors = map.stems.size() <= options.exhaustive_max_stems ? options.exhaustive_neighbors
                                                                         : options.target_neighbors;
  const std::size_t step =
      std::max<std::size_t>(1, std::min(min_queried, map.stems.size()) / options.sufficient_stems);
  map.triangles =
      detail::triangle_index(map.stems, *map.index, horizontal_distances, std::size_t(neighbors), exec, step);
  return map;
}

/// Ranked hypotheses by `algorithm_1` at one tolerance.
inline std::vector<local_hypothesis> propose_by_algorithm_1(const detail::matching_context& context,
                                                      double inlier_threshold,
                                                      const matching_options& options,
                                                      matching_funnel& funnel, const execution& exec) {
  const auto source_triangles = build_triangles(context.source, context.horizontal, options.triangles, exec);
  const auto target_triangles = build_triangles(context.target, context.horizontal, options.triangles, exec);
  const auto pairs = match_locally(source_triangles, target_triangles, inlier_threshold, exec);
  funnel.source_triangles = source_triangles.size();
  funnel.target_triangles = target_triangles.size();
  funnel.local_pairs += pairs.size();
  std::size_t tested = 0;
  auto hypotheses = propose_by_consensus(context, pairs, inlier_threshold, options.global, exec, &tested);
  funnel.tested += tested;
  return hypotheses;
}

/// Ranked hypotheses by the index at one tolerance after the other, the finest first, until chance no longer
/// explains what is found. Small maps are searched once more, patiently, when that never happens.
inline std::vector<local_hypothesis> propose_by_index(const detail::matching_context& context,
                                                const prepared_map& target, const null_model& null,
                                                std::span<const double> proposing,
                                                std::span<const double> pairing,
                                                const indexed_matching_options& options,
                                                matching_funnel& funnel, const execution& exec) {
  std::vector<local_hypothesis> hypotheses;
  const auto search = [&](const detail::triangle_index& triangles, bool exhaustive) {
    for (const double inlier_threshold : proposing) {
      auto proposed = match_by_index(context, triangles, inlier_threshold, null, pairing, options, exhaustive,
                                     funnel, exec);
      for (local_hypothesis& h : proposed) add_distinct(std::move(h), hypotheses, context);
      keep_best(hypotheses, options.max_hypotheses);
      if (!hypotheses.empty() && hypotheses.front().log10_nfa < options.sufficient_log10_nfa) return true;
    }
    return false;
  };
  const std::size_t smaller = std::min(context.source.size(), context.target.size());
  const std::size_t larger = std::max(context.source.size(), context.target.size());
  const bool few = smaller <= options.exhaustive_max_stems;
  if (few && larger > options.retry_max_stems && search(target.triangles, false)) return hypotheses;
  if (search(target.triangles, few)) return hypotheses;
  if (larger > options.exhaustive_max_stems && larger <= options.retry_max_stems)
    search(detail::triangle_index(context.target, *target.index, context.horizontal_distances(),
                                  std::size_t(options.exhaustive_neighbors), exec),
           true);
  return hypotheses;
}

/// The target stems that a hypothesis pairs as a stand of their own: some thousands from one place where
/// there are more, and none where they are too few to tell rows from likeness by chance. They may stand in
/// rows though most of the map does not.
inline detail::background_density paired_background(const local_hypothesis& h,
                                                    const detail::matching_context& context) {
  constexpr std::size_t minimum = 20;
  constexpr double maximum = 4096;
  const double radius = std::sqrt(maximum / std::numbers::pi) * context.target_index->spacing();
  position_set paired;
  if (h.correspondences.size() >= minimum) {
    const auto place = [&](const correspondence& c) { return context.target.at[c.target]; };
    const vec3 center = place(h.correspondences[h.correspondences.size() / 2]);
    for (const correspondence& c : h.correspondences)
      if ((place(c) - center).xy().norm() < radius) paired.at.push_back(place(c));
  }
  return detail::background_density(paired, std::make_shared<detail::position_index>(paired));
}

/// Of a stand in rows: adds what its gaps or residuals tell, to the evidence and to the hypotheses, and ranks
/// them.
template <class Evidence>
void score_by_lattice(const Evidence& evidence, double search_radius, std::vector<local_hypothesis>& hypotheses,
                      const detail::matching_context& context, const null_model& null,
                      std::span<const double> thresholds) {
  constexpr std::size_t maximum = 16;  // motions of the lattice that are tried
  constexpr double significant =
      -2;  // log10 of false alarms: the best of all motions of the lattice is near 0
  std::vector<local_hypothesis> candidates = evidence.propose(maximum);
  // A few stems that happen to meet closely are a hypothesis as well, though most stems say where it lies.
  for (const local_hypothesis& h : hypotheses)
    if (auto with_all_stems =
            verify(context, context.pair_stems(h.target_from_source, search_radius), search_radius))
      candidates.push_back(std::move(*with_all_stems));
  std::vector<local_hypothesis> distinct = std::move(hypotheses);
  for (local_hypothesis& h : candidates) {
    // In rows chance explains as much at any tolerance; that of what was found so far may not fit the stems.
    const double inlier_threshold = threshold_from_residuals(context, h, thresholds);
    score_hypothesis(h, context, null, std::span(&inlier_threshold, 1));
    const evidence_score scored = evidence.score(h.target_from_source);
    if (scored.log10_nfa < std::min(h.log10_nfa, significant)) {
      h.evidence = scored.evidence;
      h.log10_nfa = scored.log10_nfa;
    }
    add_distinct(std::move(h), distinct, context);
  }
  hypotheses = std::move(distinct);
  rank(hypotheses);
}

/// The best of ranked hypotheses as it is returned, and its rivals as they compare with it. `has_lattice`:
/// the target stands so.
inline std::vector<local_hypothesis> finalize_hypotheses(std::vector<local_hypothesis>&& proposed,
                                                   const detail::matching_context& context, null_model null,
                                                   std::span<const double> thresholds, bool has_lattice,
                                                   const indexed_matching_options& options) {
  if (proposed.empty()) return {};
  local_hypothesis best = std::move(proposed.front());
  fit_robustly(best, context);
  null.include_lattice_of(paired_background(best, context));
  null.score(best,
             null.residuals_under(best.target_from_source, best.inlier_threshold, best.inlier_threshold));
  // What a coarse tolerance makes of a rival counts for nothing where a fine one explains the stems.
  const double inlier_threshold = best.inlier_threshold;
  std::vector<local_hypothesis> finalized, alternatives = lattice_alternatives(best, context);
  std::move(proposed.begin() + 1, proposed.end(), std::back_inserter(alternatives));
  finalized.push_back(std::move(best));
  for (local_hypothesis& alternative : alternatives) {
    score_hypothesis(alternative, context, null, std::span(&inlier_threshold, 1));
    add_distinct(std::move(alternative), finalized, context);
  }
  rank(finalized);
  const auto is_undecided = [&] {
    return has_lattice && finalized.front().log10_nfa > options.sufficient_log10_nfa;
  };
  const auto lattice = is_undecided() ? find_lattice(*context.target_index) : std::nullopt;
  if (lattice) {
    const lattice_gaps gaps(context, *lattice, align_lattices(context, *lattice, finalized));
    score_by_lattice(gaps, lattice->search_radius(), finalized, context, null, thresholds);
  }
  if (lattice && is_undecided()) {
    const lattice_residuals residuals(context, *lattice, align_lattices(context, *lattice, finalized));
    score_by_lattice(residuals, lattice->search_radius(), finalized, context, null, thresholds);
  }
  keep_best(finalized, options.max_hypotheses);
  complete_pairs(finalized.front(), context, thresholds);
  return finalized;
}

/// Ranked hypotheses, weighed against chance.
inline std::vector<local_hypothesis> propose(const detail::matching_context& context, const prepared_map& target,
                                       const matching_options& options, matching_funnel& funnel,
                                       const execution& exec) {
  using thresholds = std::span<const double>;
  const thresholds proposing =
      options.inlier_threshold ? thresholds(&*options.inlier_threshold, 1) : proposal_thresholds;
  const thresholds pairing = options.inlier_threshold ? proposing : pairing_thresholds;
  const null_model null(context, target.background, pairing, proposing);
  std::vector<local_hypothesis> hypotheses;
  if (options.proposal == proposal::triangle_index) {
    hypotheses = propose_by_index(context, target, null, proposing, pairing, options.indexed, funnel, exec);
  } else {
    for (const double inlier_threshold : proposing) {
      for (local_hypothesis& h : propose_by_algorithm_1(context, inlier_threshold, options, funnel, exec)) {
        score_hypothesis(h, context, null, pairing);
        add_distinct(std::move(h), hypotheses, context);
      }
      rank(hypotheses);
      if (!hypotheses.empty() && hypotheses.front().log10_nfa < options.indexed.sufficient_log10_nfa) break;
    }
  }
  return finalize_hypotheses(std::move(hypotheses), context, null, pairing, target.background->has_lattice(),
                             options.indexed);
}

/// Leaves the best of ranked hypotheses and its rivals: what chance alone explains is none, but for the next
/// best one.
inline void remove_insignificant(std::vector<local_hypothesis>& hypotheses, const decision_options& options) {
  const auto explained = [&](const local_hypothesis& h) {
    return std::min(h.log10_nfa, h.log10_nfa_poisson) > std::log10(options.max_nfa);
  };
  if (hypotheses.size() > 2)
    hypotheses.erase(std::remove_if(hypotheses.begin() + 2, hypotheses.end(), explained), hypotheses.end());
}

/// Judges the hypotheses, which are in the frames of `context`, and tells the caller in theirs.
inline void conclude(matching& result, std::vector<local_hypothesis>&& hypotheses,
                     const detail::matching_context& context, const matching_options& options) {
  context.poll_cancelled();
  const decision decided = decide(hypotheses, context, options.decision);
  result.outcome = decided.outcome;
  result.reason = decided.reason;
  context.poll_cancelled();
  result.probability = probability_of(hypotheses, options.decision);
  if (hypotheses.empty()) {
    result.inlier_threshold = options.inlier_threshold.value_or(proposal_thresholds.back());
    return;
  }
  if (result.outcome == outcome::registered) {
    if (const auto local = uncertainty_of(hypotheses.front(), context))
      result.uncertainty.emplace(in_caller_frame(*local, context.target.frame));
  }
  context.poll_cancelled();
  for (local_hypothesis& h : hypotheses)
    result.hypotheses.push_back(in_caller_frames(std::move(h), context.source, context.target));
  const hypothesis& best = result.hypotheses.front();
  result.inlier_threshold = best.inlier_threshold;
  result.funnel.consensus = best.consensus;
  result.funnel.correspondences = best.correspondences.size();
  if (result.outcome == outcome::registered) result.target_from_source.emplace(best.target_from_source);
}

/// Matches positions against a prepared map; their frames may be levelled by different ups. `swapped`: the
/// prepared map is the caller's source.
inline matching match_prepared(const position_set& source, const prepared_map& target,
                               const matching_options& options, const execution& exec, bool swapped = false) {
  require_valid(options);
  require_valid(exec);
  if (!target.index) throw std::invalid_argument("target: the map was not prepared; prepare_map does that");
  if (options.dof == degrees_of_freedom::six && !(source.has_heights && target.stems.has_heights))
    throw std::invalid_argument("dof: six degrees of freedom need heights in both maps");
  matching result;
  result.horizontal = options.horizontal || !source.has_heights || !target.stems.has_heights;
  detail::report_progress(exec, "plan index", 0);
  detail::matching_context context(source, target.stems,
                                   std::make_shared<detail::position_index>(source, exec), target.index,
                                   result.horizontal, options.dof, options.vertical_threshold);
  context.on_poll = [&] { detail::report_progress(exec, "verification", 0); };
  context.poll_cancelled();
  if (options.proposal == proposal::triangle_index &&
      context.horizontal_distances() != target.horizontal_distances)
    throw std::invalid_argument(context.horizontal_distances()
                                    ? "target was prepared for distances in space; prepare it with dof four"
                                    : "target was prepared for distances in plan; prepare it with dof six");
  result.funnel.source_stems = source.size();
  result.funnel.target_stems = target.stems.size();
  auto hypotheses = propose(context, target, options, result.funnel, exec);
  remove_insignificant(hypotheses, options.decision);
  if (swapped) {
    for (local_hypothesis& h : hypotheses) h = reversed(std::move(h));
    std::swap(result.funnel.source_stems, result.funnel.target_stems);
    std::swap(result.funnel.source_triangles, result.funnel.target_triangles);
  }
  if (target.background->has_lattice())
    if (const auto found = find_lattice(swapped ? *context.source_index : *context.target_index))
      result.lattice.emplace(planting_lattice{to_eigen(found->first), to_eigen(found->second)});
  conclude(result, std::move(hypotheses), swapped ? context.reversed() : context, options);
  return result;
}
}  // namespace detail

/// Matches sets of positions whose frames may be levelled by different ups; `match_stems` for positions that
/// are already behind the border, but throws `operation_cancelled`. The larger map is indexed, the smaller
/// one asks.
inline matching match_positions(position_set source, position_set target,
                                const matching_options& options = {}, const execution& exec = {}) {
  require_valid(options);
  if (options.proposal == proposal::algorithm_1)
    return detail::match_prepared(source, detail::without_triangles(std::move(target), true, exec), options,
                                  exec);
  const bool horizontal_distances = options.dof == degrees_of_freedom::four,
             swapped = source.size() > target.size();
  if (swapped) std::swap(source, target);
  return detail::match_prepared(source,
                                detail::prepare_positions(std::move(target), horizontal_distances,
                                                          options.indexed, exec, source.size()),
                                options, exec, swapped);
}

/// Prepares a map that many others are matched against, with heights or without. Positions as in
/// `match_stems`; `options.dof` is that of the matches to come. Throws as `match_stems` does, and
/// `operation_cancelled` when the progress callback says so. Cost: linear in the stems.
template <position_range R>
prepared_map prepare_map(const R& stems, const matching_options& options = {},
                         const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ(), const execution& exec = {}) {
  require_valid(options);
  position_set set = import_positions(stems, up, "stems", exec);
  const bool horizontal_distances = options.dof == degrees_of_freedom::four;
  if (!horizontal_distances && !set.has_heights)
    throw std::invalid_argument("dof: six degrees of freedom need heights in the map");
  return detail::prepare_positions(std::move(set), horizontal_distances, options.indexed, exec);
}

/// Matches positions against a prepared map, the larger one of both: triangles of the source are looked up in
/// it. Throws `std::invalid_argument` also when it was prepared for other degrees of freedom, or not at all.
template <position_range Source>
matching match_stems(const Source& source, const prepared_map& target, const matching_options& options = {},
                     const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ(), const execution& exec = {}) {
  try {
    return detail::match_prepared(import_positions(source, up, "source", exec), target, options, exec);
  } catch (const operation_cancelled& e) {
    return detail::cancelled_matching(e);
  }
}

/// Finds the motion that lays the source stems on the target stems, from their relative positions alone.
/// Positions are of the caller's types, with or without heights. `up` points away from the ground in both
/// frames. No trustworthy motion is an answer: `outcome` and `reason` say so, and `target_from_source` is
/// empty. Throws `std::invalid_argument` naming a bad option or a position that is not finite. Cost:
/// linear in the stems, n log n to sort them; with `proposal::algorithm_1` about quadratic.
template <position_range Source, position_range Target>
matching match_stems(const Source& source, const Target& target, const matching_options& options = {},
                     const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ(), const execution& exec = {}) {
  try {
    return match_positions(import_positions(source, up, "source", exec),
                           import_positions(target, up, "target", exec), options, exec);
  } catch (const operation_cancelled& e) {
    return detail::cancelled_matching(e);
  }
}
}  // namespace globalmatch
