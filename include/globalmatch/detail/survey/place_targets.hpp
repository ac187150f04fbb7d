// Where the targets of a survey are, from the poses of the scans that show them.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "globalmatch/detail/survey/pose_uncertainty.hpp"
#include "globalmatch/survey_options.hpp"

namespace globalmatch::detail {

/// A weighted mean of where scans have a target. What has no weight counts where nothing else is there.
struct target_mean {
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< [m] frame of the survey
  double information = 0, height_information = 0;   ///< [1/m^2] of the target beside the scans
  double variance = 0, height_variance = 0;         ///< [m^2] of the poses

  bool has_height() const { return height_information > 0; }

  /// Of all observations but the one that `is_left_out(observation)`.
  template <class IsLeftOut>
  target_mean(const survey& s, const survey::target& t, const Eigen::Vector3d& up,
              const IsLeftOut& is_left_out) {
    constexpr double negligible = 1e-9;  // of a weight
    double height = 0;
    for (const survey::target_observation& o : t.seen) {
      if (is_left_out(o)) continue;
      const survey::scan& scan = s.scans[o.scan];
      const Eigen::Vector3d at = scan.survey_from_scan * o.position;
      const bool is_height_known = scan.is_height_known || scan.status != survey::status::placed;
      const double w = std::max(o.weight, negligible) / (o.sigma * o.sigma),
                   w_height =
                       is_height_known ? std::max(o.height_weight, negligible) / (o.sigma * o.sigma) : 0;
      place += w * at;
      height += w_height * at.dot(up);
      information += w;
      height_information += w_height;
      if (!scan.uncertainty) continue;
      const place_variance of_pose(*scan.uncertainty, at);
      variance += w * of_pose.horizontal;
      height_variance += w_height * of_pose.height;
    }
    if (!(information > 0)) return;
    place /= information;
    variance /= information;
    if (!has_height()) return;
    height_variance /= height_information;
    place += (height / height_information - place.dot(up)) * up;
  }
};

/// Fills positions, standard deviations and residuals of the targets from the poses, and from the weights of
/// their observations.
inline void place_targets(survey& s) {
  for (survey::target& t : s.targets) {
    Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
    for (const survey::target_observation& o : t.seen)
      if (s.scans[o.scan].uncertainty) up = s.scans[o.scan].uncertainty->up;
    const target_mean all(s, t, up, [](const auto&) { return false; });
    t.position = all.place;
    // Errors of poses are taken for common to the scans that show it, as those of neighbors nearly are.
    t.sigma = std::sqrt(1 / all.information + all.variance);
    t.height_sigma = all.has_height() ? std::sqrt(1 / all.height_information + all.height_variance)
                                      : std::numeric_limits<double>::infinity();
    for (survey::target_observation& o : t.seen) {
      o.residual = std::numeric_limits<double>::quiet_NaN();
      const target_mean others(s, t, up, [&](const auto& other) { return &other == &o; });
      if (!(others.information > 0)) continue;
      const survey::scan& scan = s.scans[o.scan];
      Eigen::Vector3d off = scan.survey_from_scan * o.position - others.place;
      if (!scan.is_height_known || !others.has_height()) off -= off.dot(up) * up;
      o.residual = off.norm();
    }
  }
}

}  // namespace globalmatch::detail
