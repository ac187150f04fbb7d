#include "globalmatch/detail/survey/place_targets.hpp"

#include <cmath>
#include <vector>

#include "catch.hpp"

namespace globalmatch::test_place_targets {

using namespace detail;

namespace {

/// Scans that are shifted along x, with no uncertainty, and a target that all show, `off` [m] from where it
/// is.
survey survey_with_target(const std::vector<Eigen::Vector3d>& off) {
  const Eigen::Vector3d place(3, 4, 5);
  survey s;
  survey::target target{.name = "T", .component = 0};
  for (std::size_t i = 0; i < off.size(); ++i) {
    survey::scan scan;
    scan.status = survey::status::placed;
    scan.component = 0;
    scan.is_height_known = true;
    scan.survey_from_scan.translation().x() = 10 * double(i);
    scan.uncertainty = transform_uncertainty{{0, 0, 0}, Eigen::Vector3d::UnitZ(), Eigen::Matrix4d::Zero()};
    target.seen.push_back({i, scan.survey_from_scan.inverse() * (place + off[i]), 0.002});
    s.scans.push_back(scan);
  }
  s.targets.push_back(target);
  return s;
}

}  // namespace

TEST_CASE("a target is where the weighted mean of its observations is") {
  survey s = survey_with_target({{0, 0, 0}, {0.003, 0, 0.006}});
  s.targets[0].seen[1].sigma = 0.004;
  place_targets(s);
  const survey::target& t = s.targets[0];
  CHECK(t.position.x() == Approx(3 + 0.003 / 5));
  CHECK(t.position.z() == Approx(5 + 0.006 / 5));
  CHECK(t.sigma == Approx(std::sqrt(1 / (1 / 4e-6 + 1 / 16e-6))));
  CHECK(t.height_sigma == Approx(t.sigma));
  CHECK(t.seen[0].residual == Approx(std::hypot(0.003, 0.006)));
  CHECK(t.seen[1].residual == Approx(t.seen[0].residual));
}

TEST_CASE("an observation of no weight has a residual, and no say") {
  survey s = survey_with_target({{0, 0, 0}, {0, 0, 0}, {0.3, 0.4, 0}});
  s.targets[0].seen[2].weight = s.targets[0].seen[2].height_weight = 0;
  place_targets(s);
  const survey::target& t = s.targets[0];
  CHECK((t.position - Eigen::Vector3d(3, 4, 5)).norm() < 1e-6);
  CHECK(t.seen[0].residual < 1e-6);
  CHECK(t.seen[2].residual == Approx(0.5));
}

TEST_CASE("where heights are not known residuals are in plan, and a single observation has none") {
  survey s = survey_with_target({{0, 0, 0}, {0.01, 0, 2}});
  s.scans[1].is_height_known = false;
  place_targets(s);
  CHECK(s.targets[0].seen[0].residual == Approx(0.01));
  CHECK(s.targets[0].seen[1].residual == Approx(0.01));
  CHECK(s.targets[0].position.z() == Approx(5));
  survey alone = survey_with_target({{0, 0, 0}});
  place_targets(alone);
  CHECK(std::isnan(alone.targets[0].seen[0].residual));
  alone.scans[0].is_height_known = false;
  place_targets(alone);
  CHECK(std::isinf(alone.targets[0].height_sigma));
}

TEST_CASE("the uncertainty of poses is in that of targets") {
  survey s = survey_with_target({{0, 0, 0}, {0, 0, 0}});
  for (survey::scan& scan : s.scans)
    scan.uncertainty->covariance = Eigen::Vector4d(1e-4, 1e-4, 4e-4, 0).asDiagonal().toDenseMatrix();
  place_targets(s);
  CHECK(s.targets[0].sigma == Approx(std::sqrt(1e-4 + 2e-6)));
  CHECK(s.targets[0].height_sigma == Approx(std::sqrt(4e-4 + 2e-6)));
}

}  // namespace globalmatch::test_place_targets
