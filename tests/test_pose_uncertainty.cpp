#include "globalmatch/detail/survey/pose_uncertainty.hpp"

#include "catch.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_pose_uncertainty {

using namespace detail;

namespace {

transform_uncertainty any_uncertainty(random_source& random) {
  transform_uncertainty u;
  u.center = {random.normal(), 5 * random.normal(), random.normal()};
  Eigen::Matrix4d factor;
  for (int i = 0; i < 16; ++i) factor.data()[i] = 0.01 * random.normal();
  u.covariance = factor * factor.transpose();
  return u;
}

}  // namespace

TEST_CASE("an uncertainty about another center says the same of every place") {
  random_source random(1);
  const transform_uncertainty u = any_uncertainty(random), other = about(u, {7, -3, 2});
  CHECK(other.center == Eigen::Vector3d(7, -3, 2));
  for (const Eigen::Vector3d& place : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(20, -10, 3), u.center})
    CHECK((u.at(place) - other.at(place)).norm() < 1e-12);
}

TEST_CASE("an uncertainty in another frame says the same of places there") {
  random_source random(2);
  const transform_uncertainty u = any_uncertainty(random);
  const Eigen::Isometry3d frame =
      Eigen::Translation3d(1, 2, 3) * Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized());
  const transform_uncertainty there = in_frame(u, frame);
  const Eigen::Vector3d place(4, 5, 6);
  CHECK((there.at(frame * place) - frame.linear() * u.at(place) * frame.linear().transpose()).norm() < 1e-12);
}

TEST_CASE("covariances of independent uncertainties add up at every place") {
  random_source random(3);
  const transform_uncertainty a = any_uncertainty(random), b = any_uncertainty(random);
  const Eigen::Vector3d place(4, -5, 6);
  CHECK((sum_of(a, b).at(place) - a.at(place) - b.at(place)).norm() < 1e-12);
}

}  // namespace globalmatch::test_pose_uncertainty
