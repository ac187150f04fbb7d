#include "globalmatch/evaluation.hpp"

#include <limits>
#include <numbers>

#include "catch.hpp"
#include "position_types.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_evaluation {

using namespace detail;

using scenes::positions;

namespace {

const positions one_point = {{3, 4, 5}};

Eigen::Isometry3d turned(double angle, const Eigen::Vector3d& axis) {
  return Eigen::Isometry3d(Eigen::AngleAxisd(angle, axis.normalized()));
}

}  // namespace

TEST_CASE("e_R equals the angle between the rotations, Eq. 8, down to 1e-9 rad") {
  const Eigen::Isometry3d truth = turned(0.7, {1, 2, 3});
  for (const double angle : {1e-9, 1e-6, 0.01, 1.0, 3.1})
    for (const Eigen::Vector3d& axis : {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(1, -2, 0.5)}) {
      const auto error = evaluate_registration(truth * turned(angle, axis), truth, one_point);
      CHECK(std::abs(error.rotation - angle) < 1e-14 + 1e-12 * angle);
    }
  CHECK(
      evaluate_registration(turned(std::numbers::pi, {0, 0, 1}), turned(0, {0, 0, 1}), one_point).rotation ==
      Approx(std::numbers::pi));
}

TEST_CASE("a transform without error has none") {
  random_source random(1);
  const Eigen::Isometry3d truth = scenes::random_levelled_transform(random);
  const auto error = evaluate_registration(truth, truth, scenes::random_stems(random, 20, 30, 30));
  CHECK(error.rotation < 1e-15);
  CHECK(error.translation == 0);
  CHECK(error.pointwise == 0);
  CHECK(error.horizontal == 0);
  CHECK(error.vertical == 0);
  CHECK(error.success());
}

TEST_CASE("e_t and e_p of a shift are its length, with the parts across and along up") {
  random_source random(2);
  const positions points = scenes::random_stems(random, 20, 30, 30);
  const Eigen::Isometry3d truth = scenes::random_levelled_transform(random);
  Eigen::Isometry3d estimate = truth;
  estimate.translation() += Eigen::Vector3d(0.3, 0.4, -1.2);
  scenes::for_each_type_with_heights(points, [&](const char* name, const auto& range) {
    INFO(name);
    const auto error = evaluate_registration(estimate, truth, range);
    CHECK(error.translation == Approx(1.3));
    CHECK(error.pointwise == Approx(1.3));
    CHECK(error.horizontal == Approx(0.5));
    CHECK(error.vertical == Approx(1.2));
    CHECK(error.rotation < 1e-12);
  });
  const auto along_x = evaluate_registration(estimate, truth, points, Eigen::Vector3d(-2, 0, 0));
  CHECK(along_x.vertical == Approx(0.3));
  CHECK(along_x.horizontal == Approx(std::hypot(0.4, 1.2)));
}

TEST_CASE("e_p is the mean distance of the points, Eq. 10") {
  const positions points = {{1, 0, 0}, {0, 3, 0}, {0, 0, 7}};
  const auto error =
      evaluate_registration(turned(std::numbers::pi / 2, {0, 0, 1}), Eigen::Isometry3d::Identity(), points);
  CHECK(error.pointwise == Approx((std::sqrt(2) + 3 * std::sqrt(2) + 0) / 3));
  CHECK(error.horizontal == Approx(error.pointwise));
  CHECK(error.vertical == Approx(0).margin(1e-12));
}

TEST_CASE("points that are not finite do not count, and no points give no pointwise error") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Eigen::Isometry3d estimate = Eigen::Isometry3d::Identity();
  estimate.translation().x() = 2;
  const positions with_nan = {{1, 2, 3}, {nan, 0, 0}, {4, 5, 6}};
  CHECK(evaluate_registration(estimate, Eigen::Isometry3d::Identity(), with_nan).pointwise == Approx(2));
  for (const positions& points : {positions{}, positions{{0, nan, 0}}}) {
    const auto error = evaluate_registration(estimate, Eigen::Isometry3d::Identity(), points);
    CHECK(error.pointwise == 0);
    CHECK(error.translation == 2);
  }
}

TEST_CASE("an up without direction is refused") {
  const Eigen::Isometry3d convergence_threshold = Eigen::Isometry3d::Identity();
  CHECK_THROWS_AS(evaluate_registration(convergence_threshold, convergence_threshold, one_point,
                                        Eigen::Vector3d(0, 0, 0)),
                  std::invalid_argument);
}

TEST_CASE("a registration succeeds below half a metre, or below what is asked") {
  registration_error error;
  error.pointwise = 0.4999;
  CHECK(error.success());
  CHECK_FALSE(error.success(0.1));
  error.pointwise = 0.5;
  CHECK_FALSE(error.success());
}

