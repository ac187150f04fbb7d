// What matching returns: hypotheses with their evidence, the outcome, the transform and its uncertainty.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <compare>
#include <cstddef>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "globalmatch/points.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch {

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
  stem_index source, target;
  auto operator<=>(const correspondence&) const = default;
};

/// What the false alarms of a hypothesis were judged by.
enum class evidence_source {
  stems,      ///< how many of them meet
  gaps,       ///< of a stand in rows: how many of its gaps meet, which tells more
  residuals,  ///< of a stand in rows: how well its stems meet, which tells more
  heights,    ///< how well the heights of stems agree, which tells more: the terrain under both maps
  radii       ///< how well the radii of stems agree, which tells more
};

/// The witness's name, as in the JSON output.
inline std::string_view to_string(evidence_source w) {
  switch (w) {
    case evidence_source::stems:
      return "stems";
    case evidence_source::gaps:
      return "gaps";
    case evidence_source::residuals:
      return "residuals";
    case evidence_source::heights:
      return "heights";
    case evidence_source::radii:
      return "radii";
  }
  return "unknown";
}

/// A motion that may be the right one, and what speaks for it.
struct hypothesis {
  std::vector<correspondence> correspondences;  ///< one to one, increasing
  Eigen::Isometry3d target_from_source = Eigen::Isometry3d::Identity();
  double inlier_threshold = 0;  ///< [m] stems this near each other were paired
  /// Motions by chance that pair as many stems; see `null_model.hpp`. The best one of a matching was judged
  /// before its last pairs, which may lie further from each other, were added.
  double log10_nfa = 0;
  double log10_nfa_poisson = 0;  ///< the same if stems stood at random, and never in rows
  evidence_source evidence = evidence_source::stems;  ///< what the false alarms are those of
  double rms = 0;             ///< [m] distance of paired stems: in plan in 4-DoF, in space in 6-DoF
  std::size_t consensus = 0;  ///< triangle pairs in its consensus set
};

/// How much each step of matching left.
struct matching_funnel {
  std::size_t source_stems = 0, target_stems = 0;
  std::size_t source_triangles = 0, target_triangles = 0;
  std::size_t local_pairs = 0;      ///< congruent triangle pairs, of all queries or of `algorithm_1`
  std::size_t tested = 0;           ///< motions tried on stems, or consensus sets counted
  std::size_t consensus = 0;        ///< of these in the best hypothesis' consensus set
  std::size_t correspondences = 0;  ///< stems that the best hypothesis pairs
};

/// What each step was given and left, in their order.
inline std::vector<funnel_step> explain(const matching_funnel& f) {
  const std::size_t stems = std::min(f.source_stems, f.target_stems);
  return {
      {"source triangles", "stems", f.source_stems, "triangles", f.source_triangles,
       "of stems that do not stand near each other", "more stems are needed"},
      {"target triangles", "stems", f.target_stems, "triangles", f.target_triangles,
       "of stems that do not stand near each other", "more stems are needed"},
      {"local matching", "triangles", f.source_triangles, "pairs of like triangles", f.local_pairs,
       "edges differ by more than the tolerance",
       "the scans overlap too little or the tolerance is too small"},
      {"global matching", "pairs of like triangles", f.local_pairs, "motions tried", f.tested,
       "the same motion again, or fewer pairs agree on it than on others", "the scans overlap too little"},
      {"correspondences", "stems of the smaller map", stems, "paired stems", f.correspondences,
       "laid on no stem of the other map", "the scans overlap too little or the tolerance is too small"},
  };
}

/// The two shortest shifts at which stems repeat.
struct planting_lattice {
  /// [m] in plan, the shortest one, y not negative
  Eigen::Vector2d first = Eigen::Vector2d::Zero();
  /// [m] in plan, less than half a turn counter-clockwise of the first
  Eigen::Vector2d second = Eigen::Vector2d::Zero();

