// What a survey takes and returns.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "globalmatch/matching.hpp"

namespace globalmatch {

/// Options of `register_survey`, and what is known beforehand.
struct survey_options {
  /// A scan whose pose is known: it is not adjusted.
  struct fixed_scan {
    std::size_t scan = 0;                                                ///< number of its map
    Eigen::Isometry3d survey_from_scan = Eigen::Isometry3d::Identity();  ///< its pose, [m]
  };

  /// What was measured of the pose of a scan, by satellites or a compass, in a frame whose up is +z. What was
  /// not measured is not a number.
  struct prior {
    std::size_t scan = 0;  ///< number of its map
    Eigen::Vector3d position =
        Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());  ///< [m] of the scan's origin
    double yaw = std::numeric_limits<double>::quiet_NaN();  ///< [rad] of its x axis, counter-clockwise from x
    double sigma_plan = 1;                                  ///< [m] along each horizontal axis
    double sigma_height = 1;                                ///< [m]
    double sigma_yaw = 0.05;                                ///< [rad]
  };

  /// A scan whose `up` is known to be its vertical, as by an inclination sensor.
  struct level {
    std::size_t scan = 0;  ///< number of its map
    double sigma = 0.002;  ///< [rad] about each horizontal axis
  };

  /// A target, as a reflector or a sphere, as a scan shows it. Those of one name are one point.
  struct target {
    std::size_t scan = 0;                                ///< number of its map
    std::string name = {};                               ///< the same in all scans
    Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< [m] in the scan's frame
    double sigma = 0.005;                                ///< [m] along each axis
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
  /// Measurements of the adjustment, beside trees and targets. The frame of a component without fixed scans
  /// is theirs. What disagrees with others, by more than the stems leave open, has no weight.
  std::vector<survey_options::prior> priors = {};
  /// The vertical of what links compare with these is their mean, weighted, however many scans lean against
  /// it. One of them is the reference of its component, unless that is given or has fixed scans.
  std::vector<survey_options::level> levels = {};
  /// Measurements of the adjustment beside the stems. Scans that have three in common are linked by them, or
  /// two that a cycle supports.
  std::vector<survey_options::target> targets = {};
};

/// Throws `std::invalid_argument` where a target makes no sense.
inline void require_valid(const std::vector<survey_options::target>& targets) {
  std::vector<std::pair<std::size_t, std::string_view>> seen;
  for (const survey_options::target& t : targets) {
    if (t.name.empty()) throw std::invalid_argument("targets: one has no name");
    if (!t.position.allFinite())
      throw std::invalid_argument("targets: the position of " + t.name + " is not finite");
    if (!(t.sigma >= 1e-6 && t.sigma <= 1e3))
      throw std::invalid_argument("targets: the standard deviation of " + t.name +
                                  " must lie between a micrometre and a kilometre");
    seen.emplace_back(t.scan, t.name);
  }
  std::sort(seen.begin(), seen.end());
  if (const auto twice = std::adjacent_find(seen.begin(), seen.end()); twice != seen.end())
    throw std::invalid_argument("targets: a scan has " + std::string(twice->second) + " twice");
}

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
  require_valid(options.targets);
}

/// Where the scans of a survey stand.
struct survey {
  /// What became of a scan.
  enum class status {
    placed,        ///< linked to others
    ambiguous,     ///< its links place it at several places; not in the adjustment, be it the reference
    placed_alone,  ///< linked to none, and no guess: a component of its own
    unplaced,      ///< too few stems, or links that are not significant
    no_stems
  };

