// Star search: transforms in plan that place a source stem on a target stem, voted for by how far and where
// all other stems stand from both. All stems are tried, and so it is for maps of up to some hundred. In: two
// maps. Out: distinct hypotheses, verified over all stems. Ours.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/keyed_sort.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/detail/matching/indexed_matching.hpp"
#include "globalmatch/detail/matching/matching_context.hpp"
#include "globalmatch/detail/matching/null_model.hpp"
#include "globalmatch/detail/matching/score_hypothesis.hpp"
#include "globalmatch/detail/matching/verify.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::detail {

/// Another stem, as seen from one: its distance [m] and direction [turns, 0 to 1].
struct star_ray {
  float distance, direction;
  stem_index to;
};

/// The rays of stem `from` to all others, the shortest first.
inline std::vector<star_ray> star_of(const position_set& stems, stem_index from) {
  std::vector<keyed> order;
  std::vector<star_ray> rays;
  for (stem_index j = 0; j < stems.size(); ++j) {
    if (j == from) continue;
    const vec2 arm = (stems.at[j] - stems.at[from]).xy();
    const double turns = std::atan2(arm.y, arm.x) / (2 * std::numbers::pi);
    order.push_back({key_of(arm.norm()), rays.size()});
    rays.push_back({float(arm.norm()), float(turns < 0 ? turns + 1 : turns), j});
  }
  sort_keyed(order);
  std::vector<star_ray> sorted;
  sorted.reserve(rays.size());
  for (const keyed& next : order) sorted.push_back(rays[next.value]);
  return sorted;
}

/// A source stem placed on a target stem: the yaw [bins] that most rays ask for, and how many do.
struct star_peak {
  stem_index target;
  std::size_t votes = 0, yaw = 0;
};

/// Counts the rays that ask for each yaw.
class star_votes {
 public:
  explicit star_votes(double tolerance) : tolerance_(float(tolerance)) {}

  /// The best yaw between two stars, of those within `max_turn` [turns] of `yaw` [turns].
  star_peak peak(std::span<const star_ray> source, std::span<const star_ray> target, double yaw = 0,
                 double max_turn = 0.5) {
    std::fill(std::begin(changes_), std::end(changes_), std::int16_t(0));
    for_each_pair(source, target, [&](const star_ray&, const star_ray&, std::size_t first, std::size_t last) {
      ++changes_[first];
      --changes_[last + 1];
      if (last < first) ++changes_[0], --changes_[bins];
    });
    star_peak best{};
    int count = 0, most = 0;
    const bool all = max_turn + 1.0 / bins >= 0.5;
    const std::size_t first = bin_of(float(yaw - max_turn)), allowed = std::size_t(2 * max_turn * bins) + 2;
    for (std::size_t b = 0; b < bins; ++b) {
      count += changes_[b];
      if (count > most && (all || (b + bins - first) % bins < allowed)) most = count, best.yaw = b;
    }
    best.votes = std::size_t(most);
    return best;
  }

  /// The pairs of rays that ask for a yaw, each source stem once.
  std::vector<correspondence> pairs_at(std::size_t yaw, std::span<const star_ray> source,
                                       std::span<const star_ray> target) const {
    std::vector<correspondence> pairs;
    for_each_pair(
        source, target, [&](const star_ray& s, const star_ray& t, std::size_t first, std::size_t last) {
          const bool asks = first <= last ? first <= yaw && yaw <= last : yaw >= first || yaw <= last;
          if (asks && (pairs.empty() || pairs.back().source != s.to)) pairs.push_back({s.to, t.to});
        });
    return pairs;
  }

 private:
  static constexpr std::size_t bins = 512;

