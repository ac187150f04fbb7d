// What matching returns: hypotheses with their evidence, the outcome, the transform and its uncertainty.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <compare>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "globalmatch/points.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch {

/// Whether there is a transform to trust.
enum class outcome {
  registered,      ///< there is a transform to trust
  ambiguous,       ///< several transforms explain the stems about as well
  not_registered,  ///< no transform does
  cancelled        ///< the progress callback said so
};

/// The outcome's name, as in the JSON output.
inline std::string_view to_string(outcome o) {
  switch (o) {
    case outcome::registered:
      return "registered";
    case outcome::ambiguous:
      return "ambiguous";
    case outcome::not_registered:
      return "not_registered";
    case outcome::cancelled:
      return "cancelled";
  }
  return "unknown";
}

/// One stem in two maps.
struct correspondence {
  stem_index source, target;  ///< indices into the positions of the caller
  auto operator<=>(const correspondence&) const = default;
};

/// What the NFA of a hypothesis is that of.
enum class evidence_source {
  positions,  ///< how many stems are near others, and how near
  gaps,       ///< of a regular plantation: how many of its gaps match
  residuals,  ///< of a regular plantation: how well its stems fit
  radii,      ///< of a regular plantation: how well the radii of stems agree
  visibility  ///< positions, and how rarely a scanner saw past the place of a stem of the other scan
};

/// The name of the evidence, as in the JSON output.
inline std::string_view to_string(evidence_source w) {
  switch (w) {
    case evidence_source::positions:
      return "positions";
    case evidence_source::gaps:
      return "gaps";
    case evidence_source::residuals:
      return "residuals";
    case evidence_source::radii:
      return "radii";
    case evidence_source::visibility:
      return "visibility";
  }
  return "unknown";
}

/// A transform that may be the right one, and the evidence for it.
struct hypothesis {
  std::vector<correspondence> correspondences;                           ///< one to one, increasing
  Eigen::Isometry3d target_from_source = Eigen::Isometry3d::Identity();  ///< of the caller's frames, [m]
  double inlier_threshold = 0;  ///< [m] stems this near each other were paired
  /// Number of false alarms: transforms expected to do as well at random; see `detail/matching/evidence.hpp`.
  /// The best hypothesis was scored before its last pairs, which may be further from each other, were added.
  double log10_nfa = 0;
  double log10_nfa_poisson = 0;  ///< the same if stems stood at random, and never in rows
  evidence_source evidence = evidence_source::positions;  ///< that `log10_nfa` is of
  double rms = 0;             ///< [m] distance of paired stems: in plan in 4-DoF, in space in 6-DoF
  std::size_t consensus = 0;  ///< triangle pairs in its consensus set
};

/// How much each step of matching left.
struct matching_funnel {
  std::size_t source_stems = 0, target_stems = 0;            ///< that were given
  std::size_t source_coincident = 0, target_coincident = 0;  ///< of these at the place of others: left out
  std::size_t source_triangles = 0, target_triangles = 0;    ///< of neighbouring stems
  std::size_t local_pairs = 0;      ///< congruent triangle pairs, of all queries or of `algorithm_1`
  std::size_t tested = 0;           ///< transforms tried on stems, or consensus sets counted
  std::size_t consensus = 0;        ///< of these in the best hypothesis' consensus set
  std::size_t correspondences = 0;  ///< stems that the best hypothesis pairs
};

/// What each step was given and left, in their order.
inline std::vector<funnel_step> explain(const matching_funnel& f) {
  const std::size_t stems =
      std::min(f.source_stems - f.source_coincident, f.target_stems - f.target_coincident);
  return {
      {"source triangles", "stems", f.source_stems - f.source_coincident, "triangles", f.source_triangles,
       "of stems that do not stand near each other", "more stems are needed"},
      {"target triangles", "stems", f.target_stems - f.target_coincident, "triangles", f.target_triangles,
       "of stems that do not stand near each other", "more stems are needed"},
      {"local matching", "triangles", f.source_triangles, "pairs of like triangles", f.local_pairs,
       "edges differ by more than the tolerance",
       "the scans overlap too little or the tolerance is too small"},
      {"global matching", "pairs of like triangles", f.local_pairs, "transforms tried", f.tested,
       "the same transform again, or fewer pairs agree on it than on others", "the scans overlap too little"},
      {"correspondences", "stems of the smaller map", stems, "paired stems", f.correspondences,
       "near no stem of the other map", "the scans overlap too little or the tolerance is too small"},
  };
}

/// The two shortest shifts at which the stems of a regular plantation repeat.
struct planting_lattice {
  Eigen::Vector2d first = Eigen::Vector2d::Zero();  ///< [m] horizontal, the shortest one, y not negative
  /// [m] horizontal, less than half a turn counter-clockwise of the first
  Eigen::Vector2d second = Eigen::Vector2d::Zero();

  /// [rad] of the rows, 0 to pi counter-clockwise from x
  double direction() const { return std::atan2(first.y(), first.x()); }
  /// [rad] between both shifts
  double angle() const {
    return std::atan2(first.x() * second.y() - first.y() * second.x(),
                      first.x() * second.x() + first.y() * second.y());
  }
};

/// How a transform differs from the most probable one of a prior.
struct prior_deviation {
  double distance = 0;  ///< [m] in plan, between where both place the centroid of the source stems
  double turn = 0;      ///< [rad] about the vertical, not negative
  double sigmas = 0;  ///< both together, in standard deviations: two on the average where the prior is right
  bool is_contradicted = false;  ///< the stems place the source elsewhere, beyond doubt
};

