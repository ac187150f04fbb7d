// Formulas of matching against oracles: unequal sigmas, full covariances, maps that are not symmetric.
#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <numbers>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "globalmatch/detail/matching/background_density.hpp"
#include "globalmatch/detail/matching/decision.hpp"
#include "globalmatch/detail/matching/evidence.hpp"
#include "globalmatch/detail/matching/null_model.hpp"
#include "globalmatch/detail/matching/planting_lattice.hpp"
#include "globalmatch/detail/matching/residual_null_model.hpp"
#include "globalmatch/detail/matching/robust_fit.hpp"
#include "globalmatch/detail/matching/uncertainty.hpp"
#include "globalmatch/detail/matching/verify.hpp"

namespace globalmatch {

using namespace detail;

namespace {

constexpr auto four_dof = degrees_of_freedom::four, six_dof = degrees_of_freedom::six;

/// Stems on a strip far from the origin, denser at one end, on a slope.
position_set uneven_stems(std::size_t count, random_source& random) {
  position_set set;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = 60 * std::pow(random.uniform(), 2), y = 25 * random.uniform();
    set.at.push_back({300 + x, -80 + y, 12 + 0.2 * x - 0.1 * y + random.normal()});
    set.original.push_back(static_cast<stem_index>(i));
  }
  return set;
}

position_set transformed_stems(const rigid& transform, const position_set& stems) {
  position_set result = stems;
  for (vec3& p : result.at) p = transform * p;
  return result;
}

rigid some_transform() {
  return {rotation_about_z(0.8), {-40, 70, 5}};
}

/// A hypothesis that pairs stem i with stem i.
local_hypothesis pairing_all(std::size_t count, const rigid& transform) {
  local_hypothesis h;
  h.target_from_source = transform;
  h.inlier_threshold = 1;
  for (stem_index i = 0; i < count; ++i) h.correspondences.push_back({i, i});
  return h;
}

}  // namespace

TEST_CASE("the tests of the NFA are two source stems and target stems as far apart, at each threshold") {
  random_source random(101);
  const position_set source = uneven_stems(50, random), target = uneven_stems(300, random);
  for (const auto dof : {four_dof, six_dof}) {
    const matching_context maps(source, target, dof == four_dof, dof);
    const background_density density(target, maps.target_index);
    const std::vector<double> thresholds = {0.05, 0.1, 0.2};
    const null_model null(maps, thresholds);
    const double apart = std::min(extent(source), density.extent()) / 2, radius = density.stem_radius();
    const double as_far = 4 * apart * 0.1 / (radius * radius);
    REQUIRE(as_far < 300);
    const double by_two = 300 * as_far * 50.0 * 50.0 / 2;
    const double tests = 3 * (dof == four_dof ? by_two : by_two * 50 * as_far);
    CHECK(null.log10_nfa({}, 0.1) == Approx(std::log10(tests)));
  }
}

TEST_CASE("being as near by chance grows with the area between two thresholds") {
  random_source random(102);
  const position_set target = uneven_stems(200, random);
  const position_set source = transformed_stems({mat3::identity(), {0.22, 0, 3}}, target);
  const matching_context maps(source, target, true, four_dof);
  const std::vector<double> thresholds = {0.1, 0.3};
  const null_model null(maps, thresholds);
  const auto set = null.residuals_under(rigid::identity(), 0.3, 0.3);
  REQUIRE(set.residuals.size() > 150);
  const double low = null.inlier_probability(0.1), high = null.inlier_probability(0.3);
  double sum = 0;
  for (std::size_t i = 0; i < set.residuals.size(); ++i) {
    const double squared = set.residuals[i] * set.residuals[i];
    sum += squared < 0.01 ? low * squared / 0.01 : low + (high - low) * (squared - 0.01) / 0.08;
    CHECK(set.cumulative_probability[i] == Approx(sum));
  }
}

TEST_CASE("stems of other heights than most are no inliers, and the median of the rest is the offset") {
  random_source random(103);
  const position_set source = uneven_stems(41, random);
  position_set target = transformed_stems({mat3::identity(), {0.01, 0.02, 6}}, source);
  for (std::size_t i = 0; i < 41; ++i) target.at[i].z += i < 5 ? 2.5 : i < 10 ? -2.5 : 0.02 * double(i % 7);
  const matching_context maps(source, target, false, four_dof, 1);
  const auto set = null_model(maps).residuals_under(rigid::identity(), 0.1, 0.05);
  CHECK(set.residuals.size() == 31);
  std::vector<double> offsets;
  for (std::size_t i = 0; i < 41; ++i) offsets.push_back(target.at[i].z - source.at[i].z);
  std::sort(offsets.begin(), offsets.end());
  CHECK(set.vertical_offset == Approx(offsets[20]));
}

