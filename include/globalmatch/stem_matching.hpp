// Stem matching ([GM] 3.2): two sets of stem positions -> the motion between their scans. Needs no ground, no
// scan.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cstddef>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "globalmatch/execution.hpp"
#include "globalmatch/global_matching.hpp"
#include "globalmatch/hypothesis.hpp"
#include "globalmatch/local_matching.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/position_set.hpp"
#include "globalmatch/transform.hpp"
#include "globalmatch/triangles.hpp"
#include "globalmatch/verdict.hpp"

namespace globalmatch {

struct matching_options {
  degrees_of_freedom dof = degrees_of_freedom::four;  ///< ([GM] 3.3 prefers four for levelled scans)
  bool horizontal = false;  ///< compare distances in plan; always so when a map has no heights (ours)
  /// [m] epsilon: edges of congruent triangles differ by less, and paired stems lie closer ([GM] 3.2.2:
  /// 0.05).
  std::optional<double> tolerance = {};
  triangle_options triangles = {};
  global_matching_options global = {};
  verdict_options verdict = {};
};

/// Throws `std::invalid_argument` naming the field that makes no sense.
inline void require_valid(const matching_options& options) {
  if (options.tolerance && !(*options.tolerance > 0))
    throw std::invalid_argument("tolerance must be positive");
  if (options.dof != degrees_of_freedom::four && options.dof != degrees_of_freedom::six)
    throw std::invalid_argument("dof must be four or six");
  require_valid(options.triangles);
  require_valid(options.global);
  require_valid(options.verdict);
}

/// How much each step of matching left.
struct matching_funnel {
  std::size_t source_stems = 0, target_stems = 0;
  std::size_t source_triangles = 0, target_triangles = 0;
  std::size_t local_pairs = 0;      ///< congruent triangle pairs
  std::size_t consensus = 0;        ///< of these in the best hypothesis' consensus set
  std::size_t correspondences = 0;  ///< stems that the best hypothesis pairs
};

/// What came of matching, with the evidence to trust or reject it.
struct matching {
  globalmatch::outcome outcome = outcome::not_registered;
  std::string reason;                                   ///< empty when registered
  std::optional<Eigen::Isometry3d> target_from_source;  ///< only when registered
  std::vector<hypothesis> hypotheses;  ///< ranked, distinct; indices into the caller's positions
  bool horizontal = false;             ///< that was used
  double tolerance = 0;                ///< [m] that was used
  matching_funnel funnel;
};

inline namespace GLOBALMATCH_THREADING {

/// Matches sets of positions whose frames may be levelled by different ups; `match_stems` for positions that
/// are already behind the border.
inline matching match_positions(const position_set& source, const position_set& target,
                                const matching_options& options = {}, const execution& how = {}) {
  require_valid(options);
  constexpr double paper_tolerance = 0.05;  // [m] [GM] 3.2.2
  matching result;
  result.horizontal = options.horizontal || !source.has_heights || !target.has_heights;
  result.tolerance = options.tolerance.value_or(paper_tolerance);
  if (options.dof == degrees_of_freedom::six && !(source.has_heights && target.has_heights))
    throw std::invalid_argument("dof: six degrees of freedom need heights in both maps");
  const map_pair maps(source, target, result.horizontal, options.dof);

  const auto source_triangles = build_triangles(source, result.horizontal, options.triangles);
  const auto target_triangles = build_triangles(target, result.horizontal, options.triangles);
  const auto pairs = match_locally(source_triangles, target_triangles, result.tolerance, how);
  result.hypotheses = match_globally(maps, pairs, result.tolerance, options.global, how);
  const verdict judged = judge(result.hypotheses, source, target, options.verdict);

  result.outcome = judged.outcome;
  result.reason = judged.reason;
  result.funnel = {.source_stems = source.size(),
                   .target_stems = target.size(),
                   .source_triangles = source_triangles.size(),
                   .target_triangles = target_triangles.size(),
                   .local_pairs = pairs.size()};
  for (hypothesis& h : result.hypotheses) {
    const Eigen::Isometry3d target_local = target.frame.local_from_scan(),
                            source_local = source.frame.local_from_scan();
    h.target_from_source = target_local.inverse() * h.target_from_source * source_local;
    for (correspondence& c : h.correspondences) c = {source.original[c.source], target.original[c.target]};
    std::sort(h.correspondences.begin(), h.correspondences.end());
  }
  if (!result.hypotheses.empty()) {
    result.funnel.consensus = result.hypotheses.front().consensus;
    result.funnel.correspondences = result.hypotheses.front().correspondences.size();
  }
  if (result.outcome == outcome::registered)
    result.target_from_source = result.hypotheses.front().target_from_source;
  return result;
}

/// Finds the motion that lays the source stems on the target stems, from their relative positions alone.
/// Positions are of the caller's types, with or without heights. `up` points away from the ground in both
/// frames. No trustworthy motion is an answer: `outcome` and `reason` say so, and `target_from_source` is
/// empty. Throws `std::invalid_argument` naming a bad option or a position that is not finite. Cost:
/// quadratic in the locally matched triangle pairs.
template <position_range Source, position_range Target>
matching match_stems(const Source& source, const Target& target, const matching_options& options = {},
                     const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ(), const execution& how = {}) {
  try {
    return match_positions(import_positions(source, up, "source"), import_positions(target, up, "target"),
                           options, how);
  } catch (const operation_cancelled& e) {
    matching result;
    result.outcome = outcome::cancelled;
    result.reason = e.what();
    return result;
  }
}

}  // namespace GLOBALMATCH_THREADING
}  // namespace globalmatch
