// 4-points congruent sets (Aiger, Mitra, Cohen-Or 2008, "4-points congruent sets for robust pairwise surface
// registration", ACM TOG 27(3)) on stems in plan, where any four are coplanar. Theirs: a wide base of four
// source points; the ratios at which its two lines intersect, which no transform changes; all pairs of target
// points as far apart as those of the base; two of these are a congruent set where they intersect at those
// ratios in one place; the transform of each is tried on all points; many bases, the best transform wins.
//
// Ours: the base is drawn within half the extent of the map, as a wide one is in both maps more seldom, and
// within all of it where such ones bring no six stems together, or less than the share sought; all six
// distances of a congruent set must be those of the base; the number of bases is that of RANSAC for the share
// of stems that agree so far; the least squares over all agreeing stems in the end. Radii are not used. Cost:
// quadratic in the target stems, and for each base the pairs of its two lengths.
#pragma once

#include <globalmatch/detail/core/random.hpp>
#include <globalmatch/detail/core/wrapped_grid.hpp>

#include "baselines/stem_alignment.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace globalmatch::benchmarks {

struct congruent_set_options {
  double extent_share = 0.5;       ///< of the source map's extent, that a base is within
  double min_share = 0.3;          ///< of the source stems that is in both maps, at least
  double confidence = 0.99;        ///< that one of the bases is in both
  std::size_t max_draws = 10000;   ///< of bases, as not all four stems make one
  double max_extrapolation = 0.5;  ///< of a line beyond its two points, to the intersection
};

/// Four stems a, b, c, d, and where lines ab and cd intersect: a + r1 (b - a) = c + r2 (d - c).
struct four_stems {
  std::array<stem_index, 4> stems;
  double r1 = 0, r2 = 0;
};

inline vec2 between(const vec2& a, const vec2& b, double ratio) {
  return a + ratio * (b - a);
}

/// How far the intersection is from the middle of a line, in lengths of it, for the worse of both lines.
inline double off_middle(const four_stems& base) {
  return std::max(std::abs(base.r1 - 0.5), std::abs(base.r2 - 0.5));
}

/// Of the three ways to pair four stems that whose lines intersect most nearly in the middle of both. Nothing
/// where they intersect further out, or nearly along each other.
inline std::optional<four_stems> intersect(const position_set& source, const std::array<stem_index, 4>& stems,
                                           double min_distance, double max_extrapolation) {
  std::optional<four_stems> best;
  for (const auto& order : {std::array<std::size_t, 4>{0, 1, 2, 3}, {0, 2, 1, 3}, {0, 3, 1, 2}}) {
    four_stems base;
    for (std::size_t i = 0; i < 4; ++i) base.stems[i] = stems[order[i]];
    const auto at = [&](std::size_t i) { return source.at[base.stems[i]].xy(); };
    const vec2 u = at(1) - at(0), v = at(3) - at(2), w = at(2) - at(0);
    const double cross = u.x * v.y - u.y * v.x;
    if (std::abs(cross) <= min_distance * std::max(u.norm(), v.norm())) continue;
    base.r1 = (w.x * v.y - w.y * v.x) / cross;
    base.r2 = (w.x * u.y - w.y * u.x) / cross;
    if (off_middle(base) <= 0.5 + max_extrapolation && (!best || off_middle(base) < off_middle(*best)))
      best = base;
  }
  return best;
}

/// All ordered pairs of target stems by their distance.
class stem_pairs_by_length {
 public:
  explicit stem_pairs_by_length(const position_set& stems) {
    for (stem_index i = 0; i < stems.size(); ++i) {
      poll_cancelled();
      for (stem_index j = 0; j < stems.size(); ++j)
        if (i != j) pairs_.push_back({(stems.at[i] - stems.at[j]).xy().norm(), i, j});
    }
    std::sort(pairs_.begin(), pairs_.end(), [](const pair& a, const pair& b) { return a.length < b.length; });
  }

  struct pair {
    double length;
    stem_index first, second;
  };

  /// Those within `threshold` of a length [m].
  std::span<const pair> of_length(double length, double threshold) const {
    const auto less = [](const pair& a, double b) { return a.length < b; };
    const auto begin = std::lower_bound(pairs_.begin(), pairs_.end(), length - threshold, less);
    return {begin, std::lower_bound(begin, pairs_.end(), length + threshold, less)};
  }

 private:
  std::vector<pair> pairs_;
};

/// Bases of source stems, and the sets of target stems that are congruent to them.
class congruent_sets {
 public:
  congruent_sets(const stem_alignment& maps, const congruent_set_options& options)
      : maps_(maps), options_(options), pairs_(maps.target), max_distance_(extent() * options.extent_share) {}

  /// A base anywhere; nothing where the four stems drawn make none.
  std::optional<four_stems> draw_base(random_source& random) const {
    const auto any = [&] { return random.below(static_cast<std::uint32_t>(maps_.source.size())); };
    constexpr int max_draws = 20;  // of each further stem
    std::array<stem_index, 4> stems = {any(), 0, 0, 0};
    const auto taken = stems.begin();
    for (std::size_t i = 1; i < 4; ++i) {
      bool found = false;
      for (int k = 0; k < max_draws && !found; ++k) {
        stems[i] = any();
        const auto end = taken + std::ptrdiff_t(i);
        found = std::find(taken, end, stems[i]) == end && std::all_of(taken, end, [&](stem_index s) {
                  return distance(maps_.source, s, stems[i]) <= max_distance_;
                });
      }
      if (!found) return std::nullopt;
    }
    return intersect(maps_.source, stems, maps_.inlier_threshold, options_.max_extrapolation);
  }

