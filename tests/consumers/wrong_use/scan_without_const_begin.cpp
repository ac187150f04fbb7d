// Must fail on: point_range
#include <globalmatch/icp.hpp>

#include <vector>

/// As `std::views::filter`, it may only be iterated over while it is not const.
struct lazy_points {
  std::vector<Eigen::Vector3d> points;
  auto begin() { return points.begin(); }
  auto end() { return points.end(); }
};

int main() {
  lazy_points scan;
  globalmatch::refine_by_icp(scan, scan, Eigen::Isometry3d::Identity(), globalmatch::degrees_of_freedom::four);
}
