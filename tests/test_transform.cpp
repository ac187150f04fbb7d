#include "globalmatch/transform.hpp"

#include "catch.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_transform {

using namespace detail;

using scenes::positions;

namespace {

using scenes::four;
using scenes::six;

Eigen::Isometry3d random_transform(random_source& random) {
  Eigen::Isometry3d transform = scenes::random_levelled_transform(random);
  const Eigen::Vector3d axis(random.normal(), random.normal(), random.normal());
  transform.rotate(Eigen::AngleAxisd(scenes::uniform(random, 0, 3), axis.normalized()));
  return transform;
}

positions random_points(random_source& random, std::size_t count) {
  positions points;
  for (std::size_t i = 0; i < count; ++i)
    points.push_back(20 * Eigen::Vector3d(random.uniform(), random.uniform(), random.uniform()));
  return points;
}

void require_rotation(const Eigen::Isometry3d& transform) {
  CHECK(transform.linear().determinant() == Approx(1));
  CHECK((transform.linear() * transform.linear().transpose()).isIdentity(1e-12));
}

}  // namespace

TEST_CASE("fit_transform recovers an exact transform, 4-DoF and 6-DoF") {
  for (std::uint64_t seed = 0; seed < 50; ++seed)
    for (const auto dof : {four, six}) {
      INFO("seed " << seed << ", dof " << int(dof));
      random_source random(seed);
      const positions source = random_points(random, 3 + random.below(10));
      const Eigen::Isometry3d truth =
          dof == four ? scenes::random_levelled_transform(random) : random_transform(random);
      const auto transform = fit_transform(source, scenes::moved(truth, source), dof);
      REQUIRE(transform);
      CHECK(transform->isApprox(truth, 1e-12));
      require_rotation(*transform);
    }
}

TEST_CASE("fit_transform recovers an exact transform of coordinates of a million metres") {
  random_source random(51);
  const positions near = random_points(random, 10);
  const positions source = scenes::moved(scenes::yaw_and_shift(0, {1e6, 5e6, 1e3}), near);
  for (const auto dof : {four, six}) {
    const Eigen::Isometry3d truth = scenes::yaw_and_shift(1, {-4e5, 7e4, 100});
    const auto transform = fit_transform(source, scenes::moved(truth, source), dof);
    REQUIRE(transform);
    CHECK(scenes::max_error(*transform, truth, source) < 1e-6);
  }
}

TEST_CASE("fit_transform leaves no smaller sum of squares to any transform nearby") {
  for (const auto dof : {four, six}) {
    random_source random(52);
    const positions source = random_points(random, 12);
    const positions target =
        scenes::noisy(scenes::moved(scenes::random_levelled_transform(random), source), 0.3, random);
    std::vector<double> weights;
    for (std::size_t i = 0; i < source.size(); ++i) weights.push_back(random.uniform());
    const auto squares = [&](const Eigen::Isometry3d& transform) {
      double sum = 0;
      for (std::size_t i = 0; i < source.size(); ++i)
        sum += weights[i] * (transform * source[i] - target[i]).squaredNorm();
      return sum;
    };
    const auto transform = fit_transform(source, target, dof, weights);
    REQUIRE(transform);
    for (int i = 0; i < 200; ++i) {
      Eigen::Isometry3d other = *transform;
      other.translation() += 0.01 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
      const Eigen::Vector3d axis = dof == four
                                       ? Eigen::Vector3d(0, 0, 1)
                                       : Eigen::Vector3d(random.normal(), random.normal(), random.normal());
      other.rotate(Eigen::AngleAxisd(0.001 * random.normal(), axis.normalized()));
      CHECK(squares(other) >= squares(*transform));
    }
  }
}

