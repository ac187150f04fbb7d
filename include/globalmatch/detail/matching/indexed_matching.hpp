// Indexed proposal: transforms from congruent triangles, tried on the stems around them. In: two maps, one of
// them indexed. Out: distinct hypotheses, verified over all stems. Cost: a fixed number of queries, each with
// as many candidates as there are congruent triangles.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/keyed_sort.hpp"
#include "globalmatch/detail/core/neighbor.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/matching/null_model.hpp"
#include "globalmatch/detail/matching/score_hypothesis.hpp"
#include "globalmatch/detail/matching/transform_votes.hpp"
#include "globalmatch/detail/matching/triangle_index.hpp"
#include "globalmatch/detail/matching/verify.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/triangles.hpp"

namespace globalmatch::detail {

/// log10 of the NFA at which nothing further is searched (ours).
inline constexpr double sufficient_log10_nfa = -10;
/// Distinct hypotheses that are remembered and returned (ours).
inline constexpr std::size_t max_hypotheses = 16;

/// A transform and how many of the stems around its triangle are inliers.
struct trial {
  std::array<correspondence, 3> triangle;
  std::size_t hits = 0;
};

/// Source stems in a random order, so that queries come from all over the map.
inline std::vector<stem_index> shuffled_stems(std::size_t count) {
  constexpr std::uint64_t seed = 1;
  std::vector<stem_index> order(count);
  std::iota(order.begin(), order.end(), stem_index(0));
  random_source random(seed);
  for (std::size_t i = count; i > 1; --i)
    std::swap(order[i - 1], order[random.below(static_cast<std::uint32_t>(i))]);
  return order;
}

/// Looks triangles of a source map up in those of a target map, stem after stem.
class triangle_search {
 public:
  /// `exhaustive`: every transform is tried on all stems around it, and more triangles are queried, as maps
  /// that share only few stems need. No more than about `max_candidates` are looked at, or held in memory.
  triangle_search(const matching_context& context, const triangle_index& index, double inlier_threshold,
                  bool exhaustive, std::size_t max_candidates)
      : context_(context),
        index_(index),
        inlier_threshold_(inlier_threshold),
        exhaustive_(exhaustive),
        max_candidates_(max_candidates),
        votes_(context) {}

  std::size_t queries() const { return queries_; }
  std::size_t candidates() const { return candidates_; }
  bool is_exhausted() const { return candidates_ >= max_candidates_; }
  std::size_t tested() const { return tested_; }

  /// Transforms of triangles with source stem `i` that no hypothesis explains, those with most inliers around
  /// first.
  std::vector<trial> transforms_around(stem_index i, std::span<const local_hypothesis> known) {
    constexpr std::size_t trial_neighbors = 40;  // stems that a transform is tried on (ours)
    constexpr std::size_t max_trials = 400;      // transforms that are tried (ours)
    constexpr std::size_t between_polls = 32;
    context_.source_index->nearest(i, trial_neighbors, nearest_);
    look_up(i);
    std::vector<trial> trials;
    std::vector<keyed> order;
    for (const auto& triangle : votes_.peaks(max_trials)) {
      if (is_known(triangle, known)) continue;
      if (++tested_ % between_polls == 0) poll_cancelled();
      const auto hits = count_hits(triangle);
      if (!hits) continue;
      order.push_back({~std::uint64_t(*hits), trials.size()});
      trials.push_back({triangle, *hits});
    }
    sort_keyed(order);
    std::vector<trial> sorted;
    for (const keyed& next : order) sorted.push_back(trials[next.value]);
    return sorted;
  }

  bool is_known(const std::array<correspondence, 3>& triangle,
                std::span<const local_hypothesis> known) const {
    for (const local_hypothesis& h : known)
      if (leads_to(triangle, h, context_)) return true;
    return false;
  }

 private:
  /// Triangles of stem `i` and the congruent ones of the target.
  void look_up(stem_index i) {
    constexpr std::size_t source_neighbors = 8;      // stems that make triangles to query (ours)
    const double min_width = 2 * inlier_threshold_;  // [m] a flatter triangle hardly fixes a yaw
    const std::size_t corners =
        std::min(nearest_.size(), exhaustive_ ? exhaustive_neighbors : source_neighbors);
    const double max_distance = corners > 0 ? std::sqrt(nearest_[corners - 1].squared_distance) : 0;
    votes_.reset(inlier_threshold_ / std::max(max_distance, inlier_threshold_));
    for (std::size_t j = 0; j < corners; ++j) {
      poll_cancelled();
      for (std::size_t k = j + 1; k < corners; ++k) {
        const triangle t = make_triangle(context_.source, {i, nearest_[j].index, nearest_[k].index},
                                         context_.horizontal_distances());
        ++queries_;
        if (t.horizontal_width < min_width) continue;
        if (candidates_ >= max_candidates_) return;
        for (const triangle& ordered : admissible_orders(t, inlier_threshold_)) {
          votes_.set_query(ordered, i);
          index_.for_each_like(ordered, inlier_threshold_, [&](const std::array<stem_index, 3>& congruent) {
            ++candidates_;
            votes_.vote(congruent);
          });
        }
      }
    }
  }

