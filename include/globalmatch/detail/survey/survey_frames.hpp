// The frame of a survey: that of fixed scans, or of what priors say. In: a survey in the frames of
// references. Out: the same in the frame that is known.
#pragma once

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/local_frame.hpp"
#include "globalmatch/detail/core/matrices.hpp"
#include "globalmatch/detail/core/rigid_fit.hpp"
#include "globalmatch/detail/core/robust.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/detail/matching/prior.hpp"
#include "globalmatch/detail/survey/plan_pose.hpp"
#include "globalmatch/detail/survey/pose_uncertainty.hpp"
#include "globalmatch/survey_options.hpp"

namespace globalmatch::detail {

/// Moves a component into another frame, with all that depends on it; guesses with that of most scans.
inline void move_component(survey& result, int component, const Eigen::Isometry3d& other_from_survey) {
  for (survey::scan& scan : result.scans) {
    if (scan.component != component && !(component == 0 && scan.component == -1)) continue;
    scan.survey_from_scan = other_from_survey * scan.survey_from_scan;
    for (Eigen::Isometry3d& other : scan.alternatives) other = other_from_survey * other;
    if (scan.uncertainty) scan.uncertainty = in_frame(*scan.uncertainty, other_from_survey);
  }
  for (survey::tree& tree : result.trees)
    if (tree.component == component) tree.position = other_from_survey * tree.position;
  for (survey::target& target : result.targets)
    if (target.component == component) target.position = other_from_survey * target.position;
}

/// [m^2] [rad^2] Of standard deviations, within what the normal equations can hold.
inline double variance_of_shift(double sigma) {
  constexpr double least = 1e-4, unknown = 1e3;  // [m]
  return std::pow(std::clamp(sigma, least, unknown), 2);
}
inline double variance_of_yaw(double sigma) {
  constexpr double least = 1e-5, unknown = 3;  // [rad]
  return std::pow(std::clamp(sigma, least, unknown), 2);
}

/// What a prior says of the frame of a component: where it has the origin of a scan, and its turn.
struct levelled_prior {
  const survey_options::prior* given = nullptr;
  bool is_height_known = true;  ///< of the scan
  vec3 origin;                  ///< [m] of the scan, in the levelled frame of the component
  double yaw = 0;               ///< [rad] of the scan, alike
  vec2 measured;                ///< [m]
  /// [m^2] [rad^2] Along each axis, of the prior and, thrice its deviation, of the scan in its component: one
  /// far from the reference may be off by more than its prior, as are those around it.
  double plan_variance = 0, yaw_variance = 0, height_variance = 0;
  double agreement = 1, yaw_agreement = 1, height_agreement = 1;  ///< Tukey weights

  bool has_place() const { return std::isfinite(given->position.x()) && std::isfinite(given->position.y()); }
  bool has_height() const { return is_height_known && std::isfinite(given->position.z()); }
  bool has_yaw() const { return std::isfinite(given->yaw); }

  double place_weight() const { return agreement / plan_variance; }
  double yaw_weight() const { return yaw_agreement / yaw_variance; }
  double raise_weight() const { return height_agreement / height_variance; }

  /// Residuals under a transform of the component, in standard deviations.
  double plan_residual(const plan_pose& moved) const {
    return has_place() ? (moved * origin.xy() - measured).norm() / std::sqrt(plan_variance) : 0;
  }
  double yaw_residual(const plan_pose& moved) const {
    return has_yaw() ? std::abs(wrapped(moved.yaw + yaw - given->yaw)) / std::sqrt(yaw_variance) : 0;
  }
  double height_residual(double raise) const {
    return has_height() ? std::abs(origin.z + raise - given->position.z()) / std::sqrt(height_variance) : 0;
  }
};

/// The priors of a component; `level_from_survey` turns it upright.
inline std::vector<levelled_prior> priors_of(const survey& s, int component,
                                             std::span<const survey_options::prior> priors,
                                             const Eigen::Isometry3d& level_from_survey) {
  constexpr double common = 9;  // times a variance
  std::vector<levelled_prior> of_component;
  for (const survey_options::prior& p : priors) {
    if (s.scans[p.scan].component != component) continue;
    const Eigen::Isometry3d level = level_from_survey * s.scans[p.scan].survey_from_scan;
    levelled_prior prior;
    prior.given = &p;
    prior.is_height_known =
        s.scans[p.scan].is_height_known || s.scans[p.scan].status != survey::status::placed;
    prior.origin = from_eigen(level.translation());
    prior.yaw = std::atan2(level(1, 0), level(0, 0));
    prior.measured = {p.position.x(), p.position.y()};
    prior.plan_variance = variance_of_shift(p.sigma_plan);
    prior.height_variance = variance_of_shift(p.sigma_height);
    prior.yaw_variance = variance_of_yaw(p.sigma_yaw);
    if (const auto& u = s.scans[p.scan].uncertainty) {
      const place_variance at(*u, s.scans[p.scan].survey_from_scan.translation());
      prior.plan_variance += common * at.horizontal;
      prior.height_variance += common * at.height;
      prior.yaw_variance += common * u->covariance(3, 3);
    }
    of_component.push_back(prior);
  }
  return of_component;
}

/// A first turn: the one that most measured yaws agree with, or that of the measured places.
inline double first_turn(std::span<const levelled_prior> priors) {
  double best = 0, least = std::numeric_limits<double>::infinity();
  for (const levelled_prior& p : priors) {
    if (!p.has_yaw()) continue;
    double sum = 0;
    for (const levelled_prior& other : priors)
      sum += std::min(tukey_constant, other.yaw_residual({{0, 0}, p.given->yaw - p.yaw}));
    if (sum < least) least = sum, best = p.given->yaw - p.yaw;
  }
  if (std::isfinite(least)) return best;
  std::vector<vec3> from, to;
  for (const levelled_prior& p : priors)
    if (p.has_place()) {
      from.push_back({p.origin.x, p.origin.y, 0});
      to.push_back({p.measured.x, p.measured.y, 0});
    }
  if (from.size() < 2) return 0;
  const auto fitted = fit_rigid(from, to, degrees_of_freedom::four);
  return fitted ? plan_of(*fitted).yaw : 0;
}

/// What the measured places say under a transform: their weighted mean, and the mean shift to where they were
/// measured.
struct place_sums {
  vec2 center{0, 0}, shift{0, 0};  ///< [m]
  double weight = 0;               ///< [1/m^2]

