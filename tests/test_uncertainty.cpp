#include "globalmatch/detail/matching/uncertainty.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <limits>

#include "catch.hpp"
#include "globalmatch/detail/core/eigen_border.hpp"
#include "noisy_match.hpp"
#include "uneven_stems.hpp"

namespace globalmatch::test_uncertainty {

using namespace detail;

using scenes::four_dof;
using scenes::pairing_all;
using scenes::some_transform;
using scenes::transformed_stems;
using scenes::uneven_stems;

using scenes::noisy_match;
using scenes::reported_uncertainty;

namespace {

using scenes::four;
using scenes::six;
constexpr double quantile_of_two = 5.991, quantile_of_four = 9.488;  // chi squared, 95 %

/// As rows of the covariance: shift of the center, turns.
Eigen::VectorXd as_vector(const Eigen::Isometry3d& error, const transform_uncertainty& u) {
  const Eigen::AngleAxisd turn(error.linear());
  Eigen::VectorXd v(u.covariance.rows());
  v.head<3>() = error * u.center - u.center;
  const Eigen::Vector3d turns = turn.angle() * turn.axis();
  if (v.size() == 4)
    v[3] = turns.dot(u.up);
  else
    v.tail<3>() = turns;
  return v;
}

double squared_deviations(const Eigen::VectorXd& off, const Eigen::MatrixXd& covariance) {
  return off.dot(covariance.ldlt().solve(off));
}

}  // namespace

TEST_CASE("the 95 % ellipse holds the truth in 92 to 98 of 100, with few pairs and many") {
  constexpr int trials = 2000;
  for (const degrees_of_freedom dof : {four, six})
    for (const std::size_t pairs : {5u, 10u, 30u, 100u}) {
      random_source random(pairs);
      int whole = 0, at_center = 0, far_away = 0;
      for (int i = 0; i < trials; ++i) {
        noisy_match match(pairs, dof, 0.05, random);
        fit_robustly(match.best, match.maps);
        const auto u = reported_uncertainty(match);
        REQUIRE(u);
        const auto horizontal_distance = [&](const Eigen::Vector3d& p) {
          const Eigen::Vector2d off = (match.error() * p - p).head<2>();
          return squared_deviations(off, u->at(p).topLeftCorner<2, 2>());
        };
        if (dof == four)
          whole += squared_deviations(as_vector(match.error(), *u), u->covariance) < quantile_of_four;
        at_center += horizontal_distance(u->center) < quantile_of_two;
        far_away += horizontal_distance(u->center + Eigen::Vector3d(40, -30, 2)) < quantile_of_two;
      }
      CAPTURE(int(dof), pairs);
      for (const int held : {dof == four ? whole : at_center, at_center, far_away}) {
        CHECK(held >= 0.92 * trials);
        CHECK(held <= 0.98 * trials);
      }
    }
}

TEST_CASE("the expected error is that of repeated matches, and grows away from the stems") {
  random_source random(3);
  double squares = 0, expected = 0;
  const Eigen::Vector3d away(60, 0, 0);
  for (int i = 0; i < 1000; ++i) {
    noisy_match match(30, four, 0.05, random);
    const auto u = reported_uncertainty(match);
    REQUIRE(u);
    const Eigen::Vector3d p = u->center + away;
    squares += (match.error() * p - p).squaredNorm() / 1000;
    expected += std::pow(u->expected_error(p), 2) / 1000;
    CHECK(u->expected_error(p) > 2 * u->expected_error(u->center));
  }
  CHECK(std::sqrt(expected) == Approx(std::sqrt(squares)).epsilon(0.1));
}

TEST_CASE("the covariance is 4 x 4 in 4-DoF, 6 x 6 in 6-DoF, symmetric and positive") {
  random_source random(4);
  for (const degrees_of_freedom dof : {four, six}) {
    noisy_match match(12, dof, 0.05, random);
    const auto u = reported_uncertainty(match);
    REQUIRE(u);
    REQUIRE(u->covariance.rows() == int(dof));
    CHECK((u->covariance - u->covariance.transpose()).norm() < 1e-12 * u->covariance.norm());
    CHECK(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(Eigen::MatrixXd(u->covariance)).eigenvalues()(0) >
          0);
  }
}

TEST_CASE("stems that are known to be certain count for more") {
  random_source random(5);
  noisy_match match(10, four, 0.05, random);
  const double alike = reported_uncertainty(match)->expected_error({0, 0, 0});
  match.source.sigma.assign(10, 1.0);
  std::fill_n(match.source.sigma.begin(), 5, 1e-3);
  const auto told = reported_uncertainty(match);
  REQUIRE(told);
  CHECK(told->expected_error({0, 0, 0}) != Approx(alike));
}

TEST_CASE("three pairs determine no uncertainty, and horizontal maps none of height") {
  random_source random(6);
  noisy_match three(3, four, 0.05, random);
  CHECK(!reported_uncertainty(three));
  noisy_match flat(10, four, 0.05, random);
  flat.source.has_heights = false;
  const auto u = reported_uncertainty(flat);
  REQUIRE(u);
  CHECK(u->covariance(2, 2) == 1e6);  // a kilometre
  CHECK(u->covariance(0, 0) > 0);
}

TEST_CASE("a new variance of the height leaves what the covariance says of the plan") {
  random_source random(21);
  for (const degrees_of_freedom dof : {four, six}) {
    noisy_match match(14, dof, 0.05, random);
    auto u = reported_uncertainty(match);
    REQUIRE(u);
    u->up = Eigen::Vector3d(0.2, -0.1, 1).normalized();
    const Eigen::Vector3d across = u->up.unitOrthogonal();
    const Eigen::MatrixXd before = u->covariance;
    set_height_variance(*u, 0.09);
    const Eigen::Matrix3d place = u->covariance.topLeftCorner<3, 3>();
    CHECK(u->up.dot(place * u->up) == Approx(0.09));
    CHECK(across.dot(place * across) == Approx(across.dot(before.topLeftCorner<3, 3>() * across)));
    CHECK(across.dot(place * u->up) == Approx(0).margin(1e-12));
  }
}

TEST_CASE("a transform moves within its uncertainty in plan up to the 99.7 % quantile, whatever its height") {
  random_source random(22);
  noisy_match match(14, four, 0.05, random);
  const auto u = reported_uncertainty(match);
  REQUIRE(u);
  const Eigen::Isometry3d from = to_eigen(match.best.target_from_source);
  const double sigma = std::sqrt(u->covariance(0, 0)), turn = std::sqrt(u->covariance(3, 3));
  const auto moved = [&](const Eigen::Vector3d& shift, double angle) {
    const Eigen::Isometry3d by(Eigen::Translation3d(u->center + shift) *
                               Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()) *
                               Eigen::Translation3d(-u->center));
    return moves_within(u, from, by * from);
  };
  CHECK(moved({0, 0, 50}, 0));
  CHECK(moved({2 * sigma, 0, 0}, 0));
  CHECK_FALSE(moved({-6 * sigma, 0, 0}, 0));
  CHECK(moved({0, 0, 0}, 2 * turn));
  CHECK_FALSE(moved({0, 0, 0}, -6 * turn));
  CHECK(moves_within(std::nullopt, from, Eigen::Isometry3d::Identity()));
}