  /// A scan, its pose, and how far to trust it.
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
    /// By how many of its standard deviations its prior is off after the adjustment, the most of plan, height
    /// and yaw. Not a number where it has none.
    double prior_deviations = std::numeric_limits<double>::quiet_NaN();
    /// [m] by which its fixed pose is off beside those of other fixed scans, so that it was not held; at the
    /// centroid of its stems. Not a number where it was, or where none is known.
    double fixed_distance = std::numeric_limits<double>::quiet_NaN();
  };

  /// What the frame of a component is that of.
  enum class frame_source { reference, fixed, priors };
  /// The frame of a component.
  struct frame {
    survey::frame_source source = survey::frame_source::reference;
    double yaw_sigma = 0;  ///< [rad] by which priors know its direction; infinite where they do not
  };

  /// Two scans whose stems agree, or targets that both show.
  struct link {
    std::size_t source = 0, target = 0;                                    ///< numbers of their maps
    Eigen::Isometry3d target_from_source = Eigen::Isometry3d::Identity();  ///< of this pair of maps alone
    /// Transforms expected to do as well, of one pair of unrelated maps. Not a number where targets link
    /// them.
    double log10_nfa = 0;
    std::size_t correspondences = 0;  ///< stems paired
    std::size_t targets = 0;          ///< that link the scans, in place of stems
    double inlier_threshold = 0;      ///< [m] at which stems were paired
    double rms = 0;                   ///< [m] distance in plan of paired stems, or targets
    double sigma_plan = 0;            ///< [m] along each axis, at the centroid of the paired stems or targets
    double sigma_yaw = 0;             ///< [rad] about that
    std::size_t supporting_cycles = 0;  ///< of three links, that close
    /// [m] in plan, at that centroid: median over the cycles of three links that are used; not a number
    /// without any.
    double closure = std::numeric_limits<double>::quiet_NaN();
    /// [m] in plan, from the adjusted poses: at the paired stems, or at the centroid of targets.
    double residual = 0;
    bool used = false;  ///< in the adjustment
  };

  /// A stem of a scan, and what it counts in plan and in height beside one of a typical scan: 0 where it does
  /// not fit, or its scan shows no ground.
  struct observation {
    std::size_t scan, stem;  ///< number of the map, index of the stem in it
    double weight = 1, height_weight = 1;
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

  /// A target of `survey_options`, and how it fits where the others of its name are.
  struct target_observation {
    std::size_t scan = 0;                                ///< number of its map
    Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< [m] in the scan's frame
    double sigma = 0;                                    ///< [m] along each axis
    /// What it counts beside its standard deviation, in plan and in height; 0 where it does not fit. The
    /// latter is 0 as well where the height of the scan is not known.
    double weight = 1, height_weight = 1;
    /// [m] from where the others have it; in plan where heights are not known. Not a number without others.
    double residual = std::numeric_limits<double>::quiet_NaN();
  };

  /// A target, from all scans of a component that show it.
  struct target {
    std::string name = {};
    Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< [m] frame of the survey
    double sigma = 0;                                    ///< [m] in plan, along each axis, in the survey
    double height_sigma = 0;                             ///< [m] infinite where no height is known
    int component = -1;                                  ///< of the scans that show it
    std::vector<survey::target_observation> seen = {};   ///< one a scan
  };

  /// A prior of `survey_options`, and what it counts in the adjustment beside its standard deviations: 0 to
  /// 1, 0 where it does not fit or was not measured.
  struct adjusted_prior {
    survey_options::prior given = {};                      ///< as it was given
    double weight = 0, yaw_weight = 0, height_weight = 0;  ///< of its place in plan, its yaw, its height
  };

  std::vector<survey::scan> scans;             ///< in the order of the maps
  std::vector<survey::link> links;             ///< ordered by source, then by target
  std::vector<survey::tree> trees;             ///< of the placed scans
  std::vector<survey::target> targets;         ///< of scans that have a component, by name and component
  std::vector<survey::adjusted_prior> priors;  ///< of scans that have a component, component by component
  double stem_sigma = 0;                       ///< [m] of a stem of a scan, in plan, along each axis
  std::size_t components = 0;                  ///< sets of scans that links connect
  std::vector<survey::frame> frames;           ///< of the components
  std::size_t candidates = 0;  ///< transforms that triangles voted for, and that were tried on all stems
  bool cancelled = false;      ///< the progress callback said so; nothing else is filled
};

/// The name of the source.
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