  place_sums(const plan_pose& moved, std::span<const levelled_prior> priors) {
    for (const levelled_prior& p : priors) {
      if (!p.has_place()) continue;
      const vec2 at = moved * p.origin.xy();
      center += p.place_weight() * at;
      shift += p.place_weight() * (p.measured - at);
      weight += p.place_weight();
    }
    if (weight > 0) center = center / weight, shift = shift / weight;
  }
};

/// What priors say of the turn: the information [1/rad^2] on it, of places by their distances from their
/// mean.
inline double turn_information(const plan_pose& moved, std::span<const levelled_prior> priors) {
  const place_sums places(moved, priors);
  double information = 0;
  for (const levelled_prior& p : priors) {
    if (p.has_place())
      information += p.place_weight() * (moved * p.origin.xy() - places.center).squared_norm();
    if (p.has_yaw()) information += p.yaw_weight();
  }
  return information;
}

/// Information [1/rad^2] below which a turn is not known: rounding would turn by any angle.
inline constexpr double min_turn_information = 1;

/// One least squares step of shift and turn about the weighted mean of the places; returns how far it moves.
inline double improve(plan_pose& moved, std::span<const levelled_prior> priors) {
  const place_sums places(moved, priors);
  double turn = 0;
  for (const levelled_prior& p : priors) {
    if (p.has_place()) {
      const vec2 at = moved * p.origin.xy(), lever = quarter_turned(at - places.center);
      turn += p.place_weight() * lever.dot(p.measured - at - places.shift);
    }
    if (p.has_yaw()) turn -= p.yaw_weight() * wrapped(moved.yaw + p.yaw - p.given->yaw);
  }
  const double information = turn_information(moved, priors);
  turn = information > min_turn_information ? turn / information : 0;
  const plan_pose about{places.center - plan_pose{{0, 0}, turn}.turned(places.center) + places.shift, turn};
  moved = about * moved;
  return places.shift.norm() + std::abs(turn);
}

/// Where the priors have a component: shift and turn by robust least squares, what is far off counting less
/// from the first step on (graduated non-convexity, as `adjust_links`).
inline plan_pose fit_plan(std::span<levelled_prior> priors) {
  constexpr int max_iterations = 60;
  constexpr double converged = 1e-6;
  plan_pose moved{{0, 0}, first_turn(priors)};
  for (int iteration = 0; iteration < 2; ++iteration) improve(moved, priors);
  double largest = 0;
  for (const levelled_prior& p : priors)
    largest = std::max({largest, p.plan_residual(moved), p.yaw_residual(moved)});
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    const double limit = std::max(tukey_constant, 2 * largest);
    for (levelled_prior& p : priors) {
      p.agreement = tukey_weight(std::pow(p.plan_residual(moved) / limit, 2));
      p.yaw_agreement = tukey_weight(std::pow(p.yaw_residual(moved) / limit, 2));
    }
    if (improve(moved, priors) < converged && largest == 0) break;
    largest = largest > 1 ? largest / 2 : 0;
  }
  return moved;
}

/// How much a component is to be raised: a robust mean, what is far off counting less from the first step on,
/// as in `fit_plan`; 0 where no heights are known.
inline double fit_raise(std::span<levelled_prior> priors) {
  constexpr int max_iterations = 60;
  std::vector<double> all;
  for (const levelled_prior& p : priors)
    if (p.has_height()) all.push_back(p.given->position.z() - p.origin.z);
  if (all.empty()) return 0;
  double raise = median(all), largest = 0;
  for (const levelled_prior& p : priors) largest = std::max(largest, p.height_residual(raise));
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    const double limit = std::max(tukey_constant, 2 * largest);
    double sum = 0, total = 0;
    for (levelled_prior& p : priors) {
      if (!p.has_height()) continue;
      p.height_agreement = tukey_weight(std::pow(p.height_residual(raise) / limit, 2));
      sum += p.raise_weight() * (p.given->position.z() - p.origin.z);
      total += p.raise_weight();
    }
    if (!(total > 0)) break;
    raise = sum / total;
    largest = largest > 1 ? largest / 2 : 0;
  }
  return raise;
}