TEST_CASE("in the caller's frame the uncertainty is that of the same transform") {
  random_source random(7);
  for (const degrees_of_freedom dof : {four, six}) {
    noisy_match match(12, dof, 0.05, random);
    const auto u = reported_uncertainty(match);
    REQUIRE(u);
    const local_frame frame{{500000, 5300000, 1000}, levelling_rotation({0.3, -0.2, 1})};
    local_vertical_fit vertical;
    if (dof == four) vertical = fit_vertical(match.best, match.maps, false);
    const transform_uncertainty there =
        in_caller_frame(*uncertainty_of(match.best, match.maps, vertical), frame);
    const Eigen::Vector3d p(12, -7, 3);
    const Eigen::Matrix3d rotation = to_eigen(rigid{frame.rotation, {}}).linear();
    CHECK((rotation * there.at(to_eigen(frame.to_scan(from_eigen(p)))) * rotation.transpose() - u->at(p))
              .norm() < 1e-9 * u->at(p).norm());
    CHECK(there.up.isApprox(Eigen::Vector3d(0.3, -0.2, 1).normalized()));
  }
}

TEST_CASE("the covariance of a transform is that of weighted least squares over small shifts and turns") {
  random_source random(109);
  for (const bool four : {true, false}) {
    const int unknowns = four ? 3 : 6, dimensions = four ? 2 : 3;
    residual_adjustment adjustment(four);
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(unknowns, unknowns);
    double squares = 0;
    constexpr int count = 12;
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector3d arm(3 + 8 * random.uniform(), -5 * random.uniform(), 1 + random.uniform());
      const Eigen::Vector3d residual(0.1 * random.normal(), 0.2 * random.normal(), 0.3 * random.normal());
      const double variance = 0.01 * (1 + i);
      adjustment.add(from_eigen(arm), from_eigen(residual), variance);
      Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(3, unknowns);
      for (int k = 0; k < dimensions; ++k) jacobian(k, k) = 1;
      for (int k = dimensions; k < unknowns; ++k) {
        const Eigen::Vector3d axis = Eigen::Vector3d::Unit(four ? 2 : k - 3);
        jacobian.col(k) = (Eigen::AngleAxisd(1e-6, axis) * arm - Eigen::AngleAxisd(-1e-6, axis) * arm) / 2e-6;
      }
      normal += jacobian.topRows(dimensions).transpose() * jacobian.topRows(dimensions) / variance;
      squares += residual.head(dimensions).squaredNorm() / variance;
    }
    const double degrees = dimensions * count - unknowns;
    const Eigen::MatrixXd expected = degrees / (degrees - 2) * squares / (0.95 * degrees) * normal.inverse();
    const small_matrix covariance = adjustment.covariance();
    for (int r = 0; r < unknowns; ++r)
      for (int c = 0; c < unknowns; ++c)
        CHECK(covariance(std::size_t(r), std::size_t(c)) ==
              Approx(expected(r, c)).margin(1e-6 * std::sqrt(expected(r, r) * expected(c, c))));
  }
}