  /// Of the stems around, nearest first, how many are inliers of the triangle's transform; nothing when so
  /// few of the first ones that the rest is not worth it.
  std::optional<std::size_t> count_hits(const std::array<correspondence, 3>& triangle) const {
    constexpr std::size_t check_interval = 8, min_share = 5;  // one in five, looked at after every eight
    const double max_distance = 2 * inlier_threshold_;
    const auto transform = context_.fit(triangle);
    if (!transform || !context_.allows(*transform)) return std::nullopt;
    for (const correspondence& c : triangle)
      if (context_.residual(*transform, c) > max_distance) return std::nullopt;
    std::size_t tried = 0, hits = 0;
    for (const auto& n : nearest_) {
      if (n.index == triangle[0].source || n.index == triangle[1].source || n.index == triangle[2].source)
        continue;
      hits += context_.has_inlier(*transform * context_.source.at[n.index], max_distance);
      ++tried;
      if (!exhaustive_ && tried % check_interval == 0 && hits * min_share < tried) return std::nullopt;
    }
    return hits;
  }

  const matching_context& context_;
  const triangle_index& index_;
  double inlier_threshold_;
  bool exhaustive_;
  std::size_t max_candidates_;
  vote_accumulator votes_;
  std::size_t queries_ = 0, candidates_ = 0, tested_ = 0;
  std::vector<neighbor<double>> nearest_;  // stems around the one at hand
};

/// Distinct hypotheses, verified over all stems at `inlier_threshold` [m] and scored, best first. `index` is
/// that of the target's triangles; `thresholds` [m], increasing, are those that stems may be paired at in the
/// end. `exhaustive` as in `triangle_search`. What was looked at is added to `funnel`. Throws
/// `operation_cancelled`. Cost: bounded by the queries and candidates, and linear in the stems for each
/// transform that is verified.
inline std::vector<local_hypothesis> match_by_index(const matching_context& context,
                                                    const triangle_index& index, double inlier_threshold,
                                                    const null_model& null,
                                                    std::span<const double> thresholds, bool exhaustive,
                                                    matching_funnel& funnel,
                                                    std::size_t max_stems = std::size_t(-1)) {
  constexpr std::size_t max_queries = 20000,
                        max_candidates = 5'000'000;      // source triangles; target ones (ours)
  constexpr std::size_t stems_for_alternatives = 5;      // looked at although a hypothesis is found (ours)
  const std::size_t best_of_query = exhaustive ? 8 : 2;  // verified over all stems (ours)
  triangle_search search(context, index, inlier_threshold, exhaustive,
                         max_candidates - std::min(max_candidates, funnel.local_pairs));
  const auto is_promising = [&](const rigid& transform, const vec3& center, double radius) {
    return !null.explains_around(transform, center, radius, inlier_threshold);
  };
  std::vector<local_hypothesis> hypotheses;
  std::size_t stems = 0;
  bool found = false;
  for (const stem_index i : shuffled_stems(context.source.size())) {
    if (found && stems >= stems_for_alternatives) break;
    if (stems == max_stems || search.queries() >= max_queries || search.is_exhausted()) break;
    report_progress(context.exec, "matching", double(search.queries()) / double(max_queries));
    ++stems;
    std::size_t verified = 0;
    for (const trial& best : search.transforms_around(i, hypotheses)) {
      if (verified == best_of_query) break;
      if (search.is_known(best.triangle, hypotheses)) continue;
      ++verified;
      auto h = verify(context, best.triangle, inlier_threshold, is_promising);
      if (!h) continue;
      score_hypothesis(*h, context, null, thresholds);
      found = found || h->log10_nfa < sufficient_log10_nfa;
      add_distinct(std::move(*h), hypotheses, context);
      if (hypotheses.size() == 2 * max_hypotheses) keep_best(hypotheses, max_hypotheses);
    }
  }
  funnel.source_triangles += search.queries();
  funnel.target_triangles = index.size();
  funnel.local_pairs += search.candidates();
  funnel.tested += search.tested();
  keep_best(hypotheses, max_hypotheses);
  return hypotheses;
}

}  // namespace globalmatch::detail