TEST_CASE("4-DoF keeps the z axis to the last bit, also for tilted input") {
  random_source random(53);
  const positions source = random_points(random, 10);
  const positions target = scenes::moved(random_transform(random), source);
  const auto transform = fit_transform(source, target, four);
  REQUIRE(transform);
  CHECK(transform->linear().col(2) == Eigen::Vector3d::UnitZ());
  CHECK(transform->linear().row(2) == Eigen::RowVector3d::UnitZ());
  require_rotation(*transform);
}

TEST_CASE("4-DoF shifts heights by their mean difference") {
  const positions source = {{0, 0, 0}, {5, 0, 0}, {0, 5, 0}}, target = {{0, 0, 1}, {5, 0, 2}, {0, 5, 6}};
  const auto transform = fit_transform(source, target, four);
  REQUIRE(transform);
  CHECK(transform->translation().z() == Approx(3));
}

TEST_CASE("points of weight zero do not count, and weights count as copies") {
  random_source random(54);
  for (const auto dof : {four, six}) {
    positions source = random_points(random, 8), target = scenes::noisy(source, 0.5, random);
    positions copies_source = source, copies_target = target;
    copies_source.push_back(source[3]);
    copies_target.push_back(target[3]);
    source.push_back({100, 0, 0});
    target.push_back({-100, 70, 5});
    const std::vector<double> weights = {1, 1, 1, 2, 1, 1, 1, 1, 0};
    const auto weighted = fit_transform(source, target, dof, weights);
    const auto copied = fit_transform(copies_source, copies_target, dof);
    REQUIRE((weighted && copied));
    CHECK(weighted->isApprox(*copied, 1e-12));
  }
}

TEST_CASE("fit_transform never reflects, also where a reflection would fit exactly") {
  random_source random(55);
  for (const auto dof : {four, six})
    for (int iteration = 0; iteration < 20; ++iteration) {
      const positions source = random_points(random, 3 + random.below(6));
      positions target = source;
      for (Eigen::Vector3d& p : target) p.y() = -p.y();
      const auto transform = fit_transform(source, target, dof);
      REQUIRE(transform);
      require_rotation(*transform);
    }
}

TEST_CASE("6-DoF rotates points of one plane exactly") {
  random_source random(56);
  positions source = random_points(random, 6);
  for (Eigen::Vector3d& p : source) p.z() = 0;
  const Eigen::Isometry3d truth = random_transform(random);
  const auto transform = fit_transform(source, scenes::moved(truth, source), six);
  REQUIRE(transform);
  CHECK(transform->isApprox(truth, 1e-12));
}

TEST_CASE("fit_transform gives nothing when the points do not determine the transform") {
  const Eigen::Vector3d far_away(1e6, 5e6, 1e3), direction(0.6, 0.64, 0.48);
  positions pile, pole, line;
  for (int i = 0; i < 7; ++i) {
    pile.push_back(far_away);
    pole.push_back(far_away + i * Eigen::Vector3d::UnitZ());
    line.push_back(far_away + i * direction);
  }
  for (const auto dof : {four, six}) {
    CHECK_FALSE(fit_transform({}, {}, dof));
    CHECK_FALSE(fit_transform(positions{{1, 2, 3}}, positions{{4, 5, 6}}, dof));
    CHECK_FALSE(fit_transform(pile, pile, dof));
    CHECK_FALSE(fit_transform(pole, pole, dof));
    CHECK_FALSE(fit_transform(line, pile, dof));
    CHECK_FALSE(fit_transform(line, line, dof, std::vector<double>(7, 0.0)));
  }
  CHECK_FALSE(fit_transform(line, line, six));
  CHECK(fit_transform(line, line, four));
}

TEST_CASE("fit_transform refuses sizes that differ") {
  const positions two = {{0, 0, 0}, {1, 0, 0}}, three = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  CHECK_THROWS_AS(fit_transform(two, three, four), std::invalid_argument);
  CHECK_THROWS_AS(fit_transform(two, two, four, std::vector<double>{1.0}), std::invalid_argument);
}

}  // namespace globalmatch::test_transform