  /// Calls `visit(correspondences)` for each congruent set.
  template <class Visit>
  void for_each(const four_stems& base, const Visit& visit) const {
    const double threshold = maps_.inlier_threshold;
    const auto& from = base.stems;
    const auto ab = pairs_.of_length(distance(maps_.source, from[0], from[1]), threshold);
    const auto cd = pairs_.of_length(distance(maps_.source, from[2], from[3]), threshold);
    const auto intersection = [&](const stem_pairs_by_length::pair& p, double ratio) {
      return between(maps_.target.at[p.first].xy(), maps_.target.at[p.second].xy(), ratio);
    };
    using grid = wrapped_grid<double, 2>;
    const double error = 2 * (1 + options_.max_extrapolation) * threshold;  // of where lines intersect
    const grid intersections(ab.size(), error, [&](std::size_t i) {
      const vec2 at = intersection(ab[i], base.r1);
      return grid::item{{at.x, at.y}, static_cast<std::uint32_t>(i)};
    });
    for (const auto& other : cd) {
      poll_cancelled();
      const vec2 at = intersection(other, base.r2);
      intersections.for_each_near({at.x, at.y}, error, [&](const grid::item& i) {
        const auto& one = ab[i.label];
        const std::array<stem_index, 4> to = {one.first, one.second, other.first, other.second};
        if (is_congruent(from, to))
          visit(std::array<correspondence, 4>{
              {{from[0], to[0]}, {from[1], to[1]}, {from[2], to[2]}, {from[3], to[3]}}});
      });
    }
  }

 private:
  static double distance(const position_set& stems, stem_index i, stem_index j) {
    return (stems.at[i] - stems.at[j]).xy().norm();
  }

  /// The largest distance [m] between source stems.
  double extent() const {
    double largest = 0;
    for (stem_index i = 0; i < maps_.source.size(); ++i) {
      poll_cancelled();
      for (stem_index j = 0; j < i; ++j) largest = std::max(largest, distance(maps_.source, i, j));
    }
    return largest;
  }

  bool is_congruent(const std::array<stem_index, 4>& base, const std::array<stem_index, 4>& like) const {
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t j = i + 1; j < 4; ++j)
        if (like[i] == like[j] ||
            std::abs(distance(maps_.source, base[i], base[j]) - distance(maps_.target, like[i], like[j])) >=
                maps_.inlier_threshold)
          return false;
    return true;
  }

  const stem_alignment& maps_;
  congruent_set_options options_;
  stem_pairs_by_length pairs_;
  double max_distance_;
};

/// Bases until one is in both maps with the `confidence` asked for, if `share` of the stems are.
inline double bases_needed(double share, double confidence) {
  return std::log(1 - confidence) / std::log1p(-std::pow(std::min(share, 0.999), 4));
}

/// Improves `best` by bases within a share of the extent.
inline void search_bases(const stem_alignment& maps, const congruent_set_options& options,
                         matching_funnel& funnel, scored_transform& best) {
  const congruent_sets sets(maps, options);
  random_source random(0);
  double share = options.min_share;
  std::size_t bases = 0;
  for (std::size_t draws = 0; draws < options.max_draws; ++draws) {
    if (double(bases) >= bases_needed(share, options.confidence)) break;
    const auto base = sets.draw_base(random);
    if (!base) continue;
    ++bases;
    sets.for_each(*base, [&](const auto& pairs) {
      ++funnel.local_pairs;
      maps.keep_better(pairs, best);
    });
    share = std::max(share, double(best.agreeing) / double(maps.source.size()));
  }
  funnel.source_triangles += bases;
}

/// The transform of a congruent set on which most stems agree, of several the first.
inline scored_transform best_congruent_set(const stem_alignment& maps, matching_funnel& funnel,
                                           congruent_set_options options = {}) {
  constexpr double min_agreeing = 6;
  scored_transform best;
  if (std::min(maps.source.size(), maps.target.size()) < 4) return best;
  search_bases(maps, options, funnel, best);
  if (double(best.agreeing) < std::max(min_agreeing, options.min_share * double(maps.source.size())) &&
      options.extent_share < 1) {
    options.extent_share = 1;
    search_bases(maps, options, funnel, best);
  }
  funnel.tested = funnel.local_pairs;
  return best;
}

inline match_run run_congruent_sets(const two_maps& maps, const run_limits& limits, double inlier_threshold) {
  const double n = double(maps.target.size());
  return run_within(limits, n * n * sizeof(stem_pairs_by_length::pair), [&](const execution&) {
    const stem_alignment alignment(maps, inlier_threshold);
    match_run run{.funnel = alignment.funnel()};
    run.target_from_source = alignment.refined(best_congruent_set(alignment, run.funnel));
    return run;
  });
}

}  // namespace globalmatch::benchmarks