  /// Calls `visit(source ray, target ray, first bin, last bin)` for those about as long.
  template <class Visit>
  void for_each_pair(std::span<const star_ray> source, std::span<const star_ray> target,
                     const Visit& visit) const {
    std::size_t begin = 0;
    for (const star_ray& s : source) {
      while (begin < target.size() && target[begin].distance <= s.distance - tolerance_) ++begin;
      const float off =
          std::min(0.25f, tolerance_ / (float(2 * std::numbers::pi) * std::max(s.distance, tolerance_)));
      for (std::size_t k = begin; k < target.size() && target[k].distance < s.distance + tolerance_; ++k) {
        const float yaw = target[k].direction - s.direction;
        visit(s, target[k], bin_of(yaw - off), bin_of(yaw + off));
      }
    }
  }
  static std::size_t bin_of(float turns) {
    return static_cast<std::size_t>(static_cast<std::int64_t>((turns + 4) * float(bins))) % bins;
  }

  float tolerance_;  // [m]
  std::int16_t changes_[bins + 2] = {};
};

/// Distinct hypotheses at a threshold [m], verified over all stems and scored, best first: of each source
/// stem those target stems are tried on which enough other stems can be placed that it may be significant at
/// one of the `significant_at` thresholds [m]. The rest as in `match_by_index`. Cost: the product of the
/// stems of both maps, times those of like distance.
inline std::vector<local_hypothesis> match_by_stars(const matching_context& context,
                                                    std::span<const std::vector<star_ray>> target_stars,
                                                    double inlier_threshold, const null_model& null,
                                                    std::span<const double> significant_at,
                                                    std::span<const double> thresholds,
                                                    matching_funnel& funnel) {
  constexpr std::size_t stems_for_alternatives = 5, best_of_stem = 8;
  const std::size_t min_votes = null.min_pairs(significant_at) - 1;  // but itself
  const auto is_promising = [&](const rigid& transform, const vec3& center, double radius) {
    return !null.explains_around(transform, center, radius, inlier_threshold);
  };
  constexpr double per_turn = 2 * std::numbers::pi;
  const double yaw = context.prior ? context.prior->yaw() / per_turn : 0,
               max_turn = context.prior ? context.prior->max_turn() / per_turn : 0.5;
  star_votes votes(inlier_threshold);
  std::vector<local_hypothesis> hypotheses;
  std::size_t stems = 0;
  bool found = false;
  for (const stem_index i : shuffled_stems(context.source.size())) {
    if (found && stems >= stems_for_alternatives) break;
    report_progress(context.exec, "matching", double(stems) / double(context.source.size()));
    ++stems;
    const std::vector<star_ray> star = star_of(context.source, i);
    std::vector<keyed> order;
    std::vector<star_peak> peaks;
    for (stem_index k = 0; k < target_stars.size(); ++k) {
      if (context.prior && !context.prior->may_place(context.source.at[i], context.target.at[k])) continue;
      star_peak peak = votes.peak(star, target_stars[k], yaw, max_turn);
      if (peak.votes < min_votes) continue;
      peak.target = k;
      order.push_back({~std::uint64_t(peak.votes), peaks.size()});
      peaks.push_back(peak);
    }
    keep_first(order, std::min(best_of_stem, order.size()));
    for (const keyed& next : order) {
      const star_peak& peak = peaks[next.value];
      if (found && 2 * peak.votes < peaks[order.front().value].votes) break;  // no alternative
      std::vector<correspondence> pairs = votes.pairs_at(peak.yaw, star, target_stars[peak.target]);
      pairs.push_back({i, peak.target});
      ++funnel.tested;
      funnel.local_pairs += pairs.size();
      auto h = verify(context, pairs, inlier_threshold, is_promising);
      if (!h) continue;
      score_hypothesis(*h, context, null, thresholds);
      found = found || h->log10_nfa < sufficient_log10_nfa;
      add_distinct(std::move(*h), hypotheses, context);
      if (hypotheses.size() == 2 * max_hypotheses) keep_best(hypotheses, max_hypotheses);
    }
  }
  funnel.source_triangles += stems;
  funnel.target_triangles = context.target.size();
  keep_best(hypotheses, max_hypotheses);
  return hypotheses;
}

}  // namespace globalmatch::detail
