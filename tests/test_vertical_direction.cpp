#include "globalmatch/detail/mapping/vertical_direction.hpp"

#include <cmath>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/random.hpp"

namespace globalmatch::test_vertical_direction {

using namespace detail;

using Vector3d = vec3;

namespace {

constexpr double degree = std::numbers::pi / 180;

/// Axes that lean from `up` by `lean` [rad] in each direction, one standard deviation.
std::vector<Vector3d> axes_about(const Vector3d& up, double lean, std::size_t count, random_source& random) {
  const Vector3d u = up.unit_orthogonal(), v = up.cross(u);
  std::vector<Vector3d> axes;
  for (std::size_t i = 0; i < count; ++i)
    axes.push_back((up + lean * random.normal() * u + lean * random.normal() * v).normalized());
  return axes;
}

Vector3d tilted(double angle) {
  return {std::sin(angle), 0, std::cos(angle)};
}

}  // namespace

TEST_CASE("parallel stems stand in their own direction, with certainty") {
  const Vector3d up = tilted(20 * degree);
  const auto upright = upright_of(std::vector<Vector3d>(10, up));
  REQUIRE(upright);
  CHECK(angle_between(upright->up, up) < 1e-9);
  CHECK(upright->sigma < 1e-6);
}

TEST_CASE("the direction of stems is as certain as it says") {
  const Vector3d up = tilted(8 * degree);
  std::size_t within = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    random_source random(seed);
    const auto upright = upright_of(axes_about(up, 2 * degree, 60, random));
    REQUIRE(upright);
    constexpr double circle_95 = 2.45;  // standard deviations in two dimensions
    within += angle_between(upright->up, up) < circle_95 * upright->sigma;
  }
  CHECK(within >= 180);
  CHECK(within <= 200);
}

TEST_CASE("a fifth of stems that lean with each other do not turn the direction of the others") {
  random_source random(3);
  auto axes = axes_about(Vector3d{0, 0, 1}, 1.5 * degree, 80, random);
  for (const Vector3d& a : axes_about(tilted(25 * degree), 3 * degree, 20, random)) axes.push_back(a);
  const auto upright = upright_of(axes);
  REQUIRE(upright);
  CHECK(angle_between(upright->up, Vector3d{0, 0, 1}) < 0.6 * degree);
}

TEST_CASE("fewer than ten stems determine no direction") {
  CHECK_FALSE(upright_of({}));
  CHECK_FALSE(upright_of(std::vector<Vector3d>(9, Vector3d{0, 0, 1})));
}

TEST_CASE("stems are tilted when they are off by more than noise and wind explain") {
  const Vector3d up = Vector3d{0, 0, 1};
  CHECK_FALSE(is_tilted(upright_direction{up.as<Eigen::Vector3d>(), 0.1 * degree}, up));
  CHECK_FALSE(is_tilted(upright_direction{tilted(3.9 * degree).as<Eigen::Vector3d>(), 0.1 * degree}, up));
  CHECK(is_tilted(upright_direction{tilted(4.1 * degree).as<Eigen::Vector3d>(), 0.1 * degree}, up));
  CHECK_FALSE(is_tilted(upright_direction{tilted(7.9 * degree).as<Eigen::Vector3d>(), 2 * degree}, up));
  CHECK(is_tilted(upright_direction{tilted(8.1 * degree).as<Eigen::Vector3d>(), 2 * degree}, up));
}

TEST_CASE("the uncertainty of the vertical is the noise of the axes over the root of their number") {
  random_source random(12);
  const vec3 truth = vec3{0.3, -0.4, 1}.normalized();
  const vec3 u = truth.unit_orthogonal(), v = truth.cross(u);
  constexpr double noise = 0.03;
  double squares = 0, sigmas = 0;
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<vec3> axes;
    for (int i = 0; i < 100; ++i) {
      const double lean = i % 10 == 0 ? 10 : 1;  // a tenth leans much
      axes.push_back(
          (truth + noise * lean * random.normal() * u + noise * lean * random.normal() * v).normalized());
    }
    const auto upright = upright_of(axes);
    REQUIRE(upright);
    squares += (from_eigen(upright->up) - truth).squared_norm() / 200;
    sigmas += upright->sigma / 200;
  }
  CHECK(sigmas == Approx(std::sqrt(squares / 2)).epsilon(0.15));  // in one direction
}

}  // namespace globalmatch::test_vertical_direction
