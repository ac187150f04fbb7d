// Options of stem matching ([GM] 3.2).
#pragma once

#include <Eigen/Geometry>

#include <cmath>
#include <numbers>
#include <optional>
#include <stdexcept>

#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/rigid_fit.hpp"
#include "globalmatch/global_matching.hpp"
#include "globalmatch/triangles.hpp"

namespace globalmatch {

/// How hypotheses are proposed.
enum class proposal {
  triangle_index,  ///< congruent triangles are looked up; for maps of any size (ours)
  algorithm_1      ///< largest consensus set of all congruent triangles, [GM] 3.2; for some hundred stems
};

/// When a hypothesis is one to trust.
struct decision_options {
  int min_correspondences = 4;  ///< stems in both maps (ours)
  double min_minor_axis_sigma =
      0.5;  ///< [m] standard deviation of these across the line that fits them best (ours)
  /// Number of false alarms (NFA): false registrations that are expected of unrelated maps. The transform of
  /// one comparison, or of all `comparisons` together, has fewer (ours).
  double max_nfa = 1e-3;
  double comparisons = 1;  ///< pairs of maps that the caller compares, of which most are unrelated
  /// An alternative whose log10 NFA is at least this share of the best one's makes it ambiguous (ours).
  double alternative_share = 0.5;
};

/// Throws `std::invalid_argument` naming the field that makes no sense.
inline void require_valid(const decision_options& options) {
  if (options.min_correspondences < 3)
    throw std::invalid_argument("decision.min_correspondences must be at least 3");
  if (!(options.min_minor_axis_sigma >= 0))
    throw std::invalid_argument("decision.min_minor_axis_sigma must not be negative");
  if (!(options.max_nfa > 0)) throw std::invalid_argument("decision.max_nfa must be positive");
  if (!(options.comparisons >= 1 && std::isfinite(options.comparisons)))
    throw std::invalid_argument("decision.comparisons must be at least 1 and finite");
  if (!(options.alternative_share > 0 && options.alternative_share <= 1))
    throw std::invalid_argument("decision.alternative_share must lie in (0, 1]");
}

/// What is known of the transform beforehand, by GNSS, compass, or a plan: a Gaussian. The search is
/// restricted to four standard deviations, and what agrees needs less evidence. Height and tilt are free
/// (ours).
struct transform_prior {
  Eigen::Isometry3d target_from_source = Eigen::Isometry3d::Identity();  ///< the most probable one
  double sigma_position =
      5;  ///< [m] along each horizontal axis, of where it places the source stems' centroid
  double sigma_yaw = std::numbers::pi / 18;  ///< [rad] of the turn about that place
};

/// Throws `std::invalid_argument` naming the field that makes no sense.
inline void require_valid(const transform_prior& prior) {
  if (!(prior.sigma_position >= 0 && std::isfinite(prior.sigma_position)))
    throw std::invalid_argument("prior.sigma_position must not be negative, and finite");
  if (!(prior.sigma_yaw >= 0 && std::isfinite(prior.sigma_yaw)))
    throw std::invalid_argument("prior.sigma_yaw must not be negative, and finite");
  detail::require_rigid(prior.target_from_source, "prior.target_from_source");
}

namespace detail {
/// log10 of the largest NFA of one comparison.
inline double max_log10_nfa(const decision_options& options) {
  return std::log10(options.max_nfa) - std::log10(options.comparisons);
}
}  // namespace detail

/// Options of `match_stems`. By default the data at hand decide.
struct matching_options {
  /// Empty: four, or six where a scan is rotated beyond doubt ([GM] 3.3 prefers four for levelled scans).
  std::optional<degrees_of_freedom> dof = {};
  bool horizontal = false;  ///< ignore heights: that of the transform is a guess (ours)
  /// Multiply the source by the factor that fits best, where distances differ beyond doubt; of `match_stems`
  /// alone (ours).
  bool scale = false;
  /// [m] epsilon: edges of congruent triangles differ by less, and paired stems are closer ([GM] 3.2.2:
  /// 0.05), horizontally in 4-DoF (but for the edges of `algorithm_1`). Empty: the one of the smallest NFA,
  /// or a wider one where three standard deviations of the residuals are more.
  std::optional<double> inlier_threshold = {};
  std::optional<transform_prior> prior = {};  ///< empty: all transforms are equally probable
  globalmatch::proposal proposal = proposal::triangle_index;
  triangle_options triangles = {};      ///< of `algorithm_1`
  global_matching_options global = {};  ///< of `algorithm_1`
  decision_options decision = {};
};

/// Throws `std::invalid_argument` naming the field that makes no sense.
inline void require_valid(const matching_options& options) {
  if (options.inlier_threshold &&
      !(*options.inlier_threshold > 0 && std::isfinite(*options.inlier_threshold)))
    throw std::invalid_argument("inlier_threshold must be positive and finite");
  if (options.dof && options.dof != degrees_of_freedom::four && options.dof != degrees_of_freedom::six)
    throw std::invalid_argument("dof must be four or six, or empty");
  if (options.proposal != proposal::triangle_index && options.proposal != proposal::algorithm_1)
    throw std::invalid_argument("proposal must be triangle_index or algorithm_1");
  if (options.horizontal && options.dof == degrees_of_freedom::six)
    throw std::invalid_argument("horizontal: six degrees of freedom need heights");
  if (options.prior) require_valid(*options.prior);
  require_valid(options.triangles);
  require_valid(options.global);
  require_valid(options.decision);
}

namespace detail {
/// For scans, of which no scale is applied. Throws `std::invalid_argument`.
inline void require_own_scale(const matching_options& options) {
  if (options.scale)
    throw std::invalid_argument("matching.scale: scans keep their scale; match_stems alone applies one");
}
}  // namespace detail

}  // namespace globalmatch
