#include "support/simulated_shapes.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace globalmatch::support {
namespace {

/// Both roots of a t^2 + 2 b t + c, the smaller first. They are NaN, or infinite, where there are none.
std::pair<double, double> roots(double a, double b, double c) {
  const double q = -(b + std::copysign(std::sqrt(b * b - a * c), b));  // nothing cancels
  return std::minmax({q / a, c / q});
}

}  // namespace

double first_hit(const frustum& cone, const ray& r) {
  const double length = (cone.top - cone.bottom).norm();
  const Eigen::Vector3d axis = (cone.top - cone.bottom) / length;
  const double taper = (cone.top_radius - cone.bottom_radius) / length;

  // Height along the axis, offset from it and radius there all change linearly along the ray.
  const Eigen::Vector3d from_bottom = r.origin - cone.bottom;
  const double height = from_bottom.dot(axis), climb = r.direction.dot(axis);
  const Eigen::Vector3d offset = from_bottom - height * axis, drift = r.direction - climb * axis;
  const double radius = cone.bottom_radius + taper * height, widening = taper * climb;

  const auto [entry, exit] =
      roots(drift.squaredNorm() - widening * widening, drift.dot(offset) - radius * widening,
            offset.squaredNorm() - radius * radius);
  for (const double distance : {entry, exit}) {
    const double hit_height = height + distance * climb;
    if (distance > 0 && hit_height >= 0 && hit_height <= length) return distance;
  }
  return no_hit;
}

double first_hit(const leaf_cloud& leaves, const ray& r, random_source& random) {
  // In units of its semi-axes the ellipsoid is the unit ball.
  const Eigen::Vector3d from_centre = (r.origin - leaves.centre).cwiseQuotient(leaves.semi_axes);
  const Eigen::Vector3d direction = r.direction.cwiseQuotient(leaves.semi_axes);
  const auto [entry, exit] =
      roots(direction.squaredNorm(), direction.dot(from_centre), from_centre.squaredNorm() - 1);
  if (!(exit > 0)) return no_hit;
  const double free_path = -std::log(1 - random.uniform()) / leaves.hits_per_metre;
  const double distance = std::max(entry, 0.0) + free_path;
  return distance < exit ? distance : no_hit;
}

}  // namespace globalmatch::support
