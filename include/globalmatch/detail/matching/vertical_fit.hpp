// Vertical fit: what the heights of the stems that match in plan say. In: a hypothesis fitted in plan. Out:
// its transform with a height, or rotated, and how far the height is to be trusted. Ours.
//
// Heights differ by a constant where both scans are level. Where they differ by a plane either one scan is
// rotated against the other, or heights are wrong: they drift, or the ground was hidden. Heights cannot tell;
// a rotation also moves stems in plan, where the ground has relief, and turns the axes of the stems.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/detail/matching/matching_context.hpp"
#include "globalmatch/detail/matching/robust_fit.hpp"
#include "globalmatch/detail/matching/t_estimates.hpp"
#include "globalmatch/detail/matching/vertical_observations.hpp"
#include "globalmatch/matching.hpp"

namespace globalmatch::detail {

/// Turns `transform` about `center` by a rotation vector [rad].
inline rigid turned(const rigid& transform, const vec3& turn, const vec3& center) {
  const double angle = turn.norm();
  if (!(angle > 0)) return transform;
  const rigid rotation{rotation_about(turn.normalized(), angle), {}};
  return shifted_before(shifted_after(rotation, center), -center) * transform;
}

/// Scales of residuals are not estimated smaller than this: [m] of positions, [rad] of axes.
inline constexpr double min_vertical_scale = 1e-4;
inline constexpr std::size_t vertical_unknowns = 6;
/// [m] Where shrubs hide the ground heights are off by decimetres; trees differ by metres.
inline constexpr double max_height_spread = 1;
/// Of the variance that stems know of their heights, what they have in common: the ground between them is
/// interpolated from the same points.
inline constexpr double shared_share = 0.1;

template <std::size_t Count>
t_estimate estimate_small_transform(observation_kind (&&kinds)[Count]) {
  return estimate_by_t(kinds, vertical_unknowns, min_vertical_scale);
}

/// The vertical fit of a hypothesis in the levelled local frames.
struct local_vertical_fit {
  vertical_fit fit;
  std::optional<small_matrix> covariance;  ///< of all six unknowns about `center`, where it is rotated
  vec3 center;                             ///< [m]
};

/// Decides between level, rotated and sloping, see `fit_vertical`.
class vertical_decision {
 public:
  vertical_decision(const matching_context& context, const local_hypothesis& h)
      : observations_(context, h.correspondences),
        transform_(h.target_from_source),
        center_(observations_.center(transform_)),
        level_(heights(transform_, false)),
        sloped_(heights(transform_, true)) {}

  const vec3& center() const { return center_; }
  const t_estimate& level() const { return level_; }
  const t_estimate& sloped() const { return sloped_; }
  /// [m^2] that the stems say their heights have; does not average out
  double shared_variance() const { return observations_.known_height_variance(); }
  /// [m] of the heights, less their plane if there is one
  double spread() const { return std::min(level_.scale, sloped_.scale); }

  /// [m^2] of the plane by which the heights differ, at the stems
  double plane_variance() const {
    return observations_.plane_variance(transform_, center_, sloped_.parameters[3], sloped_.parameters[4]);
  }

  /// Whether the heights differ by a plane beyond doubt.
  bool differ_by_plane() const { return sloped_.log_likelihood - level_.log_likelihood > required_gain(); }

  /// Whether they do by more than what they have in common: heights that the same ground was interpolated for
  /// err alike, by planes among others.
  bool is_sloping() const { return differ_by_plane() && plane_variance() > shared_share * shared_variance(); }

  /// The rotation vector [rad] that residuals in plan and axes ask for beyond doubt, and heights do not
  /// contradict; of those that the heights' plane and the axes propose.
  std::optional<vec3> rotation() const {
    const double unrotated = positions_and_axes(transform_);
    const auto gain_of = [&](const vec3& turn) {
      return turn.norm() > 0 ? positions_and_axes(turned(transform_, turn, center_)) - unrotated : 0;
    };
    // A slope that is certain is one or the other, and was not fitted to what decides between them.
    const vec3 by_heights = turn_of(sloped_), by_axes = turn_of_axes();
    const double gain_by_heights = gain_of(by_heights), gain_by_axes = gain_of(by_axes);
    const bool heights_rotate = gain_by_heights > (is_sloping() ? 0 : required_gain());
    const bool axes_rotate =
        gain_by_axes > required_gain() &&
        heights(turned(transform_, by_axes, center_), false).log_likelihood > level_.log_likelihood;
    if (axes_rotate && gain_by_axes > gain_by_heights) return by_axes;
    if (heights_rotate) return by_heights;
    return std::nullopt;
  }

