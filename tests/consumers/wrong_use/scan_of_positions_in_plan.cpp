// Must fail on: point_range
#include <globalmatch/icp.hpp>

#include <vector>

int main() {
  const std::vector<Eigen::Vector2d> plan(9);
  globalmatch::refine_by_icp(plan, plan, Eigen::Isometry3d::Identity(),
                             globalmatch::degrees_of_freedom::four);
}
