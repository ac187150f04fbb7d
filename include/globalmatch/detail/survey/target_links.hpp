// Links of a survey by targets. In: targets that maps show. Out: a link of each two maps that have enough in
// common whose distances agree.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include "globalmatch/detail/core/keyed_sort.hpp"
#include "globalmatch/detail/core/matrices.hpp"
#include "globalmatch/detail/core/rigid_fit.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/detail/survey/plan_pose.hpp"
#include "globalmatch/detail/survey/survey_link.hpp"
#include "globalmatch/detail/survey/survey_targets.hpp"

namespace globalmatch::detail {

/// A target that two maps show.
struct shared_target {
  std::uint64_t maps;         ///< key of both, the one of the lower number first
  correspondence numbers;     ///< in the options
  vec3 in_source, in_target;  ///< [m] in the first map and in the second one
  double variance;            ///< [m^2] along each axis, of both together
};

/// Standard deviations by which what targets say may differ.
inline constexpr double target_deviations = 4;

/// Whether two targets are as far from each other in both maps. Distances in space: these do not change where
/// maps lean.
inline bool has_same_distance(const shared_target& a, const shared_target& b) {
  const double off = (a.in_source - b.in_source).norm() - (a.in_target - b.in_target).norm();
  return off * off < target_deviations * target_deviations * (a.variance + b.variance);
}

/// The targets left once those are taken away, one after the other, that disagree with most others; none
/// where these are not more than half.
inline std::vector<shared_target> agreeing_targets(std::span<const shared_target> shared) {
  std::vector<shared_target> left(shared.begin(), shared.end());
  while (2 * left.size() > shared.size()) {
    std::size_t worst = 0, most = 0;
    for (std::size_t i = 0; i < left.size(); ++i) {
      const auto disagreeing = std::size_t(std::count_if(
          left.begin(), left.end(), [&](const auto& other) { return !has_same_distance(left[i], other); }));
      if (disagreeing > most) worst = i, most = disagreeing;
    }
    if (most == 0) return left;
    left.erase(left.begin() + std::ptrdiff_t(worst));
  }
  return {};
}

/// log10 of the sets of so many targets, of those in common, that are expected to agree as well where scans
/// number targets of their own: by their distances in plan, of which two a target and one less than three in
/// all are free.
inline double log10_nfa_of(std::span<const shared_target> agreeing, std::size_t in_common) {
  double largest = 0, variance = 0;
  for (const shared_target& a : agreeing) {
    variance = std::max(variance, a.variance);
    for (const shared_target& b : agreeing)
      largest = std::max(largest, (a.in_target.xy() - b.in_target.xy()).norm());
  }
  const auto chosen = double(agreeing.size()), all = double(in_common);
  const double log_sets = std::lgamma(all + 1) - std::lgamma(chosen + 1) - std::lgamma(all - chosen + 1);
  const double agrees = std::min(1.0, 2 * target_deviations * std::sqrt(2 * variance) / largest);
  return log_sets / std::numbers::ln10 + (2 * chosen - 3) * std::log10(agrees);
}

/// The link of two maps by targets that agree, of those in common; nothing where these do not determine it,
/// or do not fit.
inline std::optional<survey_link> link_by(std::span<const shared_target> agreeing, std::size_t in_common) {
  constexpr double max_lean = 0.01, max_yaw_sigma = 0.02;  // [rad]
  std::vector<vec3> from, to;
  std::vector<double> weights;
  vec3 center;
  double total = 0;
  for (const shared_target& t : agreeing) {
    from.push_back(t.in_source);
    to.push_back(t.in_target);
    weights.push_back(1 / t.variance);
    center += t.in_target / t.variance;
    total += 1 / t.variance;
  }
  if (agreeing.size() < 2) return std::nullopt;
  center /= total;
  const auto transform = fit_rigid(from, to, degrees_of_freedom::four, weights);
  if (!transform) return std::nullopt;
  survey_link link;
  double squares = 0, of_yaw = 0;
  for (const shared_target& t : agreeing) {
    const vec3 arm = t.in_target - center;
    const double off = (*transform * t.in_source - t.in_target).xy().norm();
    const double tolerance = target_deviations * std::sqrt(t.variance) + max_lean * std::abs(arm.z);
    if (off > tolerance) return std::nullopt;
    squares += off * off / double(agreeing.size());
    of_yaw += arm.xy().squared_norm() / t.variance;
    link.targets.push_back(t.numbers);
  }
  if (!(of_yaw * max_yaw_sigma * max_yaw_sigma > 1)) return std::nullopt;
  link.source = first_of(agreeing[0].maps);
  link.target = second_of(agreeing[0].maps);
  link.target_from_source = plan_of(*transform);
  link.target_raise = transform->translation.z;
  link.center = center.xy();
  link.covariance =
      mat3::diagonal_of({1 / total, 1 / total, 1 / of_yaw + shared_yaw_sigma * shared_yaw_sigma});
  link.rms = std::sqrt(squares);
  link.log10_nfa = log10_nfa_of(agreeing, in_common);
  return link;
}

/// The links of all pairs of maps that targets link, ordered by their maps: of two targets or more at
/// distances that agree; of three or more that agree but for some, less than half, these are left out.
inline std::vector<survey_link> links_by_targets(const target_observations& targets) {
  std::vector<shared_target> shared;
  for (std::uint32_t t = 0; t < targets.size(); ++t)
    for (const target_of_map& source : targets.of(t))
      for (const target_of_map& target : targets.of(t))
        if (source.map < target.map)
          shared.push_back({key_of(source.map, target.map),
                            {source.given, target.given},
                            source.at,
                            target.at,
                            source.sigma * source.sigma + target.sigma * target.sigma});
  std::stable_sort(shared.begin(), shared.end(),
                   [](const auto& a, const auto& b) { return a.maps < b.maps; });
  std::vector<survey_link> links;
  for (std::size_t begin = 0, end = 0; begin < shared.size(); begin = end) {
    while (end < shared.size() && shared[end].maps == shared[begin].maps) ++end;
    const std::size_t in_common = end - begin;
    if (auto link = link_by(agreeing_targets(std::span(shared).subspan(begin, in_common)), in_common))
      links.push_back(std::move(*link));
  }
  return links;
}

}  // namespace globalmatch::detail
