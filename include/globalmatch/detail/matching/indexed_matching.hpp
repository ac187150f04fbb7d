// Indexed proposal: motions from triangles that look alike, tried on the stems around them. In: two maps, one
// of them indexed. Out: distinct hypotheses, verified over all stems. Cost: a fixed number of queries, each
// with as many candidates as there are triangles that look alike.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <optional>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/neighbor.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/detail/matching/null_model.hpp"
#include "globalmatch/detail/matching/triangle_index.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/matching_options.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/positions.hpp"
#include "globalmatch/triangles.hpp"

namespace globalmatch::detail {

/// A motion and how many of the stems around its triangle it lays on stems.
struct trial {
  std::array<correspondence, 3> triangle;
  std::size_t hits = 0;
};

/// Tries motions on the stems around a source stem.
class transform_trial {
 public:
  transform_trial(const matching_context& context, double inlier_threshold, bool exhaustive)
      : context_(context), max_distance_(2 * inlier_threshold), exhaustive_(exhaustive) {}

  /// Of `around`, nearest first, how many the triangle's motion lays on target stems; nothing when so few of
  /// the first ones that the rest is not worth it.
  std::optional<std::size_t> count_hits(const std::array<correspondence, 3>& triangle,
                                        std::span<const stem_index> around) const {
    constexpr std::size_t check_interval = 8, min_share = 5;  // one in five, told after every eight
    const auto transform = context_.fit(triangle);
    if (!transform) return std::nullopt;
    for (const correspondence& c : triangle)
      if (context_.residual(*transform, c) > max_distance_ ||
          !context_.heights_agree(*transform * context_.source.at[c.source], c.target))
        return std::nullopt;
    std::size_t tried = 0, hits = 0;
    for (const stem_index s : around) {
      if (std::any_of(triangle.begin(), triangle.end(), [&](const auto& c) { return c.source == s; }))
        continue;
      bool hit = false;
      context_.for_each_inlier(*transform * context_.source.at[s], max_distance_,
                               [&](stem_index, double) { hit = true; });
      hits += hit;
      ++tried;
      if (!exhaustive_ && tried % check_interval == 0 && hits * min_share < tried) return std::nullopt;
    }
    return hits;
  }

 private:
  const matching_context& context_;
  double max_distance_;
  bool exhaustive_;
};

/// Motions that triangles with one source stem propose, and which of them to try: those that lay it on the
/// same target stem with about the same yaw are tried once, and those that most triangles vote for first.
class vote_accumulator {
 public:
  explicit vote_accumulator(const matching_context& context) : context_(context) {}

  /// Forgets all votes, and keeps the memory. `yaw_width` [rad] of votes that count as one.
  void reset(double yaw_width) {
    votes_.clear();
    triangles_.clear();
    constexpr double maximum = 1e6;  // finer ones tell nothing
    yaws_ = std::clamp(std::floor(2 * std::numbers::pi / yaw_width), 1.0, maximum);
  }

  /// The votes that follow are for this triangle, which has source stem `i` among its corners.
  void set_query(const triangle& of_source, stem_index i) {
    const auto& v = of_source.vertices;
    query_ = v;
    own_ = std::size_t(std::find(v.begin(), v.end(), i) - v.begin());
    direction_ = direction(context_.source, v[1], v[2]);
  }

  /// Hands in a target triangle that looks like it.
  void vote(const std::array<stem_index, 3>& like) {
    const vec2 d = direction(context_.target, like[1], like[2]);
    const double turned = quadrants(d.dot(direction_), direction_.x * d.y - direction_.y * d.x);
    const auto yaw = static_cast<std::uint64_t>(turned / 4 * yaws_);
    votes_.push_back({std::uint64_t(like[own_]) << 32 | yaw, static_cast<std::uint32_t>(triangles_.size())});
    triangles_.push_back({{{query_[0], like[0]}, {query_[1], like[1]}, {query_[2], like[2]}}});
  }

