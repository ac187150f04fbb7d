// What a survey takes and returns.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "globalmatch/matching.hpp"

namespace globalmatch {

struct survey_options {
  /// A scan whose pose is known: it is not adjusted.
  struct fixed_scan {
    std::size_t scan = 0;
    Eigen::Isometry3d survey_from_scan = Eigen::Isometry3d::Identity();
  };

  /// What was measured of the pose of a scan, by satellites or a compass, in a frame whose up is +z. What was
  /// not measured is not a number.
  struct prior {
    std::size_t scan = 0;
    Eigen::Vector3d position =
        Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());  ///< [m] of the scan's origin
    double yaw = std::numeric_limits<double>::quiet_NaN();  ///< [rad] of its x axis, counter-clockwise from x
    double sigma_plan = 1;                                  ///< [m] along each horizontal axis
    double sigma_height = 1;                                ///< [m]
    double sigma_yaw = 0.05;                                ///< [rad]
  };

  /// A scan whose `up` is known to be its vertical, as by an inclination sensor.
  struct level {
    std::size_t scan = 0;
    double sigma = 0.002;  ///< [rad] about each horizontal axis
  };

  /// Number of false alarms: wrong links that are expected of all pairs of maps, if none had anything in
  /// common (ours).
  double max_nfa = 1e-3;
  /// The scan whose frame is that of the survey. Empty: the one of most links in the largest component.
  std::optional<std::size_t> reference = {};
  /// Their frame is that of the survey, in each component that has some. Of several those are held that agree
  /// with each other, as the links say, within the uncertainty of the survey; others are adjusted as any
  /// scan, see `fixed_distance`. Where to hold them would cost a map its place but one is: those others have
  /// an uncertainty, and no `fixed_distance`.
  std::vector<survey_options::fixed_scan> fixed = {};
  /// Components without fixed scans are moved, each as a whole, to where it fits these best: the frame is
  /// then that of the priors. One that disagrees with others loses its weight.
  std::vector<survey_options::prior> priors = {};
  /// The vertical of what links compare with these is their mean, weighted, however many scans lean against
  /// it. One of them is the reference of its component, unless that is given or has fixed scans.
  std::vector<survey_options::level> levels = {};
};

/// Throws `std::invalid_argument` naming the field that makes no sense.
inline void require_valid(const survey_options& options) {
  if (!(options.max_nfa > 0)) throw std::invalid_argument("max_nfa must be positive");
  for (const survey_options::fixed_scan& f : options.fixed)
    if (!f.survey_from_scan.matrix().allFinite() || !f.survey_from_scan.linear().isUnitary(1e-6) ||
        f.survey_from_scan.linear().determinant() < 0)
      throw std::invalid_argument("fixed: a matrix is no rotation and shift");
  for (const survey_options::prior& p : options.priors)
    if (!(p.sigma_plan > 0) || !(p.sigma_height > 0) || !(p.sigma_yaw > 0))
      throw std::invalid_argument("priors: standard deviations must be positive");
  for (const survey_options::level& l : options.levels)
    if (!(l.sigma > 0) || !std::isfinite(l.sigma))
      throw std::invalid_argument("levels: standard deviations must be positive and finite");
}

/// Where the scans of a survey stand.
struct survey {
  enum class status {
    placed,        ///< linked to others
    ambiguous,     ///< its links place it at several places; not in the adjustment, be it the reference
    placed_alone,  ///< linked to none, and no guess: a component of its own
    unplaced,      ///< too few stems, or links that are not significant
    no_stems
  };

