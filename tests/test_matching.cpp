#include "globalmatch/matching.hpp"

#include <Eigen/Geometry>

#include <cmath>
#include <numbers>
#include <vector>

#include "catch.hpp"

namespace globalmatch::test_matching {

TEST_CASE("every source of evidence has a name of its own") {
  CHECK(to_string(evidence_source::positions) == "positions");
  CHECK(to_string(evidence_source::gaps) == "gaps");
  CHECK(to_string(evidence_source::residuals) == "residuals");
  CHECK(to_string(evidence_source::radii) == "radii");
  CHECK(to_string(static_cast<evidence_source>(99)) == "unknown");
}

TEST_CASE("the last step of matching is given the stems of the smaller map, and leaves paired ones") {
  matching_funnel m;
  m.source_stems = 20;
  m.target_stems = 30;
  m.correspondences = 12;
  CHECK(explain(m).back().in == 20);
  CHECK(explain(m).back().out == 12);
}

TEST_CASE("the funnel of matching hangs together: what a step is given is what an earlier one left") {
  matching_funnel f;
  f.source_stems = 30, f.target_stems = 20;
  f.source_triangles = 300, f.target_triangles = 200;
  f.local_pairs = 150, f.tested = 40, f.correspondences = 12;
  const std::vector<funnel_step> steps = explain(f);
  REQUIRE(steps.size() == 5);
  const std::size_t in[] = {30, 20, 300, 150, 20}, out[] = {300, 200, 150, 40, 12};
  for (std::size_t i = 0; i < 5; ++i) {
    CHECK(steps[i].in == in[i]);
    CHECK(steps[i].out == out[i]);
    CHECK_FALSE(steps[i].rest.empty());
    CHECK_FALSE(steps[i].remedy.empty());
  }
}

TEST_CASE("correspondences are ordered by source, then by target") {
  CHECK(correspondence{1, 9} < correspondence{2, 0});
  CHECK(correspondence{1, 3} < correspondence{1, 4});
  CHECK(correspondence{1, 3} == correspondence{1, 3});
}

TEST_CASE("the direction of a lattice is that of its first shift, its angle that to the second") {
  const planting_lattice lattice{{-1.2, 1.6}, {-2.5, -0.4}};
  CHECK(lattice.direction() == Approx(std::numbers::pi - std::atan2(1.6, 1.2)));
  CHECK(lattice.angle() == Approx(std::atan2(0.4, 2.5) + std::atan2(1.6, 1.2)));
}

TEST_CASE("the expected error of a place holds the turn about the center as well as the shift") {
  transform_uncertainty u;
  u.center = {10, -20, 5};
  u.up = Eigen::Vector3d(0.2, 0.3, 1).normalized();
  u.covariance = Eigen::Matrix4d::Zero();
  u.covariance(0, 0) = 0.01;
  u.covariance(3, 3) = 0.0004;  // 0.02 rad
  const Eigen::Vector3d place(40, 10, -7);
  const Eigen::Vector3d moved = u.up.cross(place - u.center);
  CHECK(u.expected_error(place) == Approx(std::sqrt(0.01 + 0.0004 * moved.squaredNorm())));
  u.covariance(0, 3) = u.covariance(3, 0) = 0.001;  // goes with the turn
  CHECK(u.at(place)(0, 0) == Approx(0.01 + 2 * 0.001 * moved.x() + 0.0004 * moved.x() * moved.x()));
  CHECK(u.at(place)(0, 1) == Approx(0.001 * moved.y() + 0.0004 * moved.x() * moved.y()));
}

TEST_CASE("the covariance at a place is that of shifted and turned copies, in 4-DoF and in 6-DoF") {
  const Eigen::Vector3d place(12, -7, 3);
  for (const int size : {4, 6}) {
    transform_uncertainty u;
    u.center = {3, 4, -5};
    u.up = Eigen::Vector3d(0.3, -0.1, 1).normalized();
    Eigen::MatrixXd root(size, size);
    for (int r = 0; r < size; ++r)
      for (int c = 0; c < size; ++c) root(r, c) = 0.01 * ((7 * r + 3 * c) % 5 - 1.5) + (r == c ? 0.02 : 0);
    u.covariance = root * root.transpose();
    Eigen::MatrixXd jacobian(3, size);
    constexpr double step = 1e-6;
    for (int k = 0; k < size; ++k) {
      const auto placed = [&](double by) -> Eigen::Vector3d {
        if (k < 3) return place + by * Eigen::Vector3d::Unit(k);
        const Eigen::Vector3d axis = size == 4 ? u.up : Eigen::Vector3d(Eigen::Vector3d::Unit(k - 3));
        return u.center + Eigen::AngleAxisd(by, axis) * (place - u.center);
      };
      jacobian.col(k) = (placed(step) - placed(-step)) / (2 * step);
    }
    CHECK((Eigen::MatrixXd(u.derivative(place)) - jacobian).norm() < 1e-6);
    const Eigen::Matrix3d expected = jacobian * root * root.transpose() * jacobian.transpose();
    CHECK((u.at(place) - expected).norm() < 1e-6 * expected.norm());
    CHECK(u.expected_error(place) == Approx(std::sqrt(expected.trace())));
    CHECK((u.at(u.center) - Eigen::Matrix3d(u.covariance.topLeftCorner(3, 3))).norm() < 1e-15);
  }
}

}  // namespace globalmatch::test_matching