  /// Rotation vector [rad] of a plane.
  static vec3 turn_of(const t_estimate& e) {
    const vec3 slope{e.parameters[3], e.parameters[4], 0};
    const double length = slope.norm();
    return length > 0 ? std::atan(length) / length * slope : vec3{};
  }

 private:
  /// Logarithm of the likelihood ratio from which on two more parameters are beyond doubt: that of the
  /// Bayesian information criterion (Schwarz 1978), and a factor of a hundred; more for few pairs, which fit
  /// any plane well.
  double required_gain() const {
    constexpr double unknowns = 5;  // three, and two of the scale
    const auto count = double(observations_.size());
    return std::log(100 * count) * count / std::max(1.0, count - unknowns);
  }

  t_estimate heights(const rigid& transform, bool tilts) const {
    return estimate_small_transform({observations_.heights(transform, center_, tilts)});
  }

  /// How likely they are, shifted and turned about the vertical.
  double positions_and_axes(const rigid& transform) const {
    return estimate_small_transform(
               {observations_.positions(transform, center_, false), observations_.axes(transform, false)})
        .log_likelihood;
  }

  vec3 turn_of_axes() const {
    return turn_of(estimate_small_transform({observations_.axes(transform_, true)}));
  }

  vertical_observations observations_;
  rigid transform_;
  vec3 center_;
  t_estimate level_, sloped_;
};

/// What the variance of t estimates is to be multiplied by where their scale is estimated from `count`
/// numbers.
inline double variance_factor(double count, double unknowns) {
  const double degrees = std::max(count - unknowns, 2.5);  // fewer have no variance
  return count / degrees * (degrees / (degrees - 2));
}

/// Refits all six unknowns to positions, heights and axes, and re-pairs the stems, until convergence.
inline local_vertical_fit fit_rotated(local_hypothesis& h, const matching_context& context) {
  constexpr int max_iterations = 10;
  constexpr double convergence_threshold = 1e-5;  // [m], [rad]
  local_vertical_fit result;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    const vertical_observations observations(context, h.correspondences);
    const rigid& transform = h.target_from_source;
    result.center = observations.center(transform);
    const t_estimate step = estimate_small_transform({observations.positions(transform, result.center, true),
                                                      observations.heights(transform, result.center, true),
                                                      observations.axes(transform, true)});
    result.covariance = step.covariance;
    const double factor = variance_factor(double(observations.size()), 3);  // heights: a plane
    for (double& number : result.covariance->numbers) number *= factor;
    const small_vector& by = step.parameters;
    const vec3 shift{by[0], by[1], by[2]}, turn{by[3], by[4], by[5]};
    h.target_from_source = shifted_after(turned(transform, turn, result.center), shift);
    auto pairs = context.pair_stems(h.target_from_source, h.inlier_threshold);
    const bool converged = shift.norm() < convergence_threshold && turn.norm() < convergence_threshold &&
                           pairs == h.correspondences;
    h.correspondences = std::move(pairs);
    if (converged || h.correspondences.size() < min_robust_pairs) break;
  }
  h.rms = context.rms(h.target_from_source, h.correspondences);
  result.fit.kind = vertical_kind::rotated;
  result.fit.source = vertical_source::stems;
  result.fit.sigma = std::sqrt((*result.covariance)(2, 2));
  result.fit.tilt = std::acos(std::clamp(h.target_from_source.rotation(2, 2), -1.0, 1.0));
  return result;
}

/// The hypothesis rotated, where positions in plan or axes ask for it beyond doubt, or where it pairs so many
/// more stems that the rotation is large: of the stems around the center only those still fit in plan. Not
/// where it loses stems, or heights spread as much as before.
inline std::optional<std::pair<local_hypothesis, local_vertical_fit>> try_rotated(
    const vertical_decision& decision, const local_hypothesis& h, const matching_context& context) {
  constexpr double more_pairs = 1.2, min_kept = 0.9;
  const std::optional<vec3> turn = decision.rotation();
  if (!turn && !decision.differ_by_plane()) return std::nullopt;
  local_hypothesis rotated = h;
  rotated.target_from_source = turned(
      h.target_from_source, turn.value_or(vertical_decision::turn_of(decision.sloped())), decision.center());
  local_vertical_fit fit = fit_rotated(rotated, context);
  const auto pairs = double(rotated.correspondences.size());
  if (pairs < (turn ? min_kept : more_pairs) * double(h.correspondences.size())) return std::nullopt;
  if (vertical_decision(context, rotated).spread() > max_height_spread) return std::nullopt;
  return std::pair(std::move(rotated), std::move(fit));
}

