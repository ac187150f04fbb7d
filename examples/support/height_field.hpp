// The simulator's ground: a plane with a few smooth waves on it, and where rays meet it.
#pragma once

#include <Eigen/Core>

#include <vector>

namespace globalmatch::support {

/// Smooth uneven ground without end: every place (x, y) has one height.
struct height_field {
  struct wave {
    Eigen::Vector2d frequency;  ///< [rad/m]
    double phase = 0;           ///< [rad]
    double amplitude = 0;       ///< [m]
  };
  Eigen::Vector2d gradient = Eigen::Vector2d::Zero();  ///< [m/m] of the plane
  std::vector<wave> waves = {};

  /// Height [m] of the ground at a place [m].
  double height(double x, double y) const;
};

/// Where the rays of one vertical half-plane meet the ground. The steeper a ray looks upward the further away
/// it lands, so the ground is walked along once for all of them.
class ground_walk {
 public:
  /// `origin` is the scanner, above the ground; `direction` the half-plane's unit vector in plan; the walk
  /// ends `max_distance` [m] away in plan. Refers to `ground`.
  ground_walk(const height_field& ground, const Eigen::Vector3d& origin, const Eigen::Vector2d& direction,
              double max_distance);

  /// Distance in plan [m] at which the ray that rises by `slope` [m/m] meets the ground, or infinity. Ask for
  /// slopes in rising order.
  double distance(double slope);

 private:
  struct sample {
    double distance;  ///< [m] from the scanner, in plan
    double rise;      ///< [m] of the ground over the scanner
  };
  sample sample_at(double distance) const;
  /// Distance between `near_` and `far_` at which a ray dives below the ground.
  double refine(double slope) const;

  const height_field* ground_;
  Eigen::Vector3d origin_;
  Eigen::Vector2d direction_;
  double max_distance_;
  sample near_;  ///< lies below every ray to come
  sample far_;   ///< the next step of the walk
};

}  // namespace globalmatch::support
