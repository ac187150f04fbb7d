#include "globalmatch/detail/mapping/stem_base.hpp"

#include "catch.hpp"
#include "forest_scenes.hpp"

namespace globalmatch {

using namespace detail;

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
    "the ground at a stem is that of the slope around it, whatever its foot and the shrubs beside it lift") {
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

TEST_CASE("an axis that meets the ground beyond the terrain has no foot there") {
  const terrain ground = sloped_terrain({});
  CHECK_FALSE(intersect_terrain(upright(-0.1, 5, 1, 0.1), ground));
  CHECK_FALSE(intersect_terrain(upright(5, 1e9, 1, 0.1), ground));
  CHECK_FALSE(intersect_terrain(leaning(0.2, 5, 1.5, 0.1, 20, 0), ground));
  CHECK(intersect_terrain(leaning(0.2, 5, 1.5, 0.1, 20, 180), ground));
  CHECK_FALSE(intersect_terrain(upright(5, 5, 1, 0.1), terrain{}));
}

}  // namespace globalmatch