/// Variance [m^2] of a height. One that is not known has that of a kilometre, so that the covariance can be
/// inverted.
inline double height_variance(const vertical_fit& fit) {
  constexpr double unknown = 1e3;  // [m]
  return fit.is_known() ? fit.sigma * fit.sigma : unknown * unknown;
}

/// [m^2] of the height of a rotated hypothesis.
inline void set_height_variance(local_vertical_fit& rotated, double variance) {
  (*rotated.covariance)(2, 2) = variance;
  rotated.fit.sigma = std::sqrt(variance);
}

/// The stems know their heights no better than to a metre.
inline void forget_height(local_vertical_fit& result) {
  result.fit.source = vertical_source::none;
  result.fit.sigma = std::numeric_limits<double>::infinity();
  result.fit.reason =
      "the heights of the paired stems are uncertain by more than a metre: not all of them are heights of "
      "the ground (are they heights of the trees?); the height of the transform is a guess";
  if (result.covariance) (*result.covariance)(2, 2) = height_variance(result.fit);
}

/// What the 6-DoF fit of a hypothesis says of its height; `sigma` is what the heights of its stems have in
/// common.
inline local_vertical_fit fit_of_rotated(const local_hypothesis& h, const matching_context& context) {
  const vertical_observations observations(context, h.correspondences);
  local_vertical_fit result;
  result.fit.kind = vertical_kind::rotated;
  result.fit.source = vertical_source::stems;
  result.fit.tilt = std::acos(std::clamp(h.target_from_source.rotation(2, 2), -1.0, 1.0));
  result.fit.sigma = std::sqrt(shared_share * observations.known_height_variance());
  result.center = observations.center(h.target_from_source);
  if (observations.known_height_variance() > max_height_spread * max_height_spread) forget_height(result);
  return result;
}

/// Why the heights of the maps are no heights of the ground; empty where they may be.
inline std::string describe_missing_heights(const matching_context& context, bool ignored) {
  if (ignored) return "heights were ignored; that of the transform is a guess";
  const bool source = context.source.has_heights, target = context.target.has_heights;
  if (source && target) return {};
  return std::string(source   ? "target has"
                     : target ? "source has"
                              : "source and target have") +
         " no heights, or the same one everywhere; the height of the transform is a guess";
}

/// Decides what the heights of the paired stems say, and gives the transform of a 4-DoF hypothesis its
/// height; where a scan is rotated beyond doubt, and the caller leaves it to the data (`may_rotate`), its
/// rotation. Not known are the heights of maps that have none, those that scatter by more than heights of the
/// ground do, and those that the stems themselves know no better; the height of the transform is then a
/// guess, and the reason says why. Cost: linear in the pairs.
inline local_vertical_fit fit_vertical(local_hypothesis& h, const matching_context& context, bool may_rotate,
                                       bool ignores_heights = false) {
  const vertical_decision decision(context, h);
  local_vertical_fit result;
  result.center = decision.center();
  result.fit.sigma = std::numeric_limits<double>::infinity();
  result.fit.reason = describe_missing_heights(context, ignores_heights);
  if (!result.fit.reason.empty()) return result;
  if (may_rotate && h.correspondences.size() >= min_robust_pairs)
    if (auto rotated = try_rotated(decision, h, context)) {
      h = std::move(rotated->first);
      result = std::move(rotated->second);
      const double known = vertical_observations(context, h.correspondences).known_height_variance();
      set_height_variance(result, (*result.covariance)(2, 2) + shared_share * known);
      if (known > max_height_spread * max_height_spread) forget_height(result);
      return result;
    }
  if (decision.spread() > max_height_spread ||
      decision.shared_variance() > max_height_spread * max_height_spread) {
    forget_height(result);
    return result;
  }
  const bool slopes = decision.is_sloping();
  const t_estimate& fitted = slopes ? decision.sloped() : decision.level();
  const auto count = double(h.correspondences.size());
  result.fit.source = vertical_source::stems;
  h.target_from_source.translation.z += fitted.parameters[2];
  double variance = variance_factor(count, slopes ? 3 : 1) * fitted.covariance(2, 2) +
                    shared_share * decision.shared_variance();
  if (slopes) {
    result.fit.kind = vertical_kind::sloping;
    result.fit.tilt = vertical_decision::turn_of(fitted).norm();
    variance += decision.plane_variance();
  }
  result.fit.sigma = std::sqrt(variance);
  return result;
}

}  // namespace globalmatch::detail
