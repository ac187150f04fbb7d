// Verification: a transform that some pairs agree on, tried on all stems.
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "globalmatch/detail/core/rigid.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/detail/matching/matching_context.hpp"

namespace globalmatch::detail {

/// Drops the correspondence that fits worst until all lie within `inlier_threshold` [m] of each other.
inline std::vector<correspondence> drop_outliers(const matching_context& context,
                                                 std::span<const correspondence> start,
                                                 double inlier_threshold) {
  std::vector<correspondence> pairs(start.begin(), start.end());
  while (const auto transform = context.fit(pairs)) {
    poll_cancelled();
    std::size_t worst = 0;
    double largest = 0;
    for (std::size_t i = 0; i < pairs.size(); ++i)
      if (const double residual = context.residual(*transform, pairs[i]); i == 0 || largest < residual)
        largest = residual, worst = i;
    if (largest < inlier_threshold) break;
    pairs.erase(pairs.begin() + std::ptrdiff_t(worst));
  }
  return pairs;
}

/// How far [m] apart two transforms place what is within `radius` of `center`, at most.
inline double displacement(const rigid& a, const rigid& b, const vec3& center, double radius) {
  const double turn = rotation_angle(transpose_times(a.rotation, b.rotation));
  return (a * center - b * center).norm() + turn * radius;
}

/// A question to whoever has a hypothesis verified, see `verify`.
struct promise_check {
  const void* of;
  bool (*call)(const void* of, const rigid& target_from_source, const vec3& center, double radius);
};

inline std::optional<local_hypothesis> verify(const matching_context& context,
                                              std::span<const correspondence> start, double inlier_threshold,
                                              const promise_check& is_promising) {
  constexpr int max_iterations = 20, max_interim_iterations = 3;
  constexpr double relative_convergence_threshold = 0.01;  // of the inlier threshold
  std::vector<correspondence> pairs = drop_outliers(context, start, inlier_threshold);
  if (pairs.empty()) return std::nullopt;
  vec3 center;
  for (const correspondence& c : pairs) center += context.source.at[c.source] / double(pairs.size());
  const auto distance = [&](const vec3& p) { return (p - center).xy().norm(); };
  double started = 0, whole = 0;
  for (const correspondence& c : pairs) started = std::max(started, distance(context.source.at[c.source]));
  for (const vec3& p : context.source.at) whole = std::max(whole, distance(p));

  local_hypothesis h;
  h.inlier_threshold = inlier_threshold;
  for (double radius = std::max(2 * started, 20 * inlier_threshold);; radius *= 2) {
    const bool last = radius >= whole;
    const double pairing_radius = last ? std::numeric_limits<double>::infinity() : radius;
    for (int iteration = 0; iteration < (last ? max_iterations : max_interim_iterations); ++iteration) {
      const auto transform = context.fit(pairs);
      if (!transform) return std::nullopt;
      const bool converged = displacement(*transform, h.target_from_source, center, std::min(radius, whole)) <
                             relative_convergence_threshold * inlier_threshold;
      h.target_from_source = *transform;
      h.correspondences = context.pair_stems(*transform, inlier_threshold, center, pairing_radius);
      if (converged || h.correspondences == pairs) break;
      pairs = h.correspondences;
    }
    if (last) break;
    if (!is_promising.call(is_promising.of, h.target_from_source, center, radius)) return std::nullopt;
    pairs = h.correspondences;
  }
  if (h.correspondences.size() < 3) return std::nullopt;
  h.rms = context.rms(h.target_from_source, h.correspondences);
  return h;
}

/// Pairs all stems under the transform that most of `start` agree on, and refits it until convergence. A
/// transform from a few stems is only good near them: pairing begins there and grows outwards, as long as
/// `is_promising(target_from_source, center, radius)`. Nothing when it is not, or when fewer than three pairs
/// are left.
template <class IsPromising>
std::optional<local_hypothesis> verify(const matching_context& context, std::span<const correspondence> start,
                                       double inlier_threshold, const IsPromising& is_promising) {
  return verify(
      context, start, inlier_threshold,
      promise_check{std::addressof(is_promising),
                    [](const void* of, const rigid& transform, const vec3& center, double radius) {
                      return bool((*static_cast<const IsPromising*>(of))(transform, center, radius));
                    }});
}

/// The same for hypotheses that are promising whatever they look like around the start.
inline std::optional<local_hypothesis> verify(const matching_context& context,
                                              std::span<const correspondence> start,
                                              double inlier_threshold) {
  return verify(context, start, inlier_threshold,
                promise_check{nullptr, [](const void*, const rigid&, const vec3&, double) { return true; }});
}

}  // namespace globalmatch::detail
