#include "globalmatch/stem_positions.hpp"

#include "catch.hpp"
#include "forest_scenes.hpp"

namespace globalmatch {

using Eigen::Vector3d;
using scenes::leaning;
using scenes::upright;

namespace {

/// A plane over 20 m x 20 m.
terrain sloped_terrain(const scenes::slope& plane) {
  terrain ground;
  ground.resolution = 0.5;
  ground.columns = ground.rows = 40;
  for (int r = 0; r < 40; ++r)
    for (int c = 0; c < 40; ++c)
      ground.heights.push_back(static_cast<float>(plane((c + 0.5) * 0.5, (r + 0.5) * 0.5)));
  ground.has_data.assign(ground.heights.size(), 1);
  return ground;
}

/// Where the axis meets a plane through the origin, by solving the linear equation.
Vector3d foot_on(const cylinder& c, const scenes::slope& plane) {
  const Vector3d normal(-plane(1, 0), -plane(0, 1), 1);
  return c.point - c.axis * (normal.dot(c.point) / normal.dot(c.axis));
}

/// Points on fragments of stems, and the cylinders fitted to them.
struct fragments {
  local_points points;
  stem_cylinders found{{}, 0.02};

  void add(random_source& random, const cylinder& fitted, const cylinder& truth, std::size_t count,
           const scenes::seen_surface& seen) {
    stem_cylinder fragment;
    fragment.cylinder = fitted;
    for (const Eigen::Vector3f& p : scenes::stem_points(random, truth, count, seen)) {
      fragment.support.push_back(static_cast<point_index>(points.size()));
      points.push_back(p, static_cast<point_index>(1000 + points.size()));
    }
    found.stems.push_back(fragment);
  }
};

stem_cylinder without_support(const cylinder& c) {
  stem_cylinder found;
  found.cylinder = c;
  return found;
}

}  // namespace

TEST_CASE("a stem stands where its axis meets sloped ground, to 1 mm") {
  for (const double degrees : {0, 15, 30, 45})
    for (const double lean : {0, 10, 25})
      for (const double azimuth : {0, 70, 180, 250}) {
        CAPTURE(degrees, lean, azimuth);
        const scenes::slope plane{degrees, 0};
        const cylinder c = leaning(10, 10, plane(10, 10) + 1.5, 0.1, lean, azimuth);
        const auto foot = meet_terrain(c, sloped_terrain(plane));
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
          if (sees(x, y)) ground.ground.push_back(Vector3d(x, y, plane(x, y)).cast<float>());
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
  for (Eigen::Vector3f& p : ground.ground) {
    const double away = std::hypot(p.x() - 10, p.y() - 10);
    if (away < 0.3) p.z() += 0.2f;                                      // the root flare
    if (std::hypot(p.x() - 10.7, p.y() - 10.2) < 0.25) p.z() += 0.15f;  // a shrub
  }
  const auto found = ground_at(ground, 10, 10, 0.25);
  REQUIRE(found);
  CHECK(found->height == Approx(truth).margin(0.01));
  CHECK(found->sigma < 0.01);
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
  CHECK_FALSE(meet_terrain(upright(-0.1, 5, 1, 0.1), ground));
  CHECK_FALSE(meet_terrain(upright(5, 1e9, 1, 0.1), ground));
  CHECK_FALSE(meet_terrain(leaning(0.2, 5, 1.5, 0.1, 20, 0), ground));
  CHECK(meet_terrain(leaning(0.2, 5, 1.5, 0.1, 20, 180), ground));
  CHECK_FALSE(meet_terrain(upright(5, 5, 1, 0.1), terrain{}));
}

TEST_CASE("the lower and the upper part of a stem become one, fitted to both") {
  random_source random(1);
  const cylinder truth = leaning(10, 10, 0, 0.15, 6, 30);
  cylinder lower = truth, upper = truth;
  lower.point.x() += 0.01;
  upper.point.y() -= 0.01;
  fragments parts;
  parts.add(random, lower, truth, 200, {.from = 0.2, .to = 1.2});
  parts.add(random, upper, truth, 300, {.from = 1.8, .to = 3});
  const auto merged = merge_fragments(parts.found, parts.points, sloped_terrain({}), {});
  REQUIRE(merged.size() == 1);
  CHECK(merged[0].support.size() == 500);
  CHECK(std::is_sorted(merged[0].support.begin(), merged[0].support.end()));
  CHECK((merged[0].cylinder.at_height(0) - truth.at_height(0)).norm() < 0.001);
  CHECK(merged[0].cylinder.radius == Approx(truth.radius).margin(0.001));
}

TEST_CASE("two sides of a stem become one, points they share count once") {
  random_source random(2);
  const cylinder truth = upright(10, 10, 0, 0.2);
  fragments parts;
  parts.add(random, truth, truth, 200, {.arc = std::numbers::pi});
  parts.add(random, upright(10.05, 10, 0, 0.18), truth, 100, {});
  parts.found.stems[1].support.push_back(0);
  std::sort(parts.found.stems[1].support.begin(), parts.found.stems[1].support.end());
  const auto merged = merge_fragments(parts.found, parts.points, sloped_terrain({}), {});
  REQUIRE(merged.size() == 1);
  CHECK(merged[0].support.size() == 300);
}

TEST_CASE("stems closer than a metre but not within each other's radius stay apart") {
  random_source random(3);
  fragments parts;
  for (const double x : {10.0, 10.3, 10.6}) {
    const cylinder stem = upright(x, 10, 0, 0.1);
    parts.add(random, stem, stem, 100, {});
  }
  CHECK(merge_fragments(parts.found, parts.points, sloped_terrain({}), {}).size() == 3);
}

TEST_CASE("the arms of a fork that part at the ground become one stem") {
  random_source random(4);
  const cylinder left = leaning(10, 10, 0, 0.1, 15, 0), right = leaning(10, 10, 0, 0.1, 15, 180);
  fragments parts;
  parts.add(random, left, left, 300, {.from = 1, .to = 3});
  parts.add(random, right, right, 200, {.from = 1, .to = 3});
  const auto merged = merge_fragments(parts.found, parts.points, sloped_terrain({}), {});
  REQUIRE(merged.size() == 1);
  CHECK(merged[0].support.size() == 500);
}

TEST_CASE("cylinders beyond the terrain are left out of the merge, and of the stems") {
  stem_cylinders found{{without_support(upright(50, 5, 1, 0.1)), without_support(upright(5, 5, 1, 0.1))},
                       0.02};
  const terrain ground = sloped_terrain({});
  CHECK(merge_fragments(found, {}, ground, {}).size() == 1);
  CHECK(locate_stems(found.stems, {}, ground).size() == 1);
  CHECK(merge_fragments({{}, 0.02}, {}, ground, {}).empty());
  CHECK(locate_stems({}, {}, ground).empty());
}

TEST_CASE("merging does not depend on the order of fragments of different size") {
  random_source random(5);
  const cylinder truth = upright(10, 10, 0, 0.15);
  fragments parts;
  parts.add(random, truth, truth, 200, {.from = 0, .to = 1, .noise = 0.003});
  parts.add(random, upright(10.02, 10, 0, 0.15), truth, 300, {.from = 1, .to = 2, .noise = 0.003});
  parts.add(random, upright(10, 10.02, 0, 0.14), truth, 100, {.from = 2, .to = 3, .noise = 0.003});
  const terrain ground = sloped_terrain({});
  const auto forwards = merge_fragments(parts.found, parts.points, ground, {});
  std::reverse(parts.found.stems.begin(), parts.found.stems.end());
  const auto backwards = merge_fragments(parts.found, parts.points, ground, {});
  REQUIRE(forwards.size() == 1);
  REQUIRE(backwards.size() == 1);
  CHECK(forwards[0].cylinder.point == backwards[0].cylinder.point);
  CHECK(forwards[0].support == backwards[0].support);
}

TEST_CASE("stems are in the frame of the scan, ordered by position, with the indices of the scan") {
  random_source random(6);
  terrain ground = sloped_terrain({});
  ground.frame.origin = {500000, 5300000, 1000};
  fragments parts;
  for (const auto& [x, y] : {std::pair(15.0, 3.0), std::pair(5.0, 9.0), std::pair(5.0, 2.0)}) {
    const cylinder stem = upright(x, y, 1.5, 0.01 * x);
    parts.add(random, stem, stem, 20, {});
  }
  parts.found.stems[0].covariance = Eigen::Vector4d(0.004 * 0.004, 0, 0, 0).asDiagonal();
  const auto stems = locate_stems(parts.found.stems, parts.points, ground);
  REQUIRE(stems.size() == 3);
  CHECK(stems[0].position == Vector3d(500005, 5300002, 1000));
  CHECK(stems[1].position == Vector3d(500005, 5300009, 1000));
  CHECK(stems[2].position == Vector3d(500015, 5300003, 1000));
  CHECK(stems[2].radius == Approx(0.15));
  CHECK(stems[2].position_sigma == Approx(0.004));
  CHECK(stems[2].support.front() == 1000);
  CHECK(stems[2].support.size() == 20);
  CHECK(stems[0].support.front() == 1040);
}

TEST_CASE("axes of stems are turned into the frame of the scan") {
  terrain ground = sloped_terrain({});
  const Vector3d up = Vector3d(1, 2, 2) / 3;
  ground.frame.local_from_scan_rotation = levelling_rotation(up);
  const auto stems = locate_stems({without_support(upright(10, 10, 1, 0.1))}, {}, ground);
  REQUIRE(stems.size() == 1);
  CHECK((stems[0].axis - up).norm() < 1e-12);
  CHECK((stems[0].position - ground.frame.to_scan({10, 10, 0})).norm() < 1e-12);
}

TEST_CASE("a stem tells whether the ground was seen where it stands") {
  terrain ground = sloped_terrain({});
  ground.has_data[ground.node(20, 20)] = 0;
  const auto stems = locate_stems(
      {without_support(upright(10.25, 10.25, 1, 0.1)), without_support(upright(12, 12, 1, 0.1))}, {}, ground);
  REQUIRE(stems.size() == 2);
  CHECK_FALSE(stems[0].ground_seen);
  CHECK(stems[1].ground_seen);
}

TEST_CASE("a stem is a point, with a radius and a sigma") {
  STATIC_REQUIRE(point<stem>);
  STATIC_REQUIRE(point_range<std::vector<stem>>);
  stem s;
  s.position = {1, 2, 3};
  s.radius = 0.2;
  s.position_sigma = 0.01;
  CHECK(xyz(s) == Vector3d(1, 2, 3));
  CHECK(point_traits<stem>::radius(s) == 0.2);
  CHECK(point_traits<stem>::position_sigma(s) == 0.01);
}

}  // namespace globalmatch
