// Stem matching composed of searches: in plan and, where scans are rotated, in space; with a prior and, where
// the stems contradict it, without; again at another scale where that is asked for.
#pragma once

#include <limits>
#include <memory>
#include <numbers>
#include <span>
#include <stdexcept>
#include <utility>

#include "globalmatch/detail/core/compiled.hpp"
#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/matching/likely_causes.hpp"
#include "globalmatch/detail/matching/null_model.hpp"
#include "globalmatch/detail/matching/position_evidence.hpp"
#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "globalmatch/detail/matching/scale_fit.hpp"
#include "globalmatch/detail/verbs/match_prepared.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/matching_options.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::detail {

/// Where nothing is significant in plan the scans may be rotated by so much that only distances in space
/// match; as these are further tests, twice the evidence is asked for. Nobody scans upside down: flat maps
/// that are each other's mirror image match like that.
inline matching match_as_options_say(position_set source, position_set target,
                                     const matching_options& options, const execution& exec,
                                     const scan_views* views) {
  const bool may_rotate = !options.dof && !options.horizontal && source.has_heights && target.has_heights;
  if (!may_rotate) return match_once(std::move(source), std::move(target), options, exec, views);
  matching by_positions = match_once(source, target, options, exec, views);
  if (by_positions.outcome != outcome::not_registered) return by_positions;
  constexpr double max_tilt = std::numbers::pi / 2;
  matching_options rotating = options;
  rotating.dof = degrees_of_freedom::six;
  rotating.decision.max_nfa /= 2;
  matching in_space = match_once(std::move(source), std::move(target), rotating, exec, views, false);
  const bool rotated = in_space.outcome == outcome::registered && in_space.vertical->tilt < max_tilt;
  return rotated ? in_space : by_positions;
}

/// Says how the best hypothesis differs from the prior.
inline void compare_with_prior(matching& result, const position_set& source, const position_set& target,
                               const matching_options& options) {
  const auto prior = prior_between(source, target, options, false);
  if (!prior || result.hypotheses.empty()) return;
  const rigid transform = target.frame.local_from_scan() *
                          from_eigen(result.hypotheses.front().target_from_source) *
                          source.frame.local_from_scan().inverse();
  result.prior = prior->deviation(transform);
  result.prior->is_contradicted = result.outcome == outcome::registered && !prior->allows(transform);
}

/// What `match(options)` returns; where that rests on little, and the stems alone place the source beyond
/// doubt where the prior does not allow it, what it returns without the prior.
template <class Match>
matching match_unless_contradicted(const position_set& source, const position_set& target,
                                   const matching_options& options, const Match& match) {
  matching result = match(options);
  if (options.prior && is_doubtful(result)) {
    matching_options without = options;
    without.prior.reset();
    matching by_stems = match(without);
    compare_with_prior(by_stems, source, target, options);
    const bool elsewhere = by_stems.prior && by_stems.prior->is_contradicted;
    if (elsewhere && explains_better(log10_nfa_of(by_stems), log10_nfa_of(result)))
      result = std::move(by_stems);
    else if (elsewhere && result.outcome != outcome::registered)
      result.reason =
          "prior: within four standard deviations of it no transform is significant, one elsewhere is; where "
          "the prior may be wrong, match without it or make its standard deviations larger";
  }
  compare_with_prior(result, source, target, options);
  return result;
}

/// The options for a source that is multiplied by a factor: the prior places its centroid where it did.
inline matching_options for_scaled(matching_options options, const position_set& source, double factor) {
  if (!options.prior || source.size() == 0) return options;
  vec3 center;
  for (const vec3& p : source.at) center += p / double(source.size());
  const vec3 moved_by = (1 - factor) * source.frame.to_scan(center);
  options.prior->target_from_source =
      to_eigen(shifted_before(from_eigen(options.prior->target_from_source), moved_by));
  return options;
}

