#include "globalmatch/detail/mapping/stem_base.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <cstddef>
#include <utility>

#include "catch.hpp"
#include "forest_scenes.hpp"
#include "leaning_stems.hpp"

namespace globalmatch::test_stem_base {

using namespace detail;

using scenes::ground_of;

using Vector3d = vec3;
using scenes::leaning;
using scenes::sloped_terrain;
using scenes::upright;

namespace {

/// Where the axis meets a plane through the origin, by solving the linear equation.
Vector3d foot_on(const cylinder& c, const scenes::slope& plane) {
  const Vector3d normal{-plane(1, 0), -plane(0, 1), 1};
  return c.point - c.axis * (normal.dot(c.point) / normal.dot(c.axis));
}

}  // namespace

TEST_CASE("a stem stands where its axis meets sloped ground, to 1 mm") {
  for (const double degrees : {0, 15, 30, 45})
    for (const double lean : {0, 10, 25})
      for (const double azimuth : {0, 70, 180, 250}) {
        CAPTURE(degrees, lean, azimuth);
        const scenes::slope plane{degrees, 0};
        const cylinder c = leaning(10, 10, plane(10, 10) + 1.5, 0.1, lean, azimuth);
        const auto foot = intersect_terrain(c, sloped_terrain(plane));
        REQUIRE(foot);
        CHECK((*foot - foot_on(c, plane)).norm() < 0.001);
      }
}

namespace {

/// Ground points every `step` metres on a plane that `sees(x, y)`, node by node.
template <class Sees>
terrain with_ground(const scenes::slope& plane, double step, const Sees& sees) {
  terrain ground = sloped_terrain(plane);
  for (int r = 0; r < 40; ++r)
    for (int c = 0; c < 40; ++c) {
      ground.first_ground.push_back(static_cast<std::uint32_t>(ground.ground.size()));
      for (double y = r * 0.5 + step / 2; y < (r + 1) * 0.5; y += step)
        for (double x = c * 0.5 + step / 2; x < (c + 1) * 0.5; x += step)
          if (sees(x, y)) ground.ground.push_back(vec3f(vec3{x, y, plane(x, y)}));
    }
  ground.first_ground.push_back(static_cast<std::uint32_t>(ground.ground.size()));
  return ground;
}

}  // namespace

TEST_CASE(
    "the ground at a stem is that of the slope around it, whatever its root flare and the shrubs beside it "
    "lift") {
  const scenes::slope plane{20, 40};
  terrain ground = with_ground(plane, 0.25, [](double, double) { return true; });
  const double truth = plane(10, 10);
  for (vec3f& p : ground.ground) {
    const double away = std::hypot(p.x - 10, p.y - 10);
    if (away < 0.3) p.z += 0.2f;                                  // the root flare
    if (std::hypot(p.x - 10.7, p.y - 10.2) < 0.25) p.z += 0.15f;  // a shrub
  }
  const auto found = ground_at(ground, 10, 10, 0.25);
  REQUIRE(found);
  CHECK(found->height == Approx(truth).margin(0.01));
  CHECK(found->sigma < 0.03);
}

TEST_CASE(
    "ground that is seen on one side or far away only makes the height less sure, and without any there is "
    "none") {
  const scenes::slope plane{10, 0};
  const auto at = [&](const auto& sees) { return ground_at(with_ground(plane, 0.25, sees), 10, 10, 0.1); };
  const auto all = at([](double, double) { return true; });
  const auto one_side = at([](double x, double) { return x > 10.4; });
  const auto far = at([](double x, double) { return x > 12.5; });
  REQUIRE(all);
  REQUIRE(one_side);
  REQUIRE(far);
  CHECK(one_side->sigma > 1.5 * all->sigma);
  CHECK(far->sigma > one_side->sigma);
  for (const auto& found : {all, one_side, far}) CHECK(found->height == Approx(plane(10, 10)).margin(0.06));
  CHECK_FALSE(at([](double x, double) { return x > 19; }));
  CHECK_FALSE(ground_at(sloped_terrain(plane), 10, 10, 0.1));
}

TEST_CASE("an axis that meets the ground beyond the terrain has no stem base there") {
  const terrain ground = sloped_terrain({});
  CHECK_FALSE(intersect_terrain(upright(-0.1, 5, 1, 0.1), ground));
  CHECK_FALSE(intersect_terrain(upright(5, 1e9, 1, 0.1), ground));
  CHECK_FALSE(intersect_terrain(leaning(0.2, 5, 1.5, 0.1, 20, 0), ground));
  CHECK(intersect_terrain(leaning(0.2, 5, 1.5, 0.1, 20, 180), ground));
  CHECK_FALSE(intersect_terrain(upright(5, 5, 1, 0.1), terrain{}));
}

TEST_CASE("the ground at a stem is a plane whose points count less the farther they are from it") {
  const double x = 9.7, y = 8.3, radius = 0.3;
  const auto height = [](double at_x, double at_y) {
    return 3 + 0.1 * at_x - 0.2 * at_y + 0.02 * (at_x - 9.7) * (at_x - 9.7);
  };
  terrain ground = ground_of(height, x, y, 0.3);
  ground.ground.front().x = float(x + 0.34);  // lifted by the root flare
  ground.ground.front().y = float(y);
  std::swap(ground.ground.front(),
            ground.ground[ground.first_ground[ground.node(int(x / 0.5), int(y / 0.5))]]);
  for (vec3f& p : ground.ground)
    if (std::hypot(p.x - x, p.y - y) < radius + 0.07) p.z += 0.015f;
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  double weights = 0;
  const auto visit = [&](const auto& use) {
    for (const vec3f& p : ground.ground) {
      const double dx = p.x - x, dy = p.y - y, distance = std::hypot(dx, dy);
      if (distance <= radius + 0.07 || distance >= 1) continue;
      use(Eigen::Vector3d(1, dx, dy), double(p.z), std::pow(1 + distance * distance / 0.04, -2));
    }
  };
  visit([&](const Eigen::Vector3d& row, double z, double weight) {
    normal += weight * row * row.transpose();
    right += weight * z * row;
    weights += weight;
  });
  normal(1, 1) += 3e-3 * weights;
  normal(2, 2) += 3e-3 * weights;
  const double expected = 3 + 0.1 * x - 0.2 * y;
  Eigen::Vector3d shifted = Eigen::Vector3d::Zero();  // heights above the place, as a ridge asks for
  visit(
      [&](const Eigen::Vector3d& row, double z, double weight) { shifted += weight * (z - expected) * row; });
  const Eigen::Vector3d plane = normal.ldlt().solve(shifted);
  const auto found = ground_at(ground, x, y, radius);
  REQUIRE(found);
  CHECK(found->height == Approx(expected + plane[0]).margin(5e-4));
  CHECK(found->sigma == Approx(0.6 * 0.02 * std::sqrt(normal.inverse()(0, 0))).epsilon(0.1));
}

TEST_CASE("what stands out of the ground upwards does not lift it at a stem, while a pit there lowers it") {
  const auto flat = [](double, double) { return 4.0; };
  terrain raised = ground_of(flat, 0, 0, 0);
  for (std::size_t i = 0; i < raised.ground.size(); i += 4) raised.ground[i].z += 0.2f;
  CHECK(ground_at(raised, 10.1, 9.2, 0.1)->height == Approx(4).margin(0.01));
  terrain lowered = ground_of(flat, 0, 0, 0);
  for (std::size_t i = 0; i < lowered.ground.size(); i += 4) lowered.ground[i].z -= 0.2f;
  CHECK(ground_at(lowered, 10.1, 9.2, 0.1)->height < 3.97);
}

}  // namespace globalmatch::test_stem_base