  struct scan {
    survey::status status = status::no_stems;
    std::string reason = {};  ///< why it was not placed, and what would help; empty where it was
    int component = -1;       ///< 0 is the one of most scans; -1: none
    /// Pose in the frame of the reference of its component, of fixed scans, or of priors; where the scan is
    /// ambiguous or unplaced the best guess in that of component 0, identity where there is none.
    Eigen::Isometry3d survey_from_scan = Eigen::Isometry3d::Identity();
    /// Marginal of the adjustment, of shift and turn about the stems' centroid, in the frame of the survey,
    /// against the reference of the component. Empty where the scan was not placed.
    std::optional<transform_uncertainty> uncertainty = {};
    /// Otherwise that of the pose is a guess. Against the reference, or where that has no heights, against
    /// the first map that has.
    bool is_height_known = false;
    std::size_t links = 0;  ///< that are used
    /// [m] between trees and stems that had no say in where the scan was placed: each half of its stems is
    /// placed by the other half. Not a number where fewer than eight are shared.
    double check_median = std::numeric_limits<double>::quiet_NaN();
    double check_worst = std::numeric_limits<double>::quiet_NaN();
    /// Where else its links place an ambiguous scan, most of them first.
    std::vector<Eigen::Isometry3d> alternatives = {};
    /// By how many of its standard deviations its prior is off, the most of plan, height and yaw. Not a
    /// number where it has none.
    double prior_deviations = std::numeric_limits<double>::quiet_NaN();
    /// [m] by which its fixed pose is off beside those of other fixed scans, so that it was not held; at the
    /// centroid of its stems. Not a number where it was, or where none is known.
    double fixed_distance = std::numeric_limits<double>::quiet_NaN();
  };

  /// What the frame of a component is that of.
  enum class frame_source { reference, fixed, priors };
  struct frame {
    survey::frame_source source = survey::frame_source::reference;
    double yaw_sigma = 0;  ///< [rad] by which priors know its direction; infinite where they do not
  };

  /// Two scans whose stems agree.
  struct link {
    std::size_t source = 0, target = 0;
    Eigen::Isometry3d target_from_source = Eigen::Isometry3d::Identity();  ///< of this pair of maps alone
    double log10_nfa = 0;               ///< transforms expected to do as well, of one pair of unrelated maps
    std::size_t correspondences = 0;    ///< stems paired
    double inlier_threshold = 0;        ///< [m] at which they were
    double rms = 0;                     ///< [m] distance in plan of paired stems
    double sigma_plan = 0;              ///< [m] along each axis, at the centroid of the paired stems
    double sigma_yaw = 0;               ///< [rad] about that
    std::size_t supporting_cycles = 0;  ///< of three links, that close
    /// [m] in plan, at that centroid: median over the cycles of three links that are used; not a number
    /// without any.
    double closure = std::numeric_limits<double>::quiet_NaN();
    double residual = 0;  ///< [m] in plan, at the paired stems, from the adjusted poses
    bool used = false;    ///< in the adjustment
  };

  /// A stem of a scan.
  struct observation {
    std::size_t scan, stem;
  };

  /// A tree, from all scans that saw it.
  struct tree {
    Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< [m] frame of the survey
    double radius = 0;                                   ///< [m] median of those known; 0: none is
    double sigma = 0;                                    ///< [m] in plan, along each axis, in the survey
    double height_sigma = 0;                             ///< [m] infinite where no height is known
    int component = -1;                                  ///< of the scans that saw it
    std::vector<survey::observation> seen = {};          ///< one a scan
  };

  std::vector<survey::scan> scans;  ///< in the order of the maps
  std::vector<survey::link> links;  ///< ordered by source, then by target
  std::vector<survey::tree> trees;  ///< of the placed scans
  double stem_sigma = 0;            ///< [m] of a stem of a scan, in plan, along each axis
  std::size_t components = 0;
  std::vector<survey::frame> frames;  ///< of the components
  std::size_t candidates = 0;  ///< transforms that triangles voted for, and that were tried on all stems
  bool cancelled = false;      ///< the progress callback said so; nothing else is filled
};

constexpr std::string_view to_string(survey::frame_source s) {
  constexpr std::string_view names[] = {"reference", "fixed", "priors"};
  return names[static_cast<int>(s)];
}

/// The status, as in poses.csv.
constexpr std::string_view to_string(survey::status s) {
  constexpr std::string_view names[] = {"placed", "ambiguous", "placed_alone", "unplaced", "no_stems"};
  return names[static_cast<int>(s)];
}

}  // namespace globalmatch