TEST_CASE("the variance of a pair is the sum of the squares of both sigmas") {
  random_source random(104);
  position_set source = uneven_stems(8, random), target = source;
  source.sigma = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8};
  const matching_context one(source, target, false, four_dof);
  CHECK(known_variance(one, {2, 5}) == Approx(0.09));
  target.sigma = {0.01, 0.02, 0.03, 0.04, 0.05, 0.5, 0.07, 0.08};
  const matching_context both(source, target, false, four_dof);
  CHECK(known_variance(both, {2, 5}) == Approx(0.09 + 0.25));
}

TEST_CASE("robust weights are Tukey's over the variance of each pair") {
  random_source random(105);
  position_set source = uneven_stems(30, random);
  position_set target = transformed_stems(some_transform(), source);
  for (std::size_t i = 0; i < 30; ++i) {
    source.sigma.push_back(0.02 + 0.005 * double(i));
    target.at[i] += {0.3 * random.normal(), 0.1 * random.normal(), 0};
  }
  const matching_context maps(source, target, false, four_dof, 10);
  const local_hypothesis h = pairing_all(30, some_transform());
  const double unknown = 0.0004;
  const auto weights = robust_weights(maps, h, unknown);
  std::size_t zeros = 0;
  for (std::size_t i = 0; i < 30; ++i) {
    const double variance = source.sigma[i] * source.sigma[i] + unknown;
    const double distance = (some_transform() * source.at[i] - target.at[i]).xy().norm();
    const double share = distance / (4.685 * std::sqrt(variance));
    const double expected = share < 1 ? std::pow(1 - share * share, 2) / variance : 0;
    zeros += expected == 0;
    CHECK(weights[i] == Approx(expected));
  }
  CHECK(zeros > 3);
  CHECK(zeros < 27);
}

TEST_CASE("the observed variance is that of the noise of a coordinate, from many pairs or few") {
  random_source random(106);
  for (const auto dof : {four_dof, six_dof})
    for (const std::size_t count : {8u, 60u}) {
      CAPTURE(int(dof), count);
      constexpr int trials = 400;
      double mean = 0;
      const position_set source = uneven_stems(count, random);
      for (int trial = 0; trial < trials; ++trial) {
        position_set target = transformed_stems(some_transform(), source);
        for (vec3& p : target.at) p += 0.05 * vec3{random.normal(), random.normal(), random.normal()};
        const matching_context maps(source, target, false, dof, 10);
        local_hypothesis h = pairing_all(count, some_transform());
        h.target_from_source = *maps.fit(h.correspondences);
        mean += observed_variance(maps, h) / trials;
      }
      CHECK(mean == Approx(0.05 * 0.05).epsilon(count == 8 ? 0.3 : 0.08));
    }
}

TEST_CASE("what the known variances leave of the observed one is unknown") {
  random_source random(107);
  position_set source = uneven_stems(400, random);
  position_set target = transformed_stems(some_transform(), source);
  for (vec3& p : target.at) p += 0.1 * vec3{random.normal(), random.normal(), random.normal()};
  source.sigma.assign(400, 0.06);
  const matching_context maps(source, target, false, four_dof, 10);
  const local_hypothesis h = pairing_all(400, some_transform());
  CHECK(unknown_variance(maps, h) == Approx(0.1 * 0.1 - 0.06 * 0.06).epsilon(0.15));
  source.sigma.assign(400, 0.2);
  CHECK(unknown_variance(maps, h) == Approx(0.1 * observed_variance(maps, h)));
}

TEST_CASE("the variance of the height is that of a median of as many offsets") {
  random_source random(108);
  constexpr std::size_t count = 30;
  constexpr int trials = 2000;
  const position_set source = uneven_stems(count, random);
  double squares = 0, expected = 0;
  for (int trial = 0; trial < trials; ++trial) {
    position_set target = transformed_stems(some_transform(), source);
    for (vec3& p : target.at) p.z += 0.2 * random.normal();
    const matching_context maps(source, target, false, four_dof, 10);
    local_hypothesis h = pairing_all(count, some_transform());
    h.target_from_source = *maps.fit(h.correspondences);
    squares += std::pow(h.target_from_source.translation.z - some_transform().translation.z, 2) / trials;
    expected += variance_of_height(h, maps) / trials;
  }
  CHECK(expected == Approx(squares * 29.0 / 27.0).epsilon(0.15));  // Student's t makes it so much larger
}

