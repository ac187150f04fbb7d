// Evidence of positions: how many stems are near others under a transform, and how near.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/matching/consensus_proposal.hpp"
#include "globalmatch/detail/matching/evidence.hpp"
#include "globalmatch/detail/matching/indexed_matching.hpp"
#include "globalmatch/detail/matching/null_model.hpp"
#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "globalmatch/detail/matching/score_hypothesis.hpp"
#include "globalmatch/detail/matching/vote_search.hpp"
#include "globalmatch/local_matching.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/matching_options.hpp"
#include "globalmatch/triangles.hpp"

namespace globalmatch::detail {

/// Thresholds [m] that hypotheses are proposed at, and those that they may be paired at in the end: scans of
/// one instrument agree to centimetres, mobile lidar to decimetres, field surveys to half a metre.
inline constexpr double proposal_thresholds[] = {0.05, 0.1, 0.2, 0.4};
inline constexpr double pairing_thresholds[] = {0.02, 0.028, 0.04, 0.057, 0.08, 0.113,
                                                0.16, 0.226, 0.32, 0.45,  0.64, 0.9};

/// The background density of the target stems that a hypothesis pairs: some thousands from one place where
/// there are more, and none where they are too few to tell a lattice from chance. They may be planted though
/// most of the map is not.
inline background_density paired_background(const local_hypothesis& h, const matching_context& context) {
  constexpr std::size_t minimum = 20;
  constexpr double maximum = 4096;
  const double radius = std::sqrt(maximum / std::numbers::pi) * context.target_index->spacing();
  position_set paired;
  if (h.correspondences.size() >= minimum) {
    const vec3 center = context.target.at[h.correspondences[h.correspondences.size() / 2].target];
    for (const correspondence& c : h.correspondences)
      if ((context.target.at[c.target] - center).xy().norm() < radius)
        paired.at.push_back(context.target.at[c.target]);
  }
  return background_density(paired, std::make_shared<position_index>(paired));
}

/// The lattice of the stems of both maps together under a hypothesis, where these are few: two plantations
/// that have nothing in common but their spacing are one lattice then.
inline lattice_of_few lattice_of_both(const local_hypothesis& h, const matching_context& context) {
  position_set both;
  if (std::max(context.source.size(), context.target.size()) > lattice_of_few::max_stems) return {};
  std::vector<bool> source_is_paired(context.source.size()), target_is_paired(context.target.size());
  for (const correspondence& c : h.correspondences) {
    both.at.push_back((h.target_from_source * context.source.at[c.source] + context.target.at[c.target]) / 2);
    source_is_paired[c.source] = target_is_paired[c.target] = true;
  }
  for (stem_index s = 0; s < context.source.size(); ++s)
    if (!source_is_paired[s]) both.at.push_back(h.target_from_source * context.source.at[s]);
  for (stem_index t = 0; t < context.target.size(); ++t)
    if (!target_is_paired[t]) both.at.push_back(context.target.at[t]);
  return find_lattice_of_few(both);
}

/// Refers to all that it is made of.
class position_evidence {
  using thresholds = std::span<const double>;

 public:
  /// What is looked at is added to `funnel`. `exhaustive`: in space small maps are searched for whatever a
  /// few stems may show.
  position_evidence(const matching_context& context, const prepared_stems& target,
                    const matching_options& options, matching_funnel& funnel, bool exhaustive = true)
      : context_(context),
        target_(target),
        options_(options),
        funnel_(funnel),
        exhaustive_(exhaustive),
        proposing_(options.inlier_threshold ? thresholds(&*options.inlier_threshold, 1)
                                            : thresholds(proposal_thresholds)),
        pairing_(options.inlier_threshold ? proposing_ : thresholds(pairing_thresholds)),
        null_model_(context, target.background, pairing_, proposing_) {
    null_model_.include_reversed();
  }

  /// [m] increasing, those that stems may be paired at
  thresholds pairing() const { return pairing_; }

  /// Ranked hypotheses, scored: at one threshold after the other, the smallest first, until chance no longer
  /// explains what is found.
  std::vector<local_hypothesis> propose(std::size_t maximum) const {
    std::vector<local_hypothesis> hypotheses =
        options_.proposal == proposal::triangle_index ? propose_by_index(maximum) : propose_by_algorithm_1();
    if (context_.prior) add_prior(hypotheses);
    return hypotheses;
  }

  /// Of a transform, at the threshold of its hypothesis.
  evidence_score score(const local_hypothesis& h) const {
    local_hypothesis scored;
    scored.inlier_threshold = h.inlier_threshold;
    null_model_.score(scored, null_model_.residuals_under(h.target_from_source, h.inlier_threshold));
    return {scored.log10_nfa, evidence_source::positions, scored.log10_nfa_poisson};
  }

  /// Scores a hypothesis, re-paired and refitted at the best of some thresholds.
  void refit(local_hypothesis& h, thresholds some) const { score_hypothesis(h, context_, null_model_, some); }

  /// As `null_model::leave_out_lattice`.
  void leave_out_lattice() { null_model_.leave_out_lattice(); }

  /// From now on the null model knows the lattice, if any, of the stems that a hypothesis pairs, or of few.
  void include_lattice_of(const local_hypothesis& h) {
    const lattice_of_few few = lattice_of_both(h, context_);
    may_be_planted_ = few.occupied > 0;
    null_model_.include_lattice_of(paired_background(h, context_), few);
  }
  /// Whether few stems are probably planted, under the last hypothesis that was asked.
  bool may_be_planted() const { return may_be_planted_; }

 private:
  static bool is_sufficient(const std::vector<local_hypothesis>& ranked) {
    return !ranked.empty() && ranked.front().log10_nfa < sufficient_log10_nfa;
  }

