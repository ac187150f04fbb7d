// Stem matching ([GM] 3.2): two sets of stem positions -> the motion between their scans. Needs no ground, no
// scan.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

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

#include "globalmatch/execution.hpp"
#include "globalmatch/global_matching.hpp"
#include "globalmatch/hypothesis.hpp"
#include "globalmatch/indexed_matching.hpp"
#include "globalmatch/lattice.hpp"
#include "globalmatch/lattice_gaps.hpp"
#include "globalmatch/lattice_misfits.hpp"
#include "globalmatch/lattice_rivals.hpp"
#include "globalmatch/local_matching.hpp"
#include "globalmatch/plan_index.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/position_set.hpp"
#include "globalmatch/robust_fit.hpp"
#include "globalmatch/rows_on_rows.hpp"
#include "globalmatch/significance.hpp"
#include "globalmatch/stand.hpp"
#include "globalmatch/transform.hpp"
#include "globalmatch/triangle_index.hpp"
#include "globalmatch/triangles.hpp"
#include "globalmatch/uncertainty.hpp"
#include "globalmatch/verdict.hpp"

namespace globalmatch {

/// How hypotheses come about.
enum class proposal {
  triangle_index,  ///< triangles look their likes up; for maps of any size (ours)
  algorithm_1      ///< largest consensus set of all congruent triangles, [GM] 3.2; for some hundred stems
};

struct matching_options {
  degrees_of_freedom dof = degrees_of_freedom::four;  ///< ([GM] 3.3 prefers four for levelled scans)
  bool horizontal = false;  ///< ignore heights; always so when a map has none (ours)
  /// [m] epsilon: edges of congruent triangles differ by less, and paired stems lie closer ([GM] 3.2.2:
  /// 0.05), in plan in 4-DoF (but for the edges of `algorithm_1`). Empty: the one at which the pairs are
  /// least explainable by chance, or a wider one where three standard deviations of the misfits reach
  /// further.
  std::optional<double> tolerance = {};
  /// [m] in 4-DoF the heights of paired stems differ by less: where the ground is hidden, by shrubs or in a
  /// hollow, they are off by decimetres (ours)
  double vertical_tolerance = 1;
  globalmatch::proposal proposal = proposal::triangle_index;
  indexed_matching_options indexed = {};
  triangle_options triangles = {};      ///< of `algorithm_1`
  global_matching_options global = {};  ///< of `algorithm_1`
  verdict_options verdict = {};
};

/// Throws `std::invalid_argument` naming the field that makes no sense.
inline void require_valid(const matching_options& options) {
  if (options.tolerance && !(*options.tolerance > 0 && std::isfinite(*options.tolerance)))
    throw std::invalid_argument("tolerance must be positive and finite");
  if (!(options.vertical_tolerance > 0)) throw std::invalid_argument("vertical_tolerance must be positive");
  if (options.dof != degrees_of_freedom::four && options.dof != degrees_of_freedom::six)
    throw std::invalid_argument("dof must be four or six");
  if (options.horizontal && options.dof == degrees_of_freedom::six)
    throw std::invalid_argument("horizontal: six degrees of freedom need heights");
  require_valid(options.indexed);
  require_valid(options.triangles);
  require_valid(options.global);
  require_valid(options.verdict);
}

/// What came of matching, with the evidence to trust or reject it.
struct matching {
  globalmatch::outcome outcome = outcome::not_registered;
  std::string reason;                                   ///< empty when registered
  std::optional<Eigen::Isometry3d> target_from_source;  ///< only when registered
  double probability = 0;                               ///< that the best hypothesis is right
  /// The best one and its rivals, ranked and distinct; indices into the caller's positions. Rivals lay the
  /// stems elsewhere and pair more of them than stems that stood at random would by chance. The next best one
  /// is always there, where one was found.
  std::vector<hypothesis> hypotheses;
  std::optional<motion_uncertainty> uncertainty;  ///< of `target_from_source`, in the target's frame
  std::optional<globalmatch::lattice> rows;       ///< of the target, levelled, where it stands in rows
  bool horizontal = false;                        ///< heights were ignored
  double tolerance = 0;                           ///< [m] that was used
  matching_funnel funnel;
};

namespace detail {

inline matching cancelled_matching(const operation_cancelled& e) {
  matching result;
  result.outcome = outcome::cancelled;
  result.reason = e.what();
  return result;
}

/// From the levelled local frames of two position sets to the frames and indices of their callers.
inline void in_caller_frames(hypothesis& h, const position_set& source, const position_set& target) {
  h.target_from_source =
      target.frame.local_from_scan().inverse() * h.target_from_source * source.frame.local_from_scan();
  for (correspondence& c : h.correspondences) c = {source.original[c.source], target.original[c.target]};
  std::sort(h.correspondences.begin(), h.correspondences.end());
}

}  // namespace detail

/// A stem map that many others are matched against: its stems, and what is looked up in them. Immutable once
/// made, owns its data, may be shared by threads.
struct prepared_map {
  position_set stems;
  std::shared_ptr<const plan_index> plan;
  std::shared_ptr<const stand> background;  ///< what chance can do among its stems
  triangle_index triangles;
  bool in_plan = true;  ///< edges of the triangles are measured in plan
};

namespace detail {

/// Tolerances [m] that hypotheses are proposed at, and those that they may be paired at in the end: scans of
/// one instrument agree to centimetres, mobile lidar to decimetres, field surveys to half a metre.
inline constexpr std::array proposal_tolerances = {0.05, 0.1, 0.2, 0.4};
inline constexpr std::array pairing_tolerances = {0.02, 0.028, 0.04, 0.057, 0.08, 0.113,
                                                  0.16, 0.226, 0.32, 0.45,  0.64, 0.9};

inline namespace GLOBALMATCH_THREADING {

inline prepared_map without_triangles(position_set stems, bool in_plan, const execution& how) {
  report_progress(how, "plan index", 0);
  prepared_map map{std::move(stems), nullptr, nullptr, {}, in_plan};
  map.plan = std::make_shared<plan_index>(map.stems, how);
  map.background = std::make_shared<stand>(map.stems, map.plan);
  return map;
}

/// `least_queried`: maps that are matched against it have so many stems or more, and the triangles of only
/// some of its own are found by them.
inline prepared_map prepare_positions(position_set stems, bool in_plan,
                                      const indexed_matching_options& options, const execution& how,
                                      std::size_t least_queried = 0) {
  prepared_map map = without_triangles(std::move(stems), in_plan, how);
  const int neighbors =
      map.stems.size() <= options.few_stems ? options.neighbors_of_few : options.target_neighbors;
  const std::size_t step =
      std::max<std::size_t>(1, std::min(least_queried, map.stems.size()) / options.enough_stems);
  map.triangles = triangle_index(map.stems, *map.plan, in_plan, std::size_t(neighbors), how, step);
  return map;
}

/// Ranked hypotheses by `algorithm_1` at one tolerance.
inline std::vector<hypothesis> propose_exhaustively(const map_pair& maps, double tolerance,
                                                    const matching_options& options, matching_funnel& funnel,
                                                    const execution& how) {
  const auto source_triangles = build_triangles(maps.source, maps.horizontal, options.triangles, how);
  const auto target_triangles = build_triangles(maps.target, maps.horizontal, options.triangles, how);
  const auto pairs = match_locally(source_triangles, target_triangles, tolerance, how);
  funnel.source_triangles = source_triangles.size();
  funnel.target_triangles = target_triangles.size();
  funnel.local_pairs += pairs.size();
  std::size_t tested = 0;
  auto hypotheses = match_globally(maps, pairs, tolerance, options.global, how, &tested);
  funnel.tested += tested;
  return hypotheses;
}

/// Ranked hypotheses by the index at one tolerance after the other, the finest first, until chance no longer
/// explains what is found. Small maps are searched once more, patiently, when that never happens.
inline std::vector<hypothesis> propose_by_index(const map_pair& maps, const prepared_map& target,
                                                const chance& by_chance, std::span<const double> proposing,
                                                std::span<const double> pairing,
                                                const indexed_matching_options& options,
                                                matching_funnel& funnel, const execution& how) {
  std::vector<hypothesis> hypotheses;
  const auto search = [&](const triangle_index& triangles, bool patient) {
    for (const double tolerance : proposing) {
      auto proposed =
          match_by_index(maps, triangles, tolerance, by_chance, pairing, options, patient, funnel, how);
      for (hypothesis& h : proposed) add_distinct(std::move(h), hypotheses, maps);
      keep_best(hypotheses, options.most_hypotheses);
      if (!hypotheses.empty() && hypotheses.front().log10_false_alarms < options.enough) return true;
    }
    return false;
  };
  const std::size_t smaller = std::min(maps.source.size(), maps.target.size());
  const std::size_t larger = std::max(maps.source.size(), maps.target.size());
  const bool few = smaller <= options.few_stems;
  if (few && larger > options.some_stems && search(target.triangles, false)) return hypotheses;
  if (search(target.triangles, few)) return hypotheses;
  if (larger > options.few_stems && larger <= options.some_stems)
    search(
        triangle_index(maps.target, *target.plan, maps.in_plan(), std::size_t(options.neighbors_of_few), how),
        true);
  return hypotheses;
}

/// The target stems that a hypothesis pairs as a stand of their own: some thousands from one place where
/// there are more, and none where they are too few to tell rows from likeness by chance. They may stand in
/// rows though most of the map does not.
inline stand paired_stand(const hypothesis& h, const map_pair& maps) {
  constexpr std::size_t least = 20;
  constexpr double most = 4096;
  const double radius = std::sqrt(most / std::numbers::pi) * maps.target_plan->spacing();
  position_set paired;
  if (h.correspondences.size() >= least) {
    const auto place = [&](const correspondence& c) { return maps.target.at[c.target]; };
    const Eigen::Vector3d center = place(h.correspondences[h.correspondences.size() / 2]);
    for (const correspondence& c : h.correspondences)
      if ((place(c) - center).head<2>().norm() < radius) paired.at.push_back(place(c));
  }
  return stand(paired, std::make_shared<plan_index>(paired));
}

/// Of a stand in rows: adds what its gaps or misfits tell, to the evidence and to the hypotheses, and ranks
/// them.
template <class Rows>
void weigh_by(const Rows& rows, double reach, std::vector<hypothesis>& hypotheses, const map_pair& maps,
              const chance& by_chance, std::span<const double> tolerances) {
  constexpr std::size_t most = 16;  // motions of the lattice that are tried
  constexpr double telling = -2;    // log10 of false alarms: the best of all motions of the lattice is near 0
  std::vector<hypothesis> laid = rows.propose(most);
  // A few stems that happen to meet closely are a hypothesis as well, though most stems say where it lies.
  for (const hypothesis& h : hypotheses)
    if (auto with_all = verify(maps, maps.pair_stems(h.target_from_source, reach), reach))
      laid.push_back(std::move(*with_all));
  std::vector<hypothesis> distinct = std::move(hypotheses);
  for (hypothesis& h : laid) {
    // In rows chance explains as much at any tolerance; that of what was found so far may not fit the stems.
    const double tolerance = tolerance_of_scatter(maps, h, tolerances);
    weigh(h, maps, by_chance, std::span(&tolerance, 1));
    const testimony told = rows.testimony_of(h.target_from_source);
    if (told.log10_false_alarms < std::min(h.log10_false_alarms, telling)) {
      h.told_by = told.told_by;
      h.log10_false_alarms = told.log10_false_alarms;
    }
    add_distinct(std::move(h), distinct, maps);
  }
  hypotheses = std::move(distinct);
  rank(hypotheses);
}

/// The best of ranked hypotheses as it is returned, and its rivals as they compare with it. `in_rows`: the
/// target stands so.
inline std::vector<hypothesis> settle(std::vector<hypothesis>&& proposed, const map_pair& maps,
                                      chance by_chance, std::span<const double> tolerances, bool in_rows,
                                      const indexed_matching_options& options) {
  if (proposed.empty()) return {};
  hypothesis best = std::move(proposed.front());
  fit_robustly(best, maps);
  by_chance.reckon_with_rows_of(paired_stand(best, maps));
  by_chance.judge(best, by_chance.lay(best.target_from_source, best.tolerance, best.tolerance));
  // What a coarse tolerance makes of a rival counts for nothing where a fine one explains the stems.
  const double tolerance = best.tolerance;
  std::vector<hypothesis> settled, rivals = lattice_rivals(best, maps);
  std::move(proposed.begin() + 1, proposed.end(), std::back_inserter(rivals));
  settled.push_back(std::move(best));
  for (hypothesis& rival : rivals) {
    weigh(rival, maps, by_chance, std::span(&tolerance, 1));
    add_distinct(std::move(rival), settled, maps);
  }
  rank(settled);
  const auto ask = [&] { return in_rows && settled.front().log10_false_alarms > options.enough; };
  const auto rows = ask() ? find_lattice(*maps.target_plan) : std::nullopt;
  if (rows) {
    const lattice_gaps gaps(maps, *rows, lay_rows_on_rows(maps, *rows, settled));
    weigh_by(gaps, rows->reach(), settled, maps, by_chance, tolerances);
  }
  if (rows && ask()) {
    const lattice_misfits misfits(maps, *rows, lay_rows_on_rows(maps, *rows, settled));
    weigh_by(misfits, rows->reach(), settled, maps, by_chance, tolerances);
  }
  keep_best(settled, options.most_hypotheses);
  complete_pairs(settled.front(), maps, tolerances);
  return settled;
}

/// Ranked hypotheses, weighed against chance.
inline std::vector<hypothesis> propose(const map_pair& maps, const prepared_map& target,
                                       const matching_options& options, matching_funnel& funnel,
                                       const execution& how) {
  using tolerances = std::span<const double>;
  const tolerances proposing = options.tolerance ? tolerances(&*options.tolerance, 1) : proposal_tolerances;
  const tolerances pairing = options.tolerance ? proposing : pairing_tolerances;
  const chance by_chance(maps, target.background, pairing, proposing);
  std::vector<hypothesis> hypotheses;
  if (options.proposal == proposal::triangle_index) {
    hypotheses = propose_by_index(maps, target, by_chance, proposing, pairing, options.indexed, funnel, how);
  } else {
    for (const double tolerance : proposing) {
      for (hypothesis& h : propose_exhaustively(maps, tolerance, options, funnel, how)) {
        weigh(h, maps, by_chance, pairing);
        add_distinct(std::move(h), hypotheses, maps);
      }
      rank(hypotheses);
      if (!hypotheses.empty() && hypotheses.front().log10_false_alarms < options.indexed.enough) break;
    }
  }
  return settle(std::move(hypotheses), maps, by_chance, pairing, target.background->is_in_rows(),
                options.indexed);
}

/// Leaves the best of ranked hypotheses and its rivals: what chance alone explains is none, but for the next
/// best one.
inline void forget_what_chance_explains(std::vector<hypothesis>& hypotheses, const verdict_options& options) {
  const auto explained = [&](const hypothesis& h) {
    return std::min(h.log10_false_alarms, h.log10_false_alarms_at_random) >
           std::log10(options.most_false_alarms);
  };
  if (hypotheses.size() > 2)
    hypotheses.erase(std::remove_if(hypotheses.begin() + 2, hypotheses.end(), explained), hypotheses.end());
}

/// Judges the hypotheses, which are in the frames of `maps`, and tells the caller in theirs.
inline void conclude(matching& result, const map_pair& maps, const matching_options& options) {
  maps.say_on_the_way();
  const verdict judged = judge(result.hypotheses, maps, options.verdict);
  result.outcome = judged.outcome;
  result.reason = judged.reason;
  maps.say_on_the_way();
  result.probability = probability_of(result.hypotheses, options.verdict);
  if (result.hypotheses.empty()) {
    result.tolerance = options.tolerance.value_or(proposal_tolerances.back());
    return;
  }
  if (result.outcome == outcome::registered) {
    result.uncertainty = uncertainty_of(result.hypotheses.front(), maps);
    if (result.uncertainty) result.uncertainty = in_caller_frame(*result.uncertainty, maps.target.frame);
  }
  maps.say_on_the_way();
  for (hypothesis& h : result.hypotheses) in_caller_frames(h, maps.source, maps.target);
  const hypothesis& best = result.hypotheses.front();
  result.tolerance = best.tolerance;
  result.funnel.consensus = best.consensus;
  result.funnel.correspondences = best.correspondences.size();
  if (result.outcome == outcome::registered) result.target_from_source = best.target_from_source;
}

/// Matches positions against a prepared map; their frames may be levelled by different ups. `swapped`: the
/// prepared map is the caller's source.
inline matching match_prepared(const position_set& source, const prepared_map& target,
                               const matching_options& options, const execution& how, bool swapped = false) {
  require_valid(options);
  require_valid(how);
  if (!target.plan) throw std::invalid_argument("target: the map was not prepared; prepare_map does that");
  if (options.dof == degrees_of_freedom::six && !(source.has_heights && target.stems.has_heights))
    throw std::invalid_argument("dof: six degrees of freedom need heights in both maps");
  matching result;
  result.horizontal = options.horizontal || !source.has_heights || !target.stems.has_heights;
  report_progress(how, "plan index", 0);
  map_pair maps(source, target.stems, std::make_shared<plan_index>(source, how), target.plan,
                result.horizontal, options.dof, options.vertical_tolerance);
  maps.on_the_way = [&] { report_progress(how, "verification", 0); };
  maps.say_on_the_way();
  if (options.proposal == proposal::triangle_index && maps.in_plan() != target.in_plan)
    throw std::invalid_argument(maps.in_plan()
                                    ? "target was prepared for distances in space; prepare it with dof four"
                                    : "target was prepared for distances in plan; prepare it with dof six");
  result.funnel.source_stems = source.size();
  result.funnel.target_stems = target.stems.size();
  result.hypotheses = propose(maps, target, options, result.funnel, how);
  forget_what_chance_explains(result.hypotheses, options.verdict);
  if (swapped) {
    for (hypothesis& h : result.hypotheses) h = reversed(std::move(h));
    std::swap(result.funnel.source_stems, result.funnel.target_stems);
    std::swap(result.funnel.source_triangles, result.funnel.target_triangles);
  }
  if (target.background->is_in_rows())
    result.rows = find_lattice(swapped ? *maps.source_plan : *maps.target_plan);
  conclude(result, swapped ? maps.reversed() : maps, options);
  return result;
}

}  // namespace GLOBALMATCH_THREADING
}  // namespace detail

inline namespace GLOBALMATCH_THREADING {

/// Matches sets of positions whose frames may be levelled by different ups; `match_stems` for positions that
/// are already behind the border, but throws `operation_cancelled`. The larger map is indexed, the smaller
/// one asks.
inline matching match_positions(position_set source, position_set target,
                                const matching_options& options = {}, const execution& how = {}) {
  require_valid(options);
  if (options.proposal == proposal::algorithm_1)
    return detail::match_prepared(source, detail::without_triangles(std::move(target), true, how), options,
                                  how);
  const bool in_plan = options.dof == degrees_of_freedom::four, swapped = source.size() > target.size();
  if (swapped) std::swap(source, target);
  return detail::match_prepared(
      source, detail::prepare_positions(std::move(target), in_plan, options.indexed, how, source.size()),
      options, how, swapped);
}

/// Prepares a map that many others are matched against, with heights or without. Positions as in
/// `match_stems`; `options.dof` is that of the matches to come. Throws as `match_stems` does, and
/// `operation_cancelled` when the progress callback says so. Cost: linear in the stems.
template <position_range R>
prepared_map prepare_map(const R& stems, const matching_options& options = {},
                         const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ(), const execution& how = {}) {
  require_valid(options);
  position_set set = import_positions(stems, up, "stems", how);
  const bool in_plan = options.dof == degrees_of_freedom::four;
  if (!in_plan && !set.has_heights)
    throw std::invalid_argument("dof: six degrees of freedom need heights in the map");
  return detail::prepare_positions(std::move(set), in_plan, options.indexed, how);
}

/// Matches positions against a prepared map, the larger one of both: triangles of the source are looked up in
/// it. Throws `std::invalid_argument` also when it was prepared for other degrees of freedom, or not at all.
template <position_range Source>
matching match_stems(const Source& source, const prepared_map& target, const matching_options& options = {},
                     const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ(), const execution& how = {}) {
  try {
    return detail::match_prepared(import_positions(source, up, "source", how), target, options, how);
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
                     const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ(), const execution& how = {}) {
  try {
    return match_positions(import_positions(source, up, "source", how),
                           import_positions(target, up, "target", how), options, how);
  } catch (const operation_cancelled& e) {
    return detail::cancelled_matching(e);
  }
}

}  // namespace GLOBALMATCH_THREADING
}  // namespace globalmatch
