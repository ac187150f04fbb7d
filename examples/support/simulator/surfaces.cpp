#include "support/simulator/surfaces.hpp"

namespace globalmatch::support {

void surfaces::add_curve(std::span<const Eigen::Vector4d> points) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i + 1 < points.size()) curves.push_back(static_cast<std::uint32_t>(curve_points.size()));
    curve_points.push_back(points[i].cast<float>());
  }
}

void surfaces::add_disc(const Eigen::Vector3d& centre, double radius, const Eigen::Vector3d& normal) {
  discs.emplace_back(float(centre.x()), float(centre.y()), float(centre.z()), float(radius));
  disc_normals.push_back(normal.normalized().cast<float>());
}

}  // namespace globalmatch::support