TEST_CASE("score_map pairs one to one, nearest first, strictly within the distance") {
  const positions truth = {{0, 0, 0}, {10, 0, 0}, {20, 0, 0}, {30, 0, 0}};
  const positions found = {{0.2, 0, 1}, {0.125, 0, 3}, {10.25, 0, 0}, {50, 50, 0}, {20, 0, -2}};
  const map_score score = score_map(found, truth);
  CHECK(score.found == 5);
  CHECK(score.true_finds == 2);
  CHECK(score.required == 4);
  CHECK(score.required_found == 2);
  CHECK(score.horizontal_error == Approx(0.0625));
  CHECK(score.height_error == Approx(2.5));
  CHECK(score.precision() == Approx(2.0 / 5));
  CHECK(score.recall() == Approx(2.0 / 4));
  CHECK(score.f1() == Approx(4.0 / 9));
  CHECK(score_map(found, truth, 0.26).true_finds == 3);
}

TEST_CASE("score_map takes positions of any type, and heights do not count in pairing") {
  random_source random(3);
  const positions truth = scenes::random_stems(random, 30, 60, 60);
  positions found = scenes::jittered(truth, 0.1, random);
  for (Eigen::Vector3d& p : found) p.z() += 7;
  found.resize(24);
  const auto check = [&](const char* name, const auto& range) {
    INFO(name);
    const map_score score = score_map(found, range);
    CHECK(score.true_finds == 24);
    CHECK(score.precision() == 1);
    CHECK(score.recall() == Approx(0.8));
  };
  scenes::for_each_type_with_heights(truth, check);
  scenes::for_each_type_without_heights(truth, check);
}

TEST_CASE("recall counts the required stems alone, precision any true stem") {
  const positions truth = {{0, 0, 0}, {10, 0, 0}, {20, 0, 0}};
  const positions found = {{0, 0, 0}, {10, 0, 0}};
  const map_score score = score_map(found, truth, 0.25, [](std::size_t i) { return i != 1; });
  CHECK(score.true_finds == 2);
  CHECK(score.precision() == 1);
  CHECK(score.required == 2);
  CHECK(score.required_found == 1);
  CHECK(score.recall() == Approx(0.5));
}

TEST_CASE("two finds at one stem are one true find") {
  const positions truth = {{0, 0, 0}}, found = {{0.1, 0, 0}, {-0.1, 0, 0}};
  CHECK(score_map(found, truth).true_finds == 1);
  CHECK(score_map(found, truth).precision() == Approx(0.5));
}

TEST_CASE("empty maps have scores, not divisions by zero") {
  const positions none, one = {{0, 0, 0}};
  CHECK(score_map(none, none).f1() == 1);
  CHECK(score_map(one, none).precision() == 0);
  CHECK(score_map(one, none).recall() == 1);
  CHECK(score_map(one, none).f1() == 0);
  CHECK(score_map(none, one).recall() == 0);
  CHECK(score_map(none, one).f1() == 0);
  CHECK(score_map(none, one).horizontal_error == 0);
  CHECK(map_score{.found = 1, .required = 1}.f1() == 0);
}

TEST_CASE("score_map refuses a distance that is not positive") {
  const positions none;
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()})
    CHECK_THROWS_WITH(score_map(none, none, bad), Catch::Contains("distance"));
}

TEST_CASE("finds are paired with true stems one to one, the nearest first") {
  const positions truth = {{0, 0, 0}, {1, 0, 0}, {5, 5, 0}}, found = {{0.9, 0, 2}, {0.7, 0, 0}, {8, 8, 0}};
  const auto pairs = pair_finds(found, truth, 0.75);
  REQUIRE(pairs.size() == 2);
  CHECK((pairs[0].find == 0 && pairs[0].stem == 1));
  CHECK((pairs[1].find == 1 && pairs[1].stem == 0));
  CHECK(pair_finds(found, positions{}).empty());
  CHECK_THROWS_AS(pair_finds(found, truth, 0), std::invalid_argument);
}

TEST_CASE("a found stem is counted as found where it is required, in whatever order both maps are") {
  const positions truth = {{0, 0, 0}, {10, 0, 0}, {20, 0, 0}, {30, 0, 0}, {40, 0, 0}};
  const positions found = {{40, 0.1, 0}, {10, -0.1, 0}, {0.1, 0, 0}};
  const auto required = [&](std::size_t only) {
    return score_map(found, truth, 0.25, [&](std::size_t i) { return i == only; }).required_found;
  };
  CHECK((required(0) == 1 && required(1) == 1 && required(4) == 1));
  CHECK((required(2) == 0 && required(3) == 0));
}

}  // namespace globalmatch::test_evaluation