  /// [rad] of the rows, 0 to pi counter-clockwise from x
  double direction() const { return std::atan2(first.y(), first.x()); }
  /// [rad] between both shifts
  double angle() const {
    return std::atan2(first.x() * second.y() - first.y() * second.x(), first.dot(second));
  }
  /// [m] stems this near a place of the lattice stand on it: nearer to it than to any other one, with a
  /// margin
  double search_radius() const { return 0.3 * std::min(first.norm(), (second - first).norm()); }
  /// Turns [rad] that lay it on itself: 0 and pi, and those of squares or of equilateral triangles.
  std::vector<double> turns() const {
    std::vector<double> found;
    for (const int twelfths : {0, 4, 6, 8, 12, 16, 18, 20}) {
      const double turn = twelfths * std::numbers::pi / 12;
      const Eigen::Rotation2Dd rotation(turn);
      if (is_lattice_shift(rotation * first) && is_lattice_shift(rotation * second)) found.push_back(turn);
    }
    return found;
  }
  /// Whether a shift [m] lays the lattice on itself.
  bool is_lattice_shift(const Eigen::Vector2d& shift) const {
    Eigen::Matrix2d basis;
    basis << first, second;
    const Eigen::Vector2d steps = basis.inverse() * shift;
    return (basis * Eigen::Vector2d(std::round(steps.x()), std::round(steps.y())) - shift).norm() <
           search_radius();
  }
};

/// Covariance of the small motion that leads from the estimate to the truth: a shift and a turn about
/// `center`, in the frame of the target. Rows are x, y, z [m] and then, in 4-DoF, the turn about `up` [rad];
/// in 6-DoF the turns about x, y and z [rad]. The scatter of the stems is not known beforehand: as in
/// Student's t a few pairs, which hardly tell it, make the covariance larger.
struct transform_uncertainty {
  /// At most so many rows and columns, without memory of their own.
  template <int Rows, int Columns>
  using small_matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, Rows, Columns>;

  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< [m] centroid of the paired stems
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();     ///< unit
  small_matrix<6, 6> covariance;                     ///< 4 x 4 or 6 x 6

  /// How a shift and turn about the center move a place [m, target frame]: 3 x 4 or 3 x 6.
  small_matrix<3, 6> derivative(const Eigen::Vector3d& place) const {
    const Eigen::Vector3d arm = place - center;
    small_matrix<3, 6> jacobian(3, covariance.rows());
    jacobian.leftCols<3>().setIdentity();
    if (covariance.rows() == 4)
      jacobian.col(3) = up.cross(arm);
    else
      for (int axis = 0; axis < 3; ++axis) jacobian.col(3 + axis) = Eigen::Vector3d::Unit(axis).cross(arm);
    return jacobian;
  }

  /// Covariance [m^2] of where the motion lays what belongs at a place [m, target frame].
  Eigen::Matrix3d at(const Eigen::Vector3d& place) const {
    const auto jacobian = derivative(place);
    return jacobian * covariance * jacobian.transpose();
  }

  /// Root mean square distance [m] between where the motion lays what belongs at a place and that place.
  double expected_error(const Eigen::Vector3d& place) const { return std::sqrt(at(place).trace()); }
};

/// What came of matching, with the evidence to trust or reject it.
struct matching {
  globalmatch::outcome outcome = outcome::not_registered;
  std::string reason;                                   ///< empty when registered
  std::optional<Eigen::Isometry3d> target_from_source;  ///< only when registered
  double probability = 0;                               ///< that the best hypothesis is right
  /// The best one and its rivals, ranked and distinct; indices into the caller's positions. Rivals lay the
  /// stems elsewhere and pair more of them than stems that stood at random would by chance. The next best one
  /// is always there, where one was found.
  std::vector<hypothesis> hypotheses;
  std::optional<transform_uncertainty> uncertainty;      ///< of `target_from_source`, in the target's frame
  std::optional<globalmatch::planting_lattice> lattice;  ///< of the target, levelled, where it stands in rows
  bool horizontal = false;                               ///< heights were ignored
  double inlier_threshold = 0;                           ///< [m] that was used
  matching_funnel funnel;
};

}  // namespace globalmatch
