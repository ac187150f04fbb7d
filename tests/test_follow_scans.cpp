#include "globalmatch/detail/survey/follow_scans.hpp"

#include <vector>

#include "catch.hpp"

namespace globalmatch::test_follow_scans {

using namespace detail;

namespace {

/// Two scans in one frame that see a tree and show two targets, with a link by stems and one by targets.
survey two_scans() {
  survey s;
  for (int m = 0; m < 2; ++m) {
    survey::scan scan;
    scan.status = survey::status::placed;
    scan.is_height_known = true;
    scan.uncertainty =
        transform_uncertainty{{0, 0, 0}, Eigen::Vector3d::UnitZ(), Eigen::Matrix4d::Identity() * 1e-4};
    s.scans.push_back(scan);
  }
  s.trees.push_back({.position = {5, 6, 7}, .sigma = 0.01, .height_sigma = 0.01, .seen = {{0, 0}, {1, 0}}});
  for (const double x : {10.0, 20.0})
    s.targets.push_back({.name = "T", .seen = {{0, {x, 0, 0}, 0.002}, {1, {x, 0, 0}, 0.002}}});
  for (const std::size_t targets : {0u, 2u}) {
    survey::link link;
    link.source = 1;
    link.targets = targets;
    link.used = true;
    s.links.push_back(link);
  }
  return s;
}

}  // namespace

TEST_CASE("residuals of links by stems and by targets follow the poses") {
  survey s = two_scans();
  update_residuals(s);
  CHECK(s.links[0].residual == 0);
  CHECK(s.links[1].residual == 0);
  s.scans[1].survey_from_scan.translation() = Eigen::Vector3d(0.03, 0.04, 0.5);  // heights do not count
  update_residuals(s);
  CHECK(s.links[0].residual == Approx(0.05));
  CHECK(s.links[1].residual == Approx(0.05));
  s.targets.clear();
  s.scans[1].survey_from_scan.translation() = Eigen::Vector3d(0, 0, 0);
  update_residuals(s);
  CHECK(s.links[0].residual == 0);
  CHECK(s.links[1].residual == Approx(0.05));  // nothing says otherwise
}

TEST_CASE("a tree follows the mean of the scans that saw it, in height of those whose height is known") {
  const survey before = two_scans();
  survey s = before;
  s.scans[1].is_height_known = false;
  std::vector<Eigen::Isometry3d> changes(2, Eigen::Isometry3d::Identity());
  changes[0].translation() = Eigen::Vector3d(0, 0, 0.2);
  changes[1].translation() = Eigen::Vector3d(0.02, 0, 1);
  follow_scans(s.trees, before, s, changes);
  CHECK(s.trees[0].position.x() == Approx(5.01));
  CHECK(s.trees[0].position.z() == Approx(7.2));
  CHECK(s.trees[0].sigma == Approx(0.01));
}

}  // namespace globalmatch::test_follow_scans
