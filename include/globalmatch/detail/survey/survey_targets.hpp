// Targets of a survey, as its maps show them. In: what the options say. Out: observations target by target,
// in levelled local frames.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/rigid.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "globalmatch/detail/survey/adjust_links.hpp"
#include "globalmatch/detail/survey/survey_trees.hpp"
#include "globalmatch/survey_options.hpp"

namespace globalmatch::detail {

/// A target as a map shows it.
struct target_of_map {
  std::uint32_t map = 0;
  vec3 at;                  ///< [m] in the levelled local frame
  double sigma = 0;         ///< [m] along each axis
  std::uint32_t given = 0;  ///< its number among those of the options
};

/// Targets as lists of the maps that show them, in one flat array.
struct target_observations {
  std::vector<target_of_map> seen;       ///< target by target, by map
  std::vector<std::size_t> first = {0};  ///< of each target; one more than targets
  std::size_t size() const { return first.size() - 1; }
  std::span<const target_of_map> of(std::size_t target) const {
    return std::span(seen).subspan(first[target], first[target + 1] - first[target]);
  }
};

/// The targets of the options by their names, whatever the order in which they are given.
inline target_observations find_targets(std::span<const survey_options::target> given,
                                        std::span<const prepared_stems> maps) {
  constexpr double min_sigma = 1e-4;  // [m] that rounding and leans leave
  std::vector<std::uint32_t> order(given.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return given[a].name != given[b].name ? given[a].name < given[b].name : given[a].scan < given[b].scan;
  });
  target_observations targets;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const survey_options::target& t = given[order[i]];
    if (i > 0 && given[order[i - 1]].name != t.name) targets.first.push_back(i);
    const rigid local_from_scan = maps[t.scan].stems.frame.local_from_scan();
    targets.seen.push_back({std::uint32_t(t.scan), local_from_scan * from_eigen(t.position),
                            std::max(min_sigma, t.sigma), order[i]});
  }
  if (!order.empty()) targets.first.push_back(order.size());
  return targets;
}

/// The same, those that maps of several components show once for each. `part_of`: the component of each map.
inline target_observations targets_of_components(const target_observations& all,
                                                 std::span<const std::uint32_t> part_of) {
  target_observations apart;
  for (std::size_t t = 0; t < all.size(); ++t) {
    std::vector<target_of_map> seen(all.of(t).begin(), all.of(t).end());
    std::stable_sort(seen.begin(), seen.end(), [&](const target_of_map& a, const target_of_map& b) {
      return part_of[a.map] < part_of[b.map];
    });
    for (std::size_t i = 0; i < seen.size(); ++i) {
      if (i > 0 && part_of[seen[i - 1].map] != part_of[seen[i].map]) apart.first.push_back(apart.seen.size());
      apart.seen.push_back(seen[i]);
    }
    apart.first.push_back(apart.seen.size());
  }
  return apart;
}

/// The pairs of unknowns that have trees or targets in common.
inline std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs_of_landmarks(
    const tree_observations& trees, const target_observations& targets, const unknown_poses& unknowns) {
  auto pairs = pairs_of_maps(trees, unknowns);
  for (std::size_t t = 0; t < targets.size(); ++t) {
    const auto seen = targets.of(t);
    for (std::size_t i = 0; i < seen.size(); ++i)
      for (std::size_t k = 0; k < i; ++k)
        if (const std::uint32_t a = unknowns.of[seen[i].map], b = unknowns.of[seen[k].map];
            a != unknown_poses::fixed && b != unknown_poses::fixed)
          pairs.emplace_back(a, b);
  }
  return pairs;
}

/// Standard deviations of targets in the iterations of an adjustment. At first they are as wide as poses by
/// stems alone may be off, so that it is the targets that disagree with most others that lose their weight,
/// and not all (graduated non-convexity: Black and Rangarajan 1996, Int. J. Computer Vision 19(1)). What they
/// count is ahead of what they may be off by: poses follow them before any loses its weight.
class narrowing_sigmas {
 public:
  explicit narrowing_sigmas(const target_observations& targets) {
    for (const target_of_map& t : targets.seen) least_ = std::min(least_, t.sigma);
    if (targets.seen.empty()) least_ = width_ = 0;
  }
  /// By which a target counts, in place of its own.
  double operator()(double sigma) const { return std::max(sigma, width_ / ahead); }
  /// Squared residuals [standard deviations^2] are to be multiplied by.
  double leniency(double sigma) const {
    const double share = (*this)(sigma) / std::max(sigma, width_);
    return share * share;
  }
  bool are_final() const { return width_ <= least_; }
  void narrow() { width_ /= 2; }
  /// Iterations until they are final.
  int steps() const { return are_final() ? 0 : int(std::ceil(std::log2(width_ / least_))); }

 private:
  static constexpr double ahead = 4;
  double width_ = 0.5, least_ = 0.5;  // [m]
};

}  // namespace globalmatch::detail