/// By how much distances in the target are longer than in the source, in plan.
struct scale_estimate {
  double factor = 1;        ///< that the source must be multiplied by to fit best
  double sigma = 0;         ///< of it
  bool differs = false;     ///< from 1, beyond doubt: one of the maps is distorted, or has another scale
  bool is_applied = false;  ///< transforms and hypotheses are of the source multiplied by the factor
};

/// Covariance of the small transform that leads from the estimate to the truth: a shift and a turn about
/// `center`, in the frame of the target. Rows are x, y, z [m] and then, in 4-DoF, the turn about `up` [rad];
/// in 6-DoF the turns about x, y and z [rad]. A height that is not known has
/// the variance of a kilometre. The noise of the stems is not known beforehand: as in
/// Student's t a few pairs, which hardly determine it, make the covariance larger.
struct transform_uncertainty {
  /// At most so many rows and columns, without memory of their own.
  template <int Rows, int Columns>
  using small_matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, Rows, Columns>;

  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< [m] centroid of the paired stems
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();     ///< unit
  small_matrix<6, 6> covariance;                     ///< 4 x 4 or 6 x 6

  /// How a shift and turn about the center move a place [m, target frame]: 3 x 4 or 3 x 6.
  small_matrix<3, 6> derivative(const Eigen::Vector3d& place) const {
    const Eigen::Index size = covariance.rows();
    small_matrix<3, 6> jacobian(3, size);
    const double arm[3] = {place[0] - center[0], place[1] - center[1], place[2] - center[2]};
    for (Eigen::Index c = 0; c < size; ++c) {
      double about[3] = {up[0], up[1], up[2]};
      if (size == 6)
        for (int axis = 0; axis < 3; ++axis) about[axis] = c == 3 + axis;
      for (int r = 0; r < 3; ++r) {
        const int s = (r + 1) % 3, t = (r + 2) % 3;
        jacobian.data()[3 * c + r] = c < 3 ? double(c == r) : about[s] * arm[t] - about[t] * arm[s];
      }
    }
    return jacobian;
  }

  /// Covariance [m^2] of where the transform places what belongs at a place [m, target frame].
  Eigen::Matrix3d at(const Eigen::Vector3d& place) const {
    const Eigen::Index size = covariance.rows();
    const auto jacobian = derivative(place);
    Eigen::Matrix3d result;
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < 3; ++r) {
        double sum = 0;
        for (Eigen::Index k = 0; k < size; ++k)
          for (Eigen::Index l = 0; l < size; ++l)
            sum += jacobian.data()[3 * k + r] * covariance.data()[size * l + k] * jacobian.data()[3 * l + c];
        result.data()[3 * c + r] = sum;
      }
    return result;
  }

  /// Root mean square distance [m] between where the transform places what belongs at a place and that place.
  double expected_error(const Eigen::Vector3d& place) const {
    const Eigen::Matrix3d covariance_there = at(place);
    return std::sqrt(covariance_there.data()[0] + covariance_there.data()[4] + covariance_there.data()[8]);
  }
};

/// What the heights of the paired stems say of both scans.
enum class vertical_kind {
  level,    ///< both have the same vertical
  rotated,  ///< one is tilted against the other: the transform has six degrees of freedom
  sloping   ///< heights differ by a plane, and the scans are level: wrong heights, by drift or hidden ground
};

/// Where the height of a transform comes from.
enum class vertical_source {
  none,   ///< it is not known: that of the transform is the best guess
  stems,  ///< the heights of the paired stems
  ground  ///< ground points that both scans have at one place
};

/// The name of the kind, as in the JSON output.
inline std::string_view to_string(vertical_kind kind) {
  return kind == vertical_kind::rotated ? "rotated" : kind == vertical_kind::sloping ? "sloping" : "level";
}
/// The name of the source, as in the JSON output.
inline std::string_view to_string(vertical_source source) {
  return source == vertical_source::ground ? "ground" : source == vertical_source::stems ? "stems" : "none";
}

/// The height of a transform, which has evidence and an uncertainty of its own.
struct vertical_fit {
  vertical_kind kind = vertical_kind::level;       ///< whether it tilts, or heights slope
  vertical_source source = vertical_source::none;  ///< what the height is known by
  double sigma = 0;    ///< [m] of the height at `transform_uncertainty::center`; infinite where not known
  double tilt = 0;     ///< [rad] by which the transform is rotated, or the heights slope
  std::string reason;  ///< why the height is not known, and the remedy; empty where it is

  bool is_known() const { return source != vertical_source::none; }
};

/// What came of matching, with the evidence to trust or reject it.
struct matching {
  globalmatch::outcome outcome = outcome::not_registered;
  std::string reason;                                   ///< empty when registered
  std::optional<Eigen::Isometry3d> target_from_source;  ///< only when registered
  double probability = 0;                               ///< that the best hypothesis is right
  /// The best one and its alternatives, ranked and distinct; indices into the caller's positions.
  /// Alternatives are significant if stems stand at random. The next best one is always there, where one was
  /// found.
  std::vector<hypothesis> hypotheses;
  std::optional<transform_uncertainty> uncertainty;      ///< of `target_from_source`, in the target's frame
  std::optional<globalmatch::planting_lattice> lattice;  ///< of the target, levelled, where it stands in rows
  std::optional<vertical_fit> vertical;                  ///< of `target_from_source`
  std::optional<scale_estimate> scale;                   ///< of the paired stems, when registered
  std::optional<prior_deviation> prior;                  ///< of the best hypothesis, where a prior was given
  double inlier_threshold = 0;                           ///< [m] that was used
  matching_funnel funnel;                                ///< how much each step left
};

}  // namespace globalmatch
