// Scale: are the distances in one map longer than in the other one? In: a hypothesis. Out: the factor by
// which the source must be multiplied to fit best, in plan, and how well it is known.
#pragma once

#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "globalmatch/detail/core/rigid.hpp"
#include "globalmatch/detail/core/small_solver.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/detail/matching/matching_context.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::detail {

/// Least squares similarity transform of places onto those they are paired with: two numbers of shift, the
/// turn and the scale (Umeyama 1991, IEEE Trans. Pattern Anal. Mach. Intell. 13(4)). Drift of a mobile
/// scanner differs from 1 as a map projection does. Nothing for fewer than four pairs. Cost: linear in the
/// pairs.
inline std::optional<scale_estimate> fit_scale(std::span<const vec2> from, std::span<const vec2> to) {
  constexpr std::size_t minimum = 4;
  constexpr double min_radius = 1e-3;    // [m] of stems that are not at one place
  constexpr double min_residual = 1e-4;  // [m] no position is known better
  // Of scans of one plot the scale is up to four standard deviations off, and explains less than a twentieth
  // of the variance of the residuals: stems are seen from one side.
  constexpr double min_sigmas = 6, min_explained = 1.05;
  const std::size_t size = from.size();
  if (size < minimum) return std::nullopt;
  vec2 from_mean = {}, to_mean = {};
  for (std::size_t i = 0; i < size; ++i) {
    from_mean += from[i] / double(size);
    to_mean += to[i] / double(size);
  }
  double squares = 0, along = 0, across = 0, of_target = 0;
  for (std::size_t i = 0; i < size; ++i) {
    const vec2 u = from[i] - from_mean, v = to[i] - to_mean;
    squares += u.squared_norm();
    of_target += v.squared_norm();
    along += u.dot(v);
    across += u.x * v.y - u.y * v.x;
  }
  if (!(squares > min_radius * min_radius * double(size))) return std::nullopt;
  const double length = std::hypot(along, across), factor = length / squares;
  const double rounding = min_residual * min_residual * double(size),
               with = std::max(rounding, of_target - length * factor),
               without = std::max(rounding, of_target - 2 * length + squares);
  const double freedom = 2 * double(size) - 4;
  scale_estimate fitted{factor, std::sqrt(with / freedom / squares)};
  fitted.differs = std::abs(factor - 1) > min_sigmas * fitted.sigma &&
                   without / (freedom + 1) > min_explained * with / freedom;
  return fitted;
}

/// The same of the transformed source stems of a hypothesis, in plan.
inline std::optional<scale_estimate> fit_scale(const local_hypothesis& h, const matching_context& context) {
  std::vector<vec2> from, to;
  for (const correspondence& c : h.correspondences) {
    from.push_back((h.target_from_source * context.source.at[c.source]).xy());
    to.push_back(context.target.at[c.target].xy());
  }
  return fit_scale(from, to);
}

/// Root mean square distance [m] of paired source stems from their centroid, in plan.
inline double radius_of_pairs(const local_hypothesis& h, const position_set& source) {
  vec2 mean = {};
  double squares = 0;
  for (const correspondence& c : h.correspondences)
    mean += source.at[c.source].xy() / double(h.correspondences.size());
  for (const correspondence& c : h.correspondences)
    squares += (source.at[c.source].xy() - mean).squared_norm() / double(h.correspondences.size());
  return std::sqrt(squares);
}

/// Adds to a covariance what the scale says of the maps: one that is distorted by so much along the radius
/// may as well be across it, and its stems place it no better.
inline void add_distortion(small_matrix& covariance, const scale_estimate& scale, double radius) {
  if (!scale.differs) return;
  const double distortion = (scale.factor - 1) * (scale.factor - 1);
  covariance(0, 0) += distortion * radius * radius;
  covariance(1, 1) += distortion * radius * radius;
  covariance(covariance.size - 1, covariance.size - 1) += distortion;
}

/// Positions of which all coordinates are multiplied by a factor.
inline position_set scaled(position_set stems, double factor) {
  stems.frame.origin = factor * stems.frame.origin;
  for (vec3& p : stems.at) p = factor * p;
  stems.cell_area *= factor * factor;
  return stems;
}

}  // namespace globalmatch::detail