TEST_CASE("a covariance in the frame of the caller is turned back with its axes") {
  random_source random(110);
  const local_frame frame{{1000, 2000, 30}, levelling_rotation(vec3{0.5, -0.7, 1})};
  const Eigen::Matrix3d back = to_eigen(rigid{frame.rotation, {}}).linear().transpose();
  for (const std::size_t size : {4u, 6u}) {
    local_uncertainty local;
    local.center = {3, -4, 5};
    local.covariance.size = size;
    for (int k = 0; k < 8; ++k) {
      small_vector row{};
      for (std::size_t i = 0; i < size; ++i) row[i] = random.normal();
      local.covariance.add_square(row, 1);
    }
    Eigen::MatrixXd given(size, size),
        turned = Eigen::MatrixXd::Identity(Eigen::Index(size), Eigen::Index(size));
    for (std::size_t r = 0; r < size; ++r)
      for (std::size_t c = 0; c < size; ++c) given(Eigen::Index(r), Eigen::Index(c)) = local.covariance(r, c);
    turned.topLeftCorner<3, 3>() = back;
    if (size == 6) turned.bottomRightCorner<3, 3>() = back;
    const transform_uncertainty there = in_caller_frame(local, frame);
    CHECK((Eigen::MatrixXd(there.covariance) - turned * given * turned.transpose()).norm() < 1e-9);
    CHECK((there.up - Eigen::Vector3d(0.5, -0.7, 1).normalized()).norm() < 1e-12);
  }
}

}  // namespace globalmatch::test_uncertainty