  /// What the stems make of the most probable transform of the prior.
  void add_prior(std::vector<local_hypothesis>& hypotheses) const {
    local_hypothesis h;
    h.target_from_source = context_.prior->transform();
    refit(h, pairing_);
    if (h.correspondences.size() >= 3) add_distinct(std::move(h), hypotheses, context_);
    rank(hypotheses);
  }

  /// By the paper's Algorithm 1.
  std::vector<local_hypothesis> propose_by_algorithm_1() const {
    const bool horizontal = context_.horizontal;
    const auto source = build_triangles(context_.source, horizontal, options_.triangles, context_.exec);
    const auto target = build_triangles(context_.target, horizontal, options_.triangles, context_.exec);
    funnel_.source_triangles = source.size();
    funnel_.target_triangles = target.size();
    std::vector<local_hypothesis> hypotheses;
    for (const double inlier_threshold : proposing_) {
      auto pairs = match_locally(source, target, inlier_threshold, context_.exec);
      std::erase_if(pairs, [&](const triangle_pair& pair) { return !may_be(pair); });
      std::size_t tested = 0;
      auto proposed = propose_by_consensus(context_, pairs, inlier_threshold, options_.global, &tested);
      funnel_.local_pairs += pairs.size();
      funnel_.tested += tested;
      for (local_hypothesis& h : proposed) {
        refit(h, pairing_);
        add_distinct(std::move(h), hypotheses, context_);
      }
      rank(hypotheses);
      if (is_sufficient(hypotheses)) break;
    }
    return hypotheses;
  }

  /// Whether the prior, if any, allows a pair of congruent triangles.
  bool may_be(const triangle_pair& pair) const {
    const auto transform = context_.prior ? context_.fit(correspondences_of(pair)) : std::nullopt;
    return !transform || context_.allows(*transform);
  }

  /// By the index: around a few stems, which is enough where many stems are common; then, in plan, by the
  /// votes of all.
  std::vector<local_hypothesis> propose_by_index(std::size_t maximum) const {
    constexpr std::size_t first_stems = 24;
    constexpr double max_threshold = 0.1,
                     max_threshold_rotated = 0.2;  // [m] beyond them triangles look alike
    std::vector<local_hypothesis> hypotheses;
    if (context_.horizontal_distances()) {
      if (!search(target_.triangles, false, maximum, hypotheses, first_stems, max_threshold))
        search_by_votes(maximum, hypotheses);
    } else if (!exhaustive_) {
      search(target_.triangles, false, maximum, hypotheses, first_stems, max_threshold_rotated);
    } else {
      search_in_space(maximum, hypotheses);
    }
    return hypotheses;
  }

  /// In space. Small maps are searched again, exhaustively, when nothing was found.
  void search_in_space(std::size_t maximum, std::vector<local_hypothesis>& hypotheses) const {
    const std::size_t smaller = std::min(context_.source.size(), context_.target.size());
    const std::size_t larger = std::max(context_.source.size(), context_.target.size());
    const bool few = smaller <= exhaustive_max_stems;
    if (few && larger > retry_max_stems && search(target_.triangles, false, maximum, hypotheses)) return;
    if (search(target_.triangles, few, maximum, hypotheses)) return;
    if (larger > exhaustive_max_stems && larger <= retry_max_stems)
      search(triangle_index(context_.target, *target_.index, false, exhaustive_neighbors, context_.exec),
             true, maximum, hypotheses);
  }

  /// By the triangles of all stems together; in small maps they are made with stems further away, as those
  /// nearby may be in one map only.
  void search_by_votes(std::size_t maximum, std::vector<local_hypothesis>& hypotheses) const {
    constexpr float cell = 0.2f;  // [m] holds a triangle or more, but in the smallest maps
    const bool few = std::max(context_.source.size(), context_.target.size()) <= retry_max_stems;
    const std::size_t of_source = few ? exhaustive_neighbors : vote_neighbors,
                      of_target = few ? exhaustive_neighbors : target_neighbors;
    const triangle_index triangles(context_.target, *target_.index, true, of_target, context_.exec,
                                   triangle_step(context_.target.size()), cell);
    for (const double inlier_threshold : proposing_) {
      for (local_hypothesis& h :
           match_by_votes(context_, triangles, inlier_threshold, null_model_, pairing_, of_source, funnel_))
        add_distinct(std::move(h), hypotheses, context_);
      keep_best(hypotheses, maximum);
      if (is_sufficient(hypotheses)) return;
    }
  }

  /// Whether something was found that is sufficient, around the first `max_stems` stems, and at thresholds up
  /// to `max_threshold` [m], or at that of the options.
  bool search(const triangle_index& triangles, bool exhaustive, std::size_t maximum,
              std::vector<local_hypothesis>& hypotheses, std::size_t max_stems = std::size_t(-1),
              double max_threshold = std::numeric_limits<double>::infinity()) const {
    for (const double inlier_threshold : proposing_) {
      if (inlier_threshold > max_threshold && !options_.inlier_threshold) break;
      for (local_hypothesis& h : match_by_index(context_, triangles, inlier_threshold, null_model_, pairing_,
                                                exhaustive, funnel_, max_stems))
        add_distinct(std::move(h), hypotheses, context_);
      keep_best(hypotheses, maximum);
      if (is_sufficient(hypotheses)) return true;
    }
    return false;
  }

  const matching_context& context_;
  const prepared_stems& target_;
  const matching_options& options_;
  matching_funnel& funnel_;
  bool exhaustive_;
  thresholds proposing_, pairing_;  // [m]
  null_model null_model_;
  bool may_be_planted_ = false;
};

static_assert(evidence<position_evidence>);

}  // namespace globalmatch::detail
