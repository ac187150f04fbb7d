// Vote search: transforms in plan that triangles from all over a map ask for. In: two maps, one of them
// indexed, that share so few stems that those around a handful of stems show nothing. Out: distinct
// hypotheses, verified over all stems. Ours; the votes are those of a generalised Hough transform (Ballard
// 1981, Pattern Recognition 13(2)).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/keyed_sort.hpp"
#include "globalmatch/detail/core/neighbor.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/detail/matching/indexed_matching.hpp"
#include "globalmatch/detail/matching/matching_context.hpp"
#include "globalmatch/detail/matching/null_model.hpp"
#include "globalmatch/detail/matching/score_hypothesis.hpp"
#include "globalmatch/detail/matching/triangle_index.hpp"
#include "globalmatch/detail/matching/verify.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/triangles.hpp"

namespace globalmatch::detail {

/// Votes of pairs of congruent triangles for where they place the middle of a block of source stems, and how
/// they turn it. A block is so small that the yaw of a triangle is good enough for all of it.
class block_votes {
 public:
  block_votes(const matching_context& context, double inlier_threshold)
      : context_(context),
        spacing_(std::max(context.source_index->spacing(), inlier_threshold)),
        side_(block_spacings * spacing_),
        cell_(cell_thresholds * inlier_threshold),
        yaws_(std::clamp(std::floor(2 * std::numbers::pi * spacing_ / inlier_threshold), 4.0, max_yaws)) {}

  std::size_t size() const { return votes_.size(); }

  void vote(const std::array<stem_index, 3>& source, const std::array<stem_index, 3>& target) {
    if (context_.prior &&
        !context_.prior->may_place(context_.source.at[source[0]], context_.target.at[target[0]]))
      return;
    const vec2 from = (context_.source.at[source[2]] - context_.source.at[source[1]]).xy(),
               to = (context_.target.at[target[2]] - context_.target.at[target[1]]).xy();
    const double lengths = std::sqrt(from.squared_norm() * to.squared_norm());
    if (!(lengths > 0)) return;
    const double cosine = from.dot(to) / lengths, sine = (from.x * to.y - from.y * to.x) / lengths;
    const vec2 corner = context_.source.at[source[0]].xy();
    const std::int64_t column = cell_of(corner.x, side_), row = cell_of(corner.y, side_);
    const vec2 arm = vec2{(double(column) + 0.5) * side_, (double(row) + 0.5) * side_} - corner;
    const vec2 placed = context_.target.at[target[0]].xy() +
                        vec2{cosine * arm.x - sine * arm.y, sine * arm.x + cosine * arm.y};
    const double turns = std::atan2(sine, cosine) / (2 * std::numbers::pi) + 0.5;
    const auto yaw = std::uint64_t(turns * yaws_);
    votes_.push_back(
        {hash_of(column, row, cell_of(placed.x, cell_), cell_of(placed.y, cell_), yaw), triangles_.size()});
    triangles_.push_back({{{source[0], target[0]}, {source[1], target[1]}, {source[2], target[2]}}});
  }

  /// The pairs of stems of the `maximum` cells of most votes, of more than one.
  std::vector<std::vector<correspondence>> peaks(std::size_t maximum) {
    constexpr std::size_t max_triangles = 16;  // of a cell, which are enough for its transform
    sort_keyed(votes_);
    std::vector<keyed> order;
    for (std::size_t begin = 0, end = 0; begin < votes_.size(); begin = end) {
      while (end < votes_.size() && votes_[end].key == votes_[begin].key) ++end;
      if (end - begin > 1) order.push_back({~std::uint64_t(end - begin), begin});
    }
    keep_first(order, std::min(maximum, order.size()));
    std::vector<std::vector<correspondence>> pairs;
    for (const keyed& peak : order) {
      pairs.emplace_back();
      const std::size_t last = peak.value + std::min<std::size_t>(max_triangles, ~peak.key);
      for (std::size_t v = peak.value; v < last; ++v)
        for (const correspondence& c : triangles_[votes_[v].value]) pairs.back().push_back(c);
    }
    return pairs;
  }

 private:
  static constexpr double block_spacings = 12, max_yaws = 4096;
  // What a vote is off by: the threshold at the triangle, and half a block away by the yaw that it makes.
  static constexpr double cell_thresholds = 10;

  static std::int64_t cell_of(double at, double side) {
    constexpr double maximum = 9e18;  // that an integer holds
    return std::int64_t(std::clamp(std::floor(at / side), -maximum, maximum));
  }
  static std::uint64_t hash_of(std::int64_t a, std::int64_t b, std::int64_t c, std::int64_t d,
                               std::uint64_t e) {
    std::uint64_t hash = e;
    for (const std::int64_t number : {a, b, c, d}) {  // splitmix64
      hash += std::uint64_t(number) + 0x9e3779b97f4a7c15u;
      hash = (hash ^ (hash >> 30)) * 0xbf58476d1ce4e5b9u;
      hash = (hash ^ (hash >> 27)) * 0x94d049bb133111ebu;
      hash ^= hash >> 31;
    }
    return hash;
  }