TEST_CASE("the covariance of a transform is that of weighted least squares over its linearised motion") {
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
  const Eigen::Matrix3d back = to_eigen(frame.rotation).transpose();
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

TEST_CASE(
    "the displacement of two transforms holds their turn, and no point within the radius moves farther") {
  random_source random(111);
  const vec3 center{50, -30, 2};
  const rigid a = some_transform();
  for (int i = 0; i < 50; ++i) {
    const rigid b = shifted_after(a, {random.normal(), random.normal(), 0}) *
                    rigid::turn_about(center, 0.3 * random.normal());
    const double bound = displacement(a, b, center, 20);
    double largest = 0;
    for (int k = 0; k < 360; ++k) {
      const double angle = k * std::numbers::pi / 180;
      const vec3 p = center + 20 * vec3{std::cos(angle), std::sin(angle), 0};
      largest = std::max(largest, (a * p - b * p).norm());
    }
    CHECK(bound >= largest * (1 - 1e-9));
    CHECK(bound < 1.5 * largest + 0.5);
  }
}

TEST_CASE("the background density is that of the sixth neighbour of each stem") {
  random_source random(112);
  const position_set stems = uneven_stems(150, random);
  const background_density density(stems, std::make_shared<position_index>(stems));
  std::vector<double> densities;
  for (std::size_t i = 0; i < stems.size(); ++i) {
    std::vector<double> squares;
    for (std::size_t j = 0; j < stems.size(); ++j)
      if (j != i) squares.push_back((stems.at[i] - stems.at[j]).xy().squared_norm());
    std::sort(squares.begin(), squares.end());
    densities.push_back(5 / (std::numbers::pi * squares[5]));
  }
  for (const double threshold : {0.1, 0.5, 2.0}) {
    double mean = 0;
    for (const double d : densities)
      mean += (1 - std::exp(-d * std::numbers::pi * threshold * threshold)) / double(densities.size());
    CHECK(density.poisson_inlier_probability(threshold) == Approx(mean));
  }
  std::sort(densities.begin(), densities.end());
  const double middle = (densities[74] + densities[75]) / 2;
  CHECK(density.stem_radius() == Approx(1 / std::sqrt(std::numbers::pi * middle)));
  CHECK(density.extent() == Approx(std::max(middle_extent(stems, 0), middle_extent(stems, 1)) / 0.8));
}

TEST_CASE("residuals count by the logarithm of the share of known ones that are larger") {
  std::vector<std::vector<float>> known(1);
  for (int i = 0; i < 2000; ++i) known[0].push_back(float((i * 769 % 2000) + 1));
  const residual_null_model model(known);
  std::vector<float> asked;
  double surprisal = 0;
  for (int i = 0; i < 20; ++i) {
    asked.push_back(float(20 * i + 10));
    surprisal += -std::log(1 - (20.0 * i + 10) / 2001);
  }
  for (const double fitted : {0.0, 1.5})
    CHECK(model.log_probability(asked, fitted) ==
          Approx(log_gamma_tail(surprisal, 20 - fitted)).epsilon(0.01));
}

TEST_CASE("residuals that go together in the known transforms make a good fit less improbable") {
  random_source random(113);
  std::vector<std::vector<float>> known;
  std::vector<double> factors;
  for (int i = 0; i < 200; ++i) {
    const double scale = std::exp(0.5 * random.normal());
    known.emplace_back();
    for (int k = 0; k < 40; ++k) known.back().push_back(float(-scale * std::log(1 - random.uniform())));
  }
  const residual_null_model model(known);
  int improbable = 0;
  for (int i = 0; i < 2000; ++i) {
    const double scale = std::exp(0.5 * random.normal());
    std::vector<float> residuals;
    for (int k = 0; k < 40; ++k) residuals.push_back(float(-scale * std::log(1 - random.uniform())));
    improbable += model.log_probability(residuals, 0) < std::log(0.05);
  }
  CHECK(improbable > 0.02 * 2000);
  CHECK(improbable < 0.09 * 2000);
}

TEST_CASE("the tilt that is certain is the fitted slope less three of its deviations") {
  random_source random(114);
  const position_set source = uneven_stems(25, random);
  position_set target = transformed_stems(some_transform(), source);
  for (vec3& p : target.at) p.z += 0.12 * p.x - 0.05 * p.y + 3 + 0.15 * random.normal();
  const matching_context maps(source, target, false, four_dof, 100);
  const local_hypothesis h = pairing_all(25, some_transform());
  Eigen::MatrixXd rows(25, 3);
  Eigen::VectorXd offsets(25);
  for (int i = 0; i < 25; ++i) {
    const vec3& t = target.at[std::size_t(i)];
    rows.row(i) << 1, t.x - 300, t.y + 80;
    offsets[i] = t.z - (some_transform() * source.at[std::size_t(i)]).z;
  }
  const Eigen::Vector3d plane = rows.colPivHouseholderQr().solve(offsets);
  const double variance = (rows * plane - offsets).squaredNorm() / (25 - 3 - 2);
  const Eigen::Matrix3d inverse = (rows.transpose() * rows).inverse();
  const Eigen::Vector2d slope = plane.tail<2>(), direction = slope.normalized();
  const double doubt = std::sqrt(variance * direction.dot(inverse.bottomRightCorner<2, 2>() * direction));
  REQUIRE(slope.norm() > 4 * doubt);
  CHECK(certain_tilt(h, maps) == Approx(std::atan(slope.norm() - 3 * doubt)).epsilon(1e-6));
}

TEST_CASE("the spread across a line of stems is the smallest in any direction") {
  random_source random(115);
  position_set source = uneven_stems(40, random);
  for (vec3& p : source.at) p.y += 0.7 * p.x;
  const double sigma = minor_axis_sigma(pairing_all(40, rigid::identity()), source);
  double smallest = 1e9;
  for (int k = 0; k < 3600; ++k) {
    const double angle = k * std::numbers::pi / 3600, x = std::cos(angle), y = std::sin(angle);
    double sum = 0, squares = 0;
    for (const vec3& p : source.at) {
      const double across = (p.x - 300) * x + (p.y + 80) * y;
      sum += across / 40;
      squares += across * across / 40;
    }
    smallest = std::min(smallest, std::sqrt(squares - sum * sum));
  }
  CHECK(sigma == Approx(smallest).epsilon(1e-4));
}

TEST_CASE("the lead of a hypothesis is what the next one's NFA is above its own, between 0 and 8") {
  const auto of = [](std::vector<double> log10_nfas) {
    std::vector<local_hypothesis> all;
    for (const double nfa : log10_nfas) {
      all.emplace_back();
      all.back().log10_nfa = nfa;
    }
    return features_of(all);
  };
  CHECK(of({-5, -3.5}).lead == Approx(1.5));
  CHECK(of({-5, 9}).lead == 8);
  CHECK(of({-5}).lead == 8);
  CHECK(of({-30, -29}).log10_nfa == -12);
  CHECK(of({-5, -3.5}).log10_nfa == -5);
}

TEST_CASE("evidence of another kind counts where it is significant and the smaller NFA") {
  const auto combined = [](double own, double other) {
    local_hypothesis h;
    h.log10_nfa = own;
    combine(h, {other, evidence_source::gaps});
    return h;
  };
  CHECK(combined(-1, -3).log10_nfa == -3);
  CHECK(combined(-1, -3).evidence == evidence_source::gaps);
  CHECK(combined(-4, -3).log10_nfa == -4);
  CHECK(combined(-4, -3).evidence == evidence_source::positions);
  CHECK(combined(3, -1.9).log10_nfa == 3);
}

TEST_CASE("a skewed lattice maps to itself by whole steps along both shifts, and by half a turn alone") {
  const lattice_shifts skewed{{2.1, 0.4}, {0.7, 2.9}};
  CHECK(skewed.is_lattice_shift(3 * skewed.first - 2 * skewed.second));
  CHECK_FALSE(skewed.is_lattice_shift(1.5 * skewed.first));
  CHECK_FALSE(skewed.is_lattice_shift(skewed.first + 0.5 * skewed.second));
  CHECK(skewed.turns().size() == 2);
  CHECK(skewed.angle() == Approx(std::atan2(2.9, 0.7) - std::atan2(0.4, 2.1)));
  CHECK(skewed.direction() == Approx(std::atan2(0.4, 2.1)));
  const lattice_shifts square{{1.2, 1.6}, {-1.6, 1.2}};
  CHECK(square.turns().size() == 4);
  const lattice_shifts triangular{{2, 0}, {1, std::sqrt(3.0)}};
  CHECK(triangular.turns().size() == 6);
  const lattice_shifts flat{{3, 0}, {2.4, 0.9}};  // the third side is the shortest
  CHECK(flat.search_radius() == Approx(0.3 * std::hypot(0.6, 0.9)));
}

}  // namespace globalmatch
