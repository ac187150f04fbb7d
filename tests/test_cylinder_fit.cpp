#include "globalmatch/detail/mapping/cylinder_fit.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "catch.hpp"
#include "cylinder_scenes.hpp"
#include "forest_scenes.hpp"
#include "leaning_stems.hpp"

namespace globalmatch::test_cylinder_fit {

using namespace detail;

using Vector3d = vec3;
using scenes::axis_error;
using scenes::leaning;
using scenes::leaning_cylinder;
using scenes::on_surface;
using scenes::oriented_points;
using scenes::points_on;
using scenes::seen_surface;
using scenes::upright;

namespace {

using matrix6 = Eigen::Matrix<double, 6, 6>;
constexpr double half_round = std::numbers::pi;

/// Covariance of the parameters of a cylinder from derivatives of `surface_distance` by small differences.
matrix6 numeric_covariance(const cylinder& c, const std::vector<vec3>& points, double sigma,
                           const cylinder_options& options) {
  const vec3 u = c.axis.unit_orthogonal(), v = c.axis.cross(u);
  const auto changed = [&](int parameter, double by) {
    cylinder other = c;
    if (parameter == 0) other.point += by * u;
    if (parameter == 1) other.point += by * v;
    if (parameter == 2) other.axis = (c.axis + by * u).normalized();
    if (parameter == 3) other.axis = (c.axis + by * v).normalized();
    if (parameter == 4) other.radius += by;
    if (parameter == 5) other.taper += by;
    return other;
  };
  matrix6 normal = matrix6::Zero();
  for (const vec3& p : points) {
    Eigen::Matrix<double, 6, 1> row;
    constexpr double step = 1e-6;
    for (int k = 0; k < 6; ++k)
      row[k] = (changed(k, step).surface_distance(p) - changed(k, -step).surface_distance(p)) / (2 * step);
    normal += row * row.transpose();
  }
  normal += 1e-6 * double(points.size()) * matrix6::Identity();
  normal(5, 5) += options.taper_weight;
  return sigma * sigma * normal.inverse();
}

}  // namespace

TEST_CASE("refining pulls a rough cylinder onto its points, and leaves outliers aside") {
  random_source random(6);
  const cylinder truth = leaning(5, 6, 0, 0.15, 8, 120);
  oriented_points seen = on_surface(random, truth, 500, {.arc = half_round});
  seen.points.push_back(truth.point + Vector3d{0.5, 0.5, 1});
  cylinder rough = truth;
  rough.point += Vector3d{0.005, -0.004, 0};
  rough.axis = (rough.axis + Vector3d{0.004, 0.003, 0}).normalized();
  rough.radius += 0.004;
  const auto found = refine_cylinder(rough, seen.points, 0.03, {});
  REQUIRE(found);
  CHECK(axis_error(truth, *found) < 1e-6);
  CHECK(found->radius == Approx(truth.radius).margin(1e-6));
}

TEST_CASE("refining gives nothing for few points, far ones, and none") {
  random_source random(7);
  const cylinder truth = upright(0, 0, 0, 0.15);
  const std::vector<Vector3d> few = on_surface(random, truth, 5, {}).points;
  CHECK_FALSE(refine_cylinder(truth, few, 0.03, {}));
  CHECK_FALSE(refine_cylinder(truth, {}, 0.03, {}));
  CHECK_FALSE(refine_cylinder(upright(2, 0, 0, 0.15), on_surface(random, truth, 100, {}).points, 0.03, {}));
}

TEST_CASE("the uncertainty of an axis grows as less of the round is seen, and with the noise") {
  random_source random(8);
  const cylinder truth = upright(0, 0, 0, 0.15);
  double last = 0;
  for (const double arc : {2 * half_round, half_round, half_round / 2, half_round / 6}) {
    const double sigma = axis_uncertainty(
        cylinder_covariance(truth, on_surface(random, truth, 300, {.arc = arc}).points, 0.003));
    CHECK(sigma > last);
    last = sigma;
  }
  const std::vector<Vector3d> points = on_surface(random, truth, 300, {.arc = half_round}).points;
  CHECK(axis_uncertainty(cylinder_covariance(truth, points, 0.006)) ==
        Approx(2 * axis_uncertainty(cylinder_covariance(truth, points, 0.003))));
}

TEST_CASE("the uncertainties of an axis and a radius are the standard deviations of their fits") {
  constexpr double noise = 0.003;
  constexpr int repetitions = 200;
  const cylinder truth = upright(0, 0, 1.5, 0.15);
  const seen_surface seen{.from = -1.5, .to = 1.5, .arc = half_round, .noise = noise};
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  double predicted = 0, squares = 0, radius_predicted = 0;
  for (int i = 0; i < repetitions; ++i) {
    random_source random(9, std::uint64_t(i));
    const std::vector<Vector3d> points = on_surface(random, truth, 200, seen).points;
    const auto found = refine_cylinder(truth, points, 0.03, {});
    REQUIRE(found);
    const Eigen::Vector2d error =
        to_eigen((found->at_height(found->point.z) - truth.at_height(found->point.z)).xy());
    covariance += error * error.transpose() / repetitions;
    const small_matrix estimated = cylinder_covariance(*found, points, noise);
    predicted += axis_uncertainty(estimated) / repetitions;
    squares += std::pow(found->radius - truth.radius, 2) / repetitions;
    radius_predicted += radius_uncertainty(estimated) / repetitions;
  }
  const double half = (covariance(0, 0) - covariance(1, 1)) / 2;
  const double largest = covariance.trace() / 2 + std::hypot(half, covariance(0, 1));
  CHECK(std::sqrt(largest) == Approx(predicted).epsilon(0.25));
  CHECK(std::sqrt(squares) == Approx(radius_predicted).epsilon(0.25));
}

TEST_CASE("a radius is less sure beyond the points it was seen by, where taper is not known") {
  random_source random(10);
  const cylinder truth = upright(0, 0, 1.5, 0.15);
  const auto seen = on_surface(random, truth, 300, {.from = -1, .to = 1, .noise = 0.003});
  const auto covariance = cylinder_covariance(truth, seen.points, 0.003, {.usual_taper = 0.005});
  CHECK(radius_uncertainty(covariance, 3) > 2 * radius_uncertainty(covariance, 0));
  CHECK(radius_uncertainty(cylinder_covariance(truth, seen.points, 0.003), 3) ==
        Approx(radius_uncertainty(cylinder_covariance(truth, seen.points, 0.003), 0)).epsilon(0.01));
}

TEST_CASE("the covariance of a cylinder is that of its linearised surface distances") {
  random_source random(2);
  const cylinder c = leaning_cylinder();
  const auto points = points_on(c, 400, -0.4, 1.9, 2.1, random);  // one side, and not about the point
  const cylinder_options options{.usual_taper = 0.01, .taper_weight = 5};
  const matrix6 expected = numeric_covariance(c, points, 0.007, options);
  const small_matrix covariance = cylinder_covariance(c, points, 0.007, options);
  for (int row = 0; row < 6; ++row)
    for (int column = 0; column < 6; ++column) {
      CAPTURE(row, column);
      CHECK(covariance(std::size_t(row), std::size_t(column)) ==
            Approx(expected(row, column))
                .epsilon(0.005)
                .margin(1e-3 * std::sqrt(expected(row, row) * expected(column, column))));
    }
}

TEST_CASE("uncertainties along a stem are those of the linearised axis and radius") {
  random_source random(3);
  const cylinder c = leaning_cylinder();
  const auto points = points_on(c, 300, -0.2, 2.4, 1.7, random);
  const small_matrix covariance =
      cylinder_covariance(c, points, 0.01, {.usual_taper = 0.01, .taper_weight = 5});
  matrix6 all;
  for (int row = 0; row < 6; ++row)
    for (int column = 0; column < 6; ++column)
      all(row, column) = covariance(std::size_t(row), std::size_t(column));
  for (const double along : {-1.5, 0.0, 0.8, 3.0}) {
    CAPTURE(along);
    Eigen::Matrix<double, 6, 1> radius;
    radius << 0, 0, 0, 0, 1, -along;
    CHECK(radius_uncertainty(covariance, along) == Approx(std::sqrt(radius.dot(all * radius))));
    double worst = 0;
    for (int k = 0; k < 3600; ++k) {
      const double angle = k * std::numbers::pi / 3600, x = std::cos(angle), y = std::sin(angle);
      Eigen::Matrix<double, 6, 1> shift;
      shift << x, y, along * x, along * y, 0, 0;
      worst = std::max(worst, std::sqrt(shift.dot(all * shift)));
    }
    CHECK(axis_uncertainty(covariance, along) == Approx(worst).epsilon(1e-4));
  }
}

TEST_CASE("a refined cylinder is the one that its points lie on, its taper too") {
  random_source random(4);
  const cylinder truth = leaning_cylinder();
  const auto points = points_on(truth, 500, -1, 2, 3, random);
  cylinder start = truth;
  start.point += vec3{0.02, -0.015, 0.7};
  start.axis = (start.axis + vec3{0.02, 0.01, 0}).normalized();
  start.radius += 0.02;
  start.taper = 0;
  const auto free = refine_cylinder(start, points, 0.1, {.usual_taper = 0.0, .taper_weight = 1e-6});
  REQUIRE(free);
  for (const vec3& p : points) CHECK(std::abs(free->surface_distance(p)) < 1e-4);
  CHECK(free->taper == Approx(truth.taper).epsilon(0.01));
  CHECK(free->axis.dot(truth.axis) > 1 - 1e-7);
  const auto held = refine_cylinder(start, points, 0.1, {.usual_taper = 0.03, .taper_weight = 1e7});
  REQUIRE(held);
  CHECK(held->taper == Approx(0.03).epsilon(0.001));
}

}  // namespace globalmatch::test_cylinder_fit