  const matching_context& context_;
  double spacing_, side_, cell_;  // [m] of source stems; of a block; of a cell
  double yaws_;                   // that are distinguished
  std::vector<keyed> votes_;      // block, place and yaw; number of the triangle
  std::vector<std::array<correspondence, 3>> triangles_;
};

/// Stems around a source stem that make triangles which vote, where maps are large (ours).
inline constexpr std::size_t vote_neighbors = 8;

/// Votes of the triangles that source stems make with so many nearest ones: of all, or of some in large maps.
/// What was looked at is added to `funnel`.
inline block_votes collect_votes(const matching_context& context, const triangle_index& index,
                                 double inlier_threshold, std::size_t source_neighbors,
                                 matching_funnel& funnel) {
  constexpr std::size_t max_queries = 60'000, max_votes = 60'000;
  block_votes votes(context, inlier_threshold);
  std::vector<neighbor<double>> nearest;
  std::size_t queries = 0;
  for (const stem_index i : shuffled_stems(context.source.size())) {
    if (queries >= max_queries || votes.size() >= max_votes) break;
    if (queries % 64 == 0) report_progress(context.exec, "matching", double(queries) / double(max_queries));
    context.source_index->nearest(i, source_neighbors, nearest);
    for (std::size_t j = 0; j < nearest.size(); ++j)
      for (std::size_t k = j + 1; k < nearest.size(); ++k) {
        const triangle t = make_triangle(context.source, {i, nearest[j].index, nearest[k].index}, true);
        ++queries;
        if (t.horizontal_width < 2 * inlier_threshold) continue;  // hardly fixes a yaw
        if (votes.size() >= max_votes) break;
        for (const triangle& ordered : admissible_orders(t, inlier_threshold))
          index.for_each_like(ordered, inlier_threshold, [&](const std::array<stem_index, 3>& congruent) {
            votes.vote(ordered.vertices, congruent);
          });
      }
  }
  funnel.source_triangles += queries;
  funnel.target_triangles = index.size();
  funnel.local_pairs += votes.size();
  return votes;
}

/// Of the source stems around the first one that is paired, how many the transform of the pairs places near
/// target stems; 0 where these are few.
inline std::size_t count_around(const matching_context& context, std::span<const correspondence> pairs,
                                double inlier_threshold, std::vector<neighbor<double>>& nearest) {
  constexpr std::size_t around = 40, min_hits = 3;
  const auto transform = context.fit(pairs);
  if (!transform || !context.allows(*transform)) return 0;
  context.source_index->nearest(pairs.front().source, around, nearest);
  std::size_t hits = 0;
  for (const auto& n : nearest)
    hits += context.has_inlier(*transform * context.source.at[n.index], 2 * inlier_threshold);
  return hits < min_hits ? 0 : hits;
}

/// Distinct hypotheses at a threshold [m], verified over all stems and scored, best first; the rest as in
/// `match_by_index`. Cost: bounded by the queries and votes, and linear in the stems for the few transforms
/// that are verified.
inline std::vector<local_hypothesis> match_by_votes(const matching_context& context,
                                                    const triangle_index& index, double inlier_threshold,
                                                    const null_model& null,
                                                    std::span<const double> thresholds,
                                                    std::size_t source_neighbors, matching_funnel& funnel) {
  constexpr std::size_t max_peaks = 512, max_verified = 12;
  const auto peaks =
      collect_votes(context, index, inlier_threshold, source_neighbors, funnel).peaks(max_peaks);
  std::vector<keyed> order;
  std::vector<neighbor<double>> nearest;
  for (std::size_t p = 0; p < peaks.size(); ++p)
    if (const std::size_t hits = count_around(context, peaks[p], inlier_threshold, nearest); hits > 0)
      order.push_back({~std::uint64_t(hits), p});
  funnel.tested += peaks.size();
  sort_keyed(order);
  const auto is_promising = [&](const rigid& transform, const vec3& center, double radius) {
    return !null.explains_around(transform, center, radius, inlier_threshold);
  };
  std::vector<local_hypothesis> hypotheses;
  std::size_t verified = 0;
  for (const keyed& next : order) {
    const auto& pairs = peaks[next.value];
    const bool is_known = std::any_of(hypotheses.begin(), hypotheses.end(), [&](const local_hypothesis& h) {
      return leads_to({pairs[0], pairs[1], pairs[2]}, h, context);
    });
    if (is_known) continue;
    if (verified++ == max_verified) break;
    auto h = verify(context, pairs, inlier_threshold, is_promising);
    if (!h) continue;
    score_hypothesis(*h, context, null, thresholds);
    add_distinct(std::move(*h), hypotheses, context);
  }
  keep_best(hypotheses, max_hypotheses);
  return hypotheses;
}

}  // namespace globalmatch::detail
