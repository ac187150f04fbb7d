#include "support/scan_summary.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "globalmatch/detail/core/threads.hpp"

namespace globalmatch::support {

namespace {

constexpr double half_width = 0.5;  // [m] of a ring around a distance

// What is known of some points.
struct part_summary {
  std::size_t points = 0;
  Eigen::AlignedBox3d extent;
  std::array<std::size_t, 3> in_ring = {};

  void add(const Eigen::Vector3d& p, const Eigen::Vector3d& center) {
    if (!p.allFinite()) return;
    ++points;
    extent.extend(p);
    const double distance = (p - center).head<2>().norm();
    for (std::size_t r = 0; r < in_ring.size(); ++r)
      in_ring[r] += std::abs(distance - scan_summary::distances[r]) < half_width;
  }

  void add(const part_summary& other) {
    points += other.points;
    extent.extend(other.extent);
    for (std::size_t r = 0; r < in_ring.size(); ++r) in_ring[r] += other.in_ring[r];
  }
};

// Parts are the same for any number of threads, and are added in their order.
part_summary look_at_points(const scan_file& scan, const Eigen::Vector3d& center, const execution& exec) {
  constexpr std::size_t part_size = 16 * point_source::block_size;
  std::vector<part_summary> parts((scan.size() + part_size - 1) / part_size);
  detail::parallel_chunks(exec, "look at points", scan.size(), part_size,
                          [&](std::size_t begin, std::size_t end) {
                            part_summary part;
                            auto at = scan.begin() + static_cast<std::ptrdiff_t>(begin);
                            for (std::size_t i = begin; i < end; ++i, ++at) part.add(*at, center);
                            parts[begin / part_size] = part;
                          });
  part_summary all;
  for (const part_summary& part : parts) all.add(part);
  return all;
}

}  // namespace

scan_summary summarise(const scan_file& scan, const std::optional<Eigen::Vector3d>& scanner,
                       const execution& exec) {
  const Eigen::Vector3d center = scanner.value_or(Eigen::Vector3d::Zero());
  const part_summary seen = look_at_points(scan, center, exec);
  scan_summary summary{seen.points, seen.extent, {}, scan.points().count_classes(exec)};
  const auto is_within = [&](Eigen::Index axis) {
    return seen.extent.min()[axis] <= center[axis] && center[axis] <= seen.extent.max()[axis];
  };
  if (!scanner && !(is_within(0) && is_within(1))) return summary;
  summary.density.emplace();
  for (std::size_t r = 0; r < seen.in_ring.size(); ++r) {
    const double area = 2 * std::numbers::pi * scan_summary::distances[r] * 2 * half_width;  // [m^2]
    (*summary.density)[r] = double(seen.in_ring[r]) / area;
  }
  return summary;
}

}  // namespace globalmatch::support
