#include "globalmatch/detail/icp/icp_uncertainty.hpp"

#include <cmath>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/icp/icp_steps.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_icp_uncertainty {

using namespace detail;

namespace {

using scenes::four;
using scenes::six;

constexpr double place_sigma = 0.004;  // [m] that all samples of a place are off together

/// Samples of 60 places that are apart, 30 each, along directions around the vertical and upwards.
std::vector<icp_pair> pairs_of_places(random_source& random) {
  std::vector<icp_pair> pairs;
  for (int place = 0; place < 60; ++place) {
    const vec3 at{1.01 + 2.5 * (place % 10), 1.01 + 2.5 * (place / 10), 0};
    const vec3 off = place_sigma * vec3{random.normal(), random.normal(), random.normal()};
    for (int i = 0; i < 30; ++i) {
      const double angle = 0.7 * i;
      const vec3 normal = i % 3 == 0 ? vec3{0, 0, 1} : vec3{std::cos(angle), std::sin(angle), 0};
      const vec3 target = at + 0.2 * normal + vec3{0, 0, 0.05 * i};
      pairs.push_back({target + off + 0.001 * random.normal() * normal, target, normal, 1});
    }
  }
  return pairs;
}

vec3 centroid_of(const std::vector<icp_pair>& pairs) {
  vec3 center;
  for (const icp_pair& p : pairs) center += p.transformed / double(pairs.size());
  return center;
}

}  // namespace

TEST_CASE("the uncertainty of a fit is calibrated where samples of one place have errors in common") {
  constexpr int scenes = 200;
  double squares[4] = {};
  for (int scene = 0; scene < scenes; ++scene) {
    random_source random(std::uint64_t(scene + 1));
    const auto pairs = pairs_of_places(random);
    const icp_uncertainty u = uncertainty_of_fit(pairs, four, icp_metric::point_to_plane);
    REQUIRE(u.is_determined);
    REQUIRE(u.covariance.size == 4);
    CHECK((u.center - centroid_of(pairs)).norm() < 1e-9);
    const auto step = plane_step(pairs, u.center, four);  // the truth is that nothing has moved
    REQUIRE(step);
    const vec3 shift = *step * u.center - u.center;
    const double error[4] = {shift.x, shift.y, shift.z, std::asin(step->rotation(1, 0))};
    for (std::size_t k = 0; k < 4; ++k) squares[k] += error[k] * error[k] / u.covariance(k, k);
  }
  for (const double sum : squares) {
    CHECK(std::sqrt(sum / scenes) > 0.8);
    CHECK(std::sqrt(sum / scenes) < 1.25);
  }
}

TEST_CASE("pairs of few places determine no uncertainty, and pairs without weight count for nothing") {
  random_source random(5);
  auto pairs = pairs_of_places(random);
  const icp_uncertainty all = uncertainty_of_fit(pairs, six, icp_metric::point_to_point);
  CHECK(all.is_determined);
  CHECK(all.covariance.size == 6);
  for (int i = 0; i < 100; ++i) pairs.push_back({{500, 0, 0}, {490, 0, 0}, {1, 0, 0}, 0});
  const icp_uncertainty same = uncertainty_of_fit(pairs, six, icp_metric::point_to_point);
  CHECK(same.covariance.numbers == all.covariance.numbers);
  pairs.resize(30 * 2);  // of two places, and six unknowns
  CHECK_FALSE(uncertainty_of_fit(pairs, six, icp_metric::point_to_point).is_determined);
  CHECK_FALSE(uncertainty_of_fit({}, six, icp_metric::point_to_plane).is_determined);
}

}  // namespace globalmatch::test_icp_uncertainty