  /// The triangles to try, at most `maximum`, each the last one handed in of those with one motion.
  std::vector<std::array<correspondence, 3>> peaks(std::size_t maximum) {
    std::sort(votes_.begin(), votes_.end());
    results_.clear();
    for (std::size_t i = 0; i < votes_.size(); ++i) {
      const bool same = i > 0 && votes_[i - 1].transform == votes_[i].transform;
      if (!same) results_.push_back({0, static_cast<std::uint32_t>(results_.size()), 0});
      ++results_.back().votes;
      results_.back().triangle = votes_[i].triangle;
    }
    const auto peaks_end = results_.begin() + std::ptrdiff_t(std::min(results_.size(), maximum));
    std::partial_sort(results_.begin(), peaks_end, results_.end(), [](const result& a, const result& b) {
      return a.votes != b.votes ? a.votes > b.votes : a.order < b.order;
    });
    std::vector<std::array<correspondence, 3>> triangles;
    for (auto r = results_.begin(); r != peaks_end; ++r) triangles.push_back(triangles_[r->triangle]);
    return triangles;
  }

 private:
  struct vote_entry {
    std::uint64_t transform;  // target stem in the high bits, yaw in the low ones
    std::uint32_t triangle;
    auto operator<=>(const vote_entry&) const = default;
  };
  struct result {
    std::uint32_t votes, order, triangle;
  };

  static vec2 direction(const position_set& stems, stem_index from, stem_index to) {
    return (stems.at[to] - stems.at[from]).xy();
  }

  /// Grows with the angle of (x, y) from 0 to 4, though not quite evenly within a quadrant; an arc tangent
  /// for each vote would take longer than all the rest of it.
  static double quadrants(double x, double y) {
    const double sum = std::abs(x) + std::abs(y), share = sum > 0 ? x / sum : 1;
    return y < 0 ? 3 + share : 1 - share;
  }