/// `match(source, options)`, and again with the source multiplied by the scale that was found, until that
/// stays. The scale that is returned is the product.
template <class Match>
matching match_at_scale(const position_set& source, const matching_options& options, const Match& match) {
  constexpr int max_iterations = 3;
  matching result = match(source, options);
  double factor = 1;
  for (int i = 0; options.scale && i < max_iterations && result.scale && result.scale->differs; ++i) {
    const double next_factor = factor * result.scale->factor;
    matching next = match(scaled(source, next_factor), for_scaled(options, source, next_factor));
    if (next.outcome != outcome::registered || !next.scale) break;
    factor = next_factor;
    result = std::move(next);
  }
  if (factor == 1) return result;
  result.scale = {factor, result.scale->sigma, true, true};
  return result;
}

GLOBALMATCH_INLINE matching match_positions(position_set source, position_set target,
                                            const matching_options& options, const execution& exec,
                                            const scan_views* views, build_mode) {
  require_valid(options);
  const parallel_scope scope(exec, "matching");
  const auto match = [&](const position_set& from, const matching_options& asked) {
    matching result = match_unless_contradicted(from, target, asked, [&](const matching_options& some) {
      return match_as_options_say(from, target, some, exec, views);
    });
    return with_likely_cause(std::move(result), from, target, exec);
  };
  return match_at_scale(source, options, match);
}

GLOBALMATCH_INLINE matching match_positions(const position_set& source, const prepared_stems& target,
                                            const matching_options& options, const execution& exec,
                                            build_mode) {
  return match_at_scale(source, options, [&](const position_set& from, const matching_options& asked) {
    return match_unless_contradicted(from, target.stems, asked, [&](const matching_options& some) {
      return match_prepared(from, target, some, exec);
    });
  });
}

GLOBALMATCH_INLINE hypothesis score_given(const position_set& source, const position_set& target,
                                          const Eigen::Isometry3d& target_from_source,
                                          const matching_options& options, const execution&, build_mode) {
  require_rigid(target_from_source, "target_from_source");
  if (options.dof == degrees_of_freedom::six && !(source.has_heights && target.has_heights))
    throw std::invalid_argument("dof: six degrees of freedom need heights in both maps");
  const matching_context context(source, target, true, options.dof.value_or(degrees_of_freedom::four));
  const rigid given = from_eigen(target_from_source);
  const std::span<const double> thresholds = options.inlier_threshold
                                                 ? std::span(&*options.inlier_threshold, 1)
                                                 : std::span<const double>(pairing_thresholds);
  null_model null(context, thresholds);
  null.include_reversed();
  local_hypothesis h;
  h.target_from_source = target.frame.local_from_scan() * given * source.frame.local_from_scan().inverse();
  const null_model::residual_set set = null.residuals_under(h.target_from_source, thresholds.back());
  h.log10_nfa = std::numeric_limits<double>::infinity();
  for (const double inlier_threshold : thresholds) {
    local_hypothesis at_threshold;
    at_threshold.target_from_source = h.target_from_source;
    at_threshold.inlier_threshold = inlier_threshold;
    null.score_given(at_threshold, set);
    if (at_threshold.log10_nfa < h.log10_nfa) h = std::move(at_threshold);
  }
  h.correspondences = context.pair_stems(h.target_from_source, h.inlier_threshold);
  h.rms = context.rms(h.target_from_source, h.correspondences);
  hypothesis scored = in_caller_frames(std::move(h), source, target);
  scored.target_from_source = target_from_source;
  return scored;
}

GLOBALMATCH_INLINE std::shared_ptr<const prepared_stems> prepare_positions(position_set stems,
                                                                           bool horizontal_distances,
                                                                           const execution& exec,
                                                                           build_mode) {
  return std::make_shared<const prepared_stems>(prepare_stems(std::move(stems), horizontal_distances, exec));
}

}  // namespace globalmatch::detail