/// Notes the priors of a component, and which of them count: those that are not far off.
inline void note_priors(survey& s, std::span<const levelled_prior> priors) {
  const auto counts = [](bool is_measured, double agreement) {
    return is_measured && agreement > 0 ? 1.0 : 0.0;
  };
  for (const levelled_prior& p : priors)
    s.priors.push_back({*p.given, counts(p.has_place(), p.agreement), counts(p.has_yaw(), p.yaw_agreement),
                        counts(p.has_height(), p.height_agreement)});
}

/// Says of scans by how many of its standard deviations their prior is off, of several the one that is most.
inline void note_deviations(survey& s) {
  constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  for (const survey::adjusted_prior& p : s.priors) s.scans[p.given.scan].prior_deviations = unknown;
  for (const survey::adjusted_prior& p : s.priors) {
    survey::scan& scan = s.scans[p.given.scan];
    const Eigen::Isometry3d& pose = scan.survey_from_scan;
    const Eigen::Vector3d off = pose.translation() - p.given.position;
    const bool has_height = scan.is_height_known || scan.status != survey::status::placed;
    const double deviations[] = {
        off.head<2>().norm() / p.given.sigma_plan,
        std::abs(wrapped(std::atan2(pose(1, 0), pose(0, 0)) - p.given.yaw)) / p.given.sigma_yaw,
        has_height ? std::abs(off.z()) / p.given.sigma_height : 0};
    for (const double d : deviations)
      if (std::isfinite(d)) scan.prior_deviations = std::fmax(scan.prior_deviations, d);
  }
}

/// Moves a component to where its priors have it.
inline void move_to_priors(survey& s, int component, std::span<const survey_options::prior> given) {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  for (const survey::scan& scan : s.scans)
    if (scan.component == component && scan.uncertainty) up = scan.uncertainty->up;
  rigid level;
  level.rotation = levelling_rotation(from_eigen(up));
  const Eigen::Isometry3d level_from_survey = to_eigen(level);
  std::vector<levelled_prior> priors = priors_of(s, component, given, level_from_survey);
  if (priors.empty()) return;
  const plan_pose moved = fit_plan(priors);
  const double raise = fit_raise(priors);
  note_priors(s, priors);
  const double information = turn_information(moved, priors);
  s.frames[std::size_t(component)] = {survey::frame_source::priors,
                                      information > min_turn_information
                                          ? 1 / std::sqrt(information)
                                          : std::numeric_limits<double>::infinity()};
  move_component(s, component, to_eigen(in_space(moved, raise)) * level_from_survey);
}

/// What priors count that are in the frame of fixed scans.
inline void compare_with_fixed(survey& s, int component, std::span<const survey_options::prior> given) {
  std::vector<levelled_prior> priors = priors_of(s, component, given, Eigen::Isometry3d::Identity());
  for (levelled_prior& p : priors) {
    p.agreement = tukey_weight(std::pow(p.plan_residual({}) / tukey_constant, 2));
    p.yaw_agreement = tukey_weight(std::pow(p.yaw_residual({}) / tukey_constant, 2));
    p.height_agreement = tukey_weight(std::pow(p.height_residual(0) / tukey_constant, 2));
  }
  note_priors(s, priors);
}

/// Whether a pose was not adjusted.
inline bool is_held(const survey::scan& scan) {
  return scan.uncertainty && scan.uncertainty->covariance(0, 0) == 0 &&
         scan.uncertainty->covariance(3, 3) == 0;
}

/// Puts each component into the frame of its fixed scan, else into that of the priors.
/// `reference_of(component)`: the fixed scan that its poses refer to; empty where it has none.
template <class ReferenceOf>
void use_known_frames(survey& s, const survey_options& options, const ReferenceOf& reference_of) {
  s.frames.assign(s.components, {});
  for (int component = 0; component < int(s.components); ++component) {
    const std::optional<std::size_t> reference = reference_of(component);
    if (!reference) {
      move_to_priors(s, component, options.priors);
      continue;
    }
    s.frames[std::size_t(component)].source = survey::frame_source::fixed;
    for (const survey_options::fixed_scan& f : options.fixed)
      if (f.scan == *reference)
        move_component(s, component, f.survey_from_scan * s.scans[f.scan].survey_from_scan.inverse());
    for (const survey_options::fixed_scan& f : options.fixed)  // to the last bit, and with their own tilt
      if (const survey::scan& scan = s.scans[f.scan];
          scan.component == component && (f.scan == *reference || is_held(scan)))
        s.scans[f.scan].survey_from_scan = f.survey_from_scan;
    compare_with_fixed(s, component, options.priors);
  }
  note_deviations(s);
}

}  // namespace globalmatch::detail
