#include "support/height_field.hpp"

#include <cmath>
#include <limits>

namespace globalmatch::support {

double height_field::height(double x, double y) const {
  double sum = gradient.x() * x + gradient.y() * y;
  for (const wave& w : waves)
    sum += w.amplitude * std::cos(w.frequency.x() * x + w.frequency.y() * y + w.phase);
  return sum;
}

ground_walk::ground_walk(const height_field& ground, const Eigen::Vector3d& origin,
                         const Eigen::Vector2d& direction, double max_distance)
    : ground_(&ground),
      origin_(origin),
      direction_(direction),
      max_distance_(max_distance),
      near_(sample_at(0)),
      far_(near_) {}

double ground_walk::distance(double slope) {
  constexpr double step = 0.1;  // [m] short against the waves: no crest hides between two samples
  while (far_.rise < slope * far_.distance) {
    if (far_.distance >= max_distance_) return std::numeric_limits<double>::infinity();
    near_ = far_;
    far_ = sample_at(far_.distance + step);
  }
  return refine(slope);
}

ground_walk::sample ground_walk::sample_at(double distance) const {
  const Eigen::Vector2d place = origin_.head<2>() + distance * direction_;
  return {distance, ground_->height(place.x(), place.y()) - origin_.z()};
}

double ground_walk::refine(double slope) const {
  constexpr double tolerance = 1e-6;  // [m] of height, far below any scanner's noise
  const auto clearance = [slope](const sample& s) { return slope * s.distance - s.rise; };
  sample above = near_, below = far_, crossing = far_;
  for (int i = 0; i < 20; ++i) {  // false position: two rounds do, since the ground is all but straight here
    const double share = clearance(above) / (clearance(above) - clearance(below));
    crossing = sample_at(above.distance + share * (below.distance - above.distance));
    if (std::abs(clearance(crossing)) < tolerance) break;
    (clearance(crossing) > 0 ? above : below) = crossing;
  }
  return crossing.distance;
}

}  // namespace globalmatch::support
