#include "support/scan_summary.hpp"

#include <cmath>
#include <numbers>

namespace globalmatch::support {

scan_summary summarise(const scan_file& scan, const std::optional<Eigen::Vector3d>& scanner) {
  constexpr double half_width = 0.5;  // [m]
  const Eigen::Vector3d center = scanner.value_or(Eigen::Vector3d::Zero());
  scan_summary summary;
  std::array<std::size_t, 3> in_ring = {};
  for (const Eigen::Vector3d& p : scan) {
    if (!p.allFinite()) continue;
    ++summary.points;
    summary.extent.extend(p);
    const double distance = (p - center).head<2>().norm();
    for (std::size_t r = 0; r < in_ring.size(); ++r)
      in_ring[r] += std::abs(distance - scan_summary::distances[r]) < half_width;
  }
  const auto is_within = [&](Eigen::Index axis) {
    return summary.extent.min()[axis] <= center[axis] && center[axis] <= summary.extent.max()[axis];
  };
  if (!scanner && !(is_within(0) && is_within(1))) return summary;
  summary.density.emplace();
  for (std::size_t r = 0; r < in_ring.size(); ++r) {
    const double area = 2 * std::numbers::pi * scan_summary::distances[r] * 2 * half_width;  // [m^2]
    (*summary.density)[r] = double(in_ring[r]) / area;
  }
  return summary;
}

}  // namespace globalmatch::support