  const matching_context& context_;
  double yaws_ = 1;                       // that are told apart
  std::array<stem_index, 3> query_ = {};  // source triangle, ...
  std::size_t own_ = 0;                   // ... which of its corners all have in common, ...
  vec2 direction_ = {1, 0};    // ... and where its longest edge points
  std::vector<vote_entry> votes_;
  std::vector<result> results_;
  std::vector<std::array<correspondence, 3>> triangles_;
};

/// Source stems in an order of its own for each seed, so that queries come from all over the map.
inline std::vector<stem_index> shuffled_stems(std::size_t count, std::uint64_t seed) {
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
  /// No more than about `max_candidates` are looked at, or held in memory.
  triangle_search(const matching_context& context, const triangle_index& index, double inlier_threshold,
                  const indexed_matching_options& options, bool exhaustive, std::size_t max_candidates)
      : context_(context),
        index_(index),
        inlier_threshold_(inlier_threshold),
        options_(options),
        max_candidates_(max_candidates),
        corners_(std::size_t(exhaustive ? options.exhaustive_neighbors : options.source_neighbors)),
        trial_(context, inlier_threshold, exhaustive),
        votes_(context) {}

  std::size_t queries() const { return queries_; }
  std::size_t candidates() const { return candidates_; }
  bool is_exhausted() const { return candidates_ >= max_candidates_; }
  std::size_t tested() const { return tested_; }

  /// Motions of triangles with source stem `i` that no hypothesis explains, those that lay most of the stems
  /// around on stems first.
  std::vector<trial> transforms_around(stem_index i, std::span<const local_hypothesis> known) {
    context_.source_index->nearest(i, std::size_t(options_.trial_neighbors), nearest_);
    around_.clear();
    for (const auto& n : nearest_) around_.push_back(n.index);
    std::vector<trial> trials;
    look_up(i);
    for (const auto& triangle : votes_.peaks(options_.max_trials)) {
      if (is_known(triangle, known)) continue;
      ++tested_;
      if (const auto hits = trial_.count_hits(triangle, around_)) trials.push_back({triangle, *hits});
    }
    std::stable_sort(trials.begin(), trials.end(),
                     [](const trial& a, const trial& b) { return a.hits > b.hits; });
    return trials;
  }

  bool is_known(const std::array<correspondence, 3>& triangle, std::span<const local_hypothesis> known) const {
    return std::any_of(known.begin(), known.end(),
                       [&](const local_hypothesis& h) { return leads_to(triangle, h, context_); });
  }

 private:
  /// Triangles of stem `i` and those of the target that look alike.
  void look_up(stem_index i) {
    const double min_width = 2 * inlier_threshold_;  // [m] a flatter triangle hardly fixes a turn
    const std::size_t corners = std::min(around_.size(), corners_);
    const double max_distance = corners > 0 ? std::sqrt(nearest_[corners - 1].squared_distance) : 0;
    votes_.reset(inlier_threshold_ / std::max(max_distance, inlier_threshold_));
    for (std::size_t j = 0; j < corners; ++j)
      for (std::size_t k = j + 1; k < corners; ++k) {
        const triangle t =
            make_triangle(context_.source, {i, around_[j], around_[k]}, context_.horizontal_distances());
        ++queries_;
        if (t.horizontal_width < min_width) continue;
        if (candidates_ >= max_candidates_) return;
        for_each_admissible_order(t, inlier_threshold_, [&](const triangle& ordered) {
          votes_.set_query(ordered, i);
          index_.for_each_like(ordered, inlier_threshold_, [&](const std::array<stem_index, 3>& like) {
            ++candidates_;
            votes_.vote(like);
          });
        });
      }
  }

  const matching_context& context_;
  const triangle_index& index_;
  double inlier_threshold_;
  const indexed_matching_options& options_;
  std::size_t max_candidates_, corners_;
  transform_trial trial_;
  vote_accumulator votes_;
  std::size_t queries_ = 0, candidates_ = 0, tested_ = 0;
  std::vector<neighbor<double>> nearest_;
  std::vector<stem_index> around_;
};

/// Distinct hypotheses, verified over all stems at `inlier_threshold` [m] and judged against chance, best
/// first. `index` is that of the target's triangles; `thresholds` [m], increasing, are those that stems may
/// be paired at in the end. `exhaustive`: every motion is tried on all stems around it, and more triangles
/// are queried, as maps that share only few stems need. What was looked at is added to `funnel`. Throws
/// `operation_cancelled`. Cost: bounded by the queries and candidates of `options`, and linear in the stems
/// for each motion that is verified.
inline std::vector<local_hypothesis> match_by_index(const matching_context& context, const triangle_index& index,
                                              double inlier_threshold, const null_model& null,
                                              std::span<const double> thresholds,
                                              const indexed_matching_options& options, bool exhaustive,
                                              matching_funnel& funnel, const execution& exec = {}) {
  const std::size_t best_of_query = exhaustive ? 8 : 2;  // verified over all stems
  triangle_search search(context, index, inlier_threshold, options, exhaustive,
                         options.max_candidates - std::min(options.max_candidates, funnel.local_pairs));
  std::vector<local_hypothesis> hypotheses;
  std::size_t stems = 0;
  bool found = false;
  for (const stem_index i : shuffled_stems(context.source.size(), options.seed)) {
    if (found && stems >= options.stems_for_alternatives) break;
    if (search.queries() >= options.max_queries || search.is_exhausted()) break;
    report_progress(exec, "matching", double(search.queries()) / double(options.max_queries));
    ++stems;
    std::size_t verified = 0;
    for (const trial& best : search.transforms_around(i, hypotheses)) {
      if (verified == best_of_query) break;
      if (search.is_known(best.triangle, hypotheses)) continue;
      ++verified;
      auto h = verify(context, best.triangle, inlier_threshold,
                      [&](const rigid& transform, const vec3& center, double radius) {
                        return !null.explains_around(transform, center, radius, inlier_threshold);
                      });
      if (!h) continue;
      score_hypothesis(*h, context, null, thresholds);
      found = found || h->log10_nfa < options.sufficient_log10_nfa;
      add_distinct(std::move(*h), hypotheses, context);
      if (hypotheses.size() == 2 * options.max_hypotheses) keep_best(hypotheses, options.max_hypotheses);
    }
  }
  funnel.source_triangles += search.queries();
  funnel.target_triangles = index.size();
  funnel.local_pairs += search.candidates();
  funnel.tested += search.tested();
  keep_best(hypotheses, options.max_hypotheses);
  return hypotheses;
}
}  // namespace globalmatch::detail
