#include "globalmatch/detail/core/rigid_fit.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/random.hpp"

namespace globalmatch::test_rigid_fit {

using namespace detail;

namespace {

constexpr auto four = degrees_of_freedom::four, six = degrees_of_freedom::six;

std::vector<vec3> random_places(std::size_t count, random_source& random) {
  std::vector<vec3> places;
  for (std::size_t i = 0; i < count; ++i)
    places.push_back({100 + 20 * random.uniform(), -50 + 7 * random.uniform(), 3 * random.normal()});
  return places;
}

/// Weighted sum of squared distances [m^2] that a transform leaves.
double cost(const rigid& t, const std::vector<vec3>& source, const std::vector<vec3>& target,
            const std::vector<double>& weights) {
  double sum = 0;
  for (std::size_t i = 0; i < source.size(); ++i)
    sum += weights[i] * (t * source[i] - target[i]).squared_norm();
  return sum;
}

/// Where a rotation leaves the least squares translation.
rigid with_best_translation(const mat3& rotation, const std::vector<vec3>& source,
                            const std::vector<vec3>& target, const std::vector<double>& weights) {
  vec3 sum;
  double total = 0;
  for (std::size_t i = 0; i < source.size(); ++i) {
    sum += weights[i] * (target[i] - rotation * source[i]);
    total += weights[i];
  }
  return {rotation, sum / total};
}

}  // namespace

TEST_CASE("the fit has the least weighted sum of squares, by a search over all turns or by Eigen") {
  random_source random(1);
  for (int trial = 0; trial < 20; ++trial) {
    const auto source = random_places(9, random);
    const rigid truth{rotation_about(vec3{0.3, -0.5, 1}.normalized(), 0.3 * trial - 3), {7, -30, 2}};
    std::vector<vec3> target;
    std::vector<double> weights;
    for (const vec3& p : source) {
      target.push_back(truth * p + 0.8 * vec3{random.normal(), random.normal(), random.normal()});
      weights.push_back(0.1 + 5 * random.uniform());
    }
    const auto level = fit_rigid(source, target, four, weights),
               free = fit_rigid(source, target, six, weights);
    REQUIRE((level && free));
    double least = 1e9, at = 0;
    for (int k = 0; k < 20000; ++k) {
      const double angle = k * std::numbers::pi / 10000;
      const double here = cost(with_best_translation(rotation_about_z(angle), source, target, weights),
                               source, target, weights);
      if (here < least) least = here, at = angle;
    }
    CHECK(cost(*level, source, target, weights) <= least * (1 + 1e-12));
    CHECK(rotation_angle(level->rotation * rotation_about_z(-at)) < 4e-4);

    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    Eigen::Vector3d source_mean = Eigen::Vector3d::Zero(), target_mean = Eigen::Vector3d::Zero();
    double sum = 0;
    for (std::size_t i = 0; i < 9; ++i) {
      source_mean += weights[i] * to_eigen(source[i]), target_mean += weights[i] * to_eigen(target[i]);
      sum += weights[i];
    }
    source_mean /= sum, target_mean /= sum;
    for (std::size_t i = 0; i < 9; ++i)
      covariance +=
          weights[i] * (to_eigen(target[i]) - target_mean) * (to_eigen(source[i]) - source_mean).transpose();
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const double hand = (svd.matrixU() * svd.matrixV().transpose()).determinant();
    const Eigen::Matrix3d rotation =
        svd.matrixU() * Eigen::Vector3d(1, 1, hand).asDiagonal() * svd.matrixV().transpose();
    CHECK((to_eigen(*free).linear() - rotation).norm() < 1e-9);
    CHECK((to_eigen(free->translation) - (target_mean - rotation * source_mean)).norm() < 1e-6);
  }
}

TEST_CASE("without weights all points are equal, and weights may be of any size") {
  random_source random(2);
  const auto source = random_places(6, random);
  std::vector<vec3> target;
  for (const vec3& p : source)
    target.push_back(rotation_about_z(1) * p + 0.5 * vec3{random.normal(), random.normal(), random.normal()});
  for (const auto dof : {four, six}) {
    const auto plain = fit_rigid(source, target, dof);
    const auto weighted = fit_rigid(source, target, dof, std::vector<double>(6, 1e-3));
    REQUIRE((plain && weighted));
    for (const vec3& p : source) CHECK((*plain * p - *weighted * p).norm() < 1e-9);
  }
}

TEST_CASE("there is no fit of points that do not determine it") {
  const vec3 a{1, 2, 3}, b{4, -2, 5}, above{1, 2, 9};
  const auto fits = [](const std::vector<vec3>& points, degrees_of_freedom dof,
                       const std::vector<double>& weights = {}) {
    std::vector<vec3> target;
    for (const vec3& p : points) target.push_back(rotation_about_z(2) * p + vec3{5, 6, 7});
    return fit_rigid(points, target, dof, weights).has_value();
  };
  for (const auto dof : {four, six}) {
    CHECK_FALSE(fits({}, dof));
    CHECK_FALSE(fits({a}, dof));
    CHECK_FALSE(fits({a, a, a}, dof));
    CHECK_FALSE(fits({a, b, above}, dof, {0, 0, 0}));
    CHECK(fits({a, b, above}, dof, {1, 1, 1}));
  }
  CHECK(fits({a, b}, four));
  CHECK_FALSE(fits({a, above}, four));  // one above the other
  CHECK_FALSE(fits({a, b}, six));
  CHECK_FALSE(fits({a, a + 0.5 * (b - a), b, a + 3 * (b - a)}, six));  // on a line
  CHECK_FALSE(fits({a, b, above}, six, {1, 1, 0}));
  const std::vector<vec3> square = {{1, 1, 0}, {-1, 1, 0}, {-1, -1, 0}, {1, -1, 0}};
  const std::vector<vec3> mirrored = {{-1, 1, 0}, {1, 1, 0}, {1, -1, 0}, {-1, -1, 0}};
  CHECK_FALSE(fit_rigid(square, mirrored, four));  // any yaw is as good
}

}  // namespace globalmatch::test_rigid_fit
