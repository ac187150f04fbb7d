#include "globalmatch/detail/mapping/cell_sorter.hpp"
#include "globalmatch/detail/mapping/stem_positions.hpp"

#include <cmath>
#include <cstddef>
#include <tuple>
#include <vector>

#include "catch.hpp"
#include "forest_scenes.hpp"
#include "globalmatch/detail/core/eigen_border.hpp"
#include "leaning_stems.hpp"

namespace globalmatch::test_stem_positions {

using namespace detail;

using scenes::all_of;
using scenes::as_local_points;
using scenes::ground_of;
using scenes::points_on;

using Eigen::Vector3d;
using scenes::leaning;
using scenes::sloped_terrain;
using scenes::upright;

namespace {

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
      points.push_back(vec3f(vec3::from(p)), static_cast<point_index>(1000 + points.size()));
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

TEST_CASE("the lower and the upper part of a stem become one, fitted to both") {
  random_source random(1);
  const cylinder truth = leaning(10, 10, 0, 0.15, 6, 30);
  cylinder lower = truth, upper = truth;
  lower.point.x += 0.01;
  upper.point.y -= 0.01;
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

TEST_CASE("cylinders that are less likely a stem than asked for are left out, others stay in their order") {
  stem_cylinders found;
  for (const double quality : {0.9, 0.2, 0.5, 0.4999}) {
    found.stems.push_back(without_support(upright(5, 5, 1, 0.1)));
    found.stems.back().quality = quality;
  }
  CHECK(drop_unlikely(found, 0) == 4);
  CHECK(drop_unlikely(found, 0.5) == 2);
  REQUIRE(found.stems.size() == 2);
  CHECK(found.stems[0].quality == 0.9);
  CHECK(found.stems[1].quality == 0.5);
}

TEST_CASE("no stem is found twice: of cylinders that stand in each other the better one stays") {
  const terrain ground = sloped_terrain({});
  for (const double apart : {0.015, 0.15, 0.19}) {
    std::vector<stem_cylinder> stems = {without_support(upright(10, 10, 1, 0.1)),
                                        without_support(upright(10 + apart, 10, 1, 0.1))};
    stems[0].quality = 0.7;
    stems[1].quality = 0.9;
    drop_duplicates(stems, ground);
    REQUIRE(stems.size() == 1);
    CHECK(stems[0].quality == 0.9);
  }
}

TEST_CASE("stems whose surfaces do not meet stay, also where they lean over each other above") {
  const terrain ground = sloped_terrain({});
  std::vector<stem_cylinder> stems = {
      without_support(upright(10, 10, 1, 0.1)), without_support(upright(10.21, 10, 1, 0.1)),
      without_support(leaning(12, 10, 0, 0.1, 12, 0)), without_support(leaning(12.9, 10, 0, 0.1, 12, 180))};
  drop_duplicates(stems, ground);
  CHECK(stems.size() == 4);
  stems.push_back(without_support(upright(500, 10, 1, 0.1)));  // beyond the terrain
  drop_duplicates(stems, ground);
  CHECK(stems.size() == 4);
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
  parts.found.stems[0].covariance(0, 0) = 0.004 * 0.004;
  const auto stems = locate_stems(parts.found.stems, parts.points, ground);
  REQUIRE(stems.size() == 3);
  CHECK(stems[0].position == Vector3d(500005, 5300002, 1000));
  CHECK(stems[1].position == Vector3d(500005, 5300009, 1000));
  CHECK(stems[2].position == Vector3d(500015, 5300003, 1000));
  CHECK(stems[2].radius == Approx(0.15));
  CHECK(stems[2].position_sigma == Approx(2.3 * 0.004));  // points err alike
  CHECK(stems[1].position_sigma == 0);
  CHECK(stems[2].support.front() == 1000);
  CHECK(stems[2].support.size() == 20);
  CHECK(stems[0].support.front() == 1040);
}

TEST_CASE("axes of stems are turned into the frame of the scan") {
  terrain ground = sloped_terrain({});
  const Vector3d up = Vector3d(1, 2, 2) / 3;
  ground.frame.rotation = levelling_rotation(from_eigen(up));
  const auto stems = locate_stems({without_support(upright(10, 10, 1, 0.1))}, {}, ground);
  REQUIRE(stems.size() == 1);
  CHECK((stems[0].axis - up).norm() < 1e-12);
  CHECK((from_eigen(stems[0].position) - ground.frame.to_scan({10, 10, 0})).norm() < 1e-12);
}

TEST_CASE("a stem says whether the ground was seen where it stands") {
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
  CHECK(xyz(s) == vec3{1, 2, 3});
  CHECK(point_traits<stem>::radius(s) == 0.2);
  CHECK(point_traits<stem>::position_sigma(s) == 0.01);
}

TEST_CASE("a thin fragment within the radius of a thick stem is of that stem") {
  random_source random(8);
  const terrain ground = ground_of([](double, double) { return 2.0; }, 0, 0, 0);
  for (const double apart : {0.2, 0.35}) {
    stem_cylinders found;
    found.distance_tolerance = 0.02;
    std::vector<vec3> points;
    for (const auto& [x, radius, count] : {std::tuple(5.0, 0.3, 300), std::tuple(5.0 + apart, 0.08, 100)}) {
      stem_cylinder stem;
      stem.cylinder = {{x, 6, 3.5}, {0, 0, 1}, radius, 0};
      for (const vec3& p : points_on(stem.cylinder, std::size_t(count), -1, 1, 3, random)) {
        stem.support.push_back(point_index(points.size()));
        points.push_back(p);
      }
      found.stems.push_back(stem);
    }
    const auto merged = merge_fragments(found, as_local_points(points), ground, {});
    CHECK(merged.size() == (apart < 0.3 ? 1u : 2u));
    CHECK(merged.front().support.size() == (apart < 0.3 ? 400u : 300u));
  }
}

TEST_CASE("a located stem has the radius and its uncertainty at breast height, in the frame of the scan") {
  random_source random(9);
  terrain ground = ground_of([](double x, double y) { return 20 + 0.15 * x - 0.1 * y; }, 0, 0, 0);
  ground.frame = {{400000, 5200000, 700}, levelling_rotation(vec3{0.3, -0.2, 0.9})};
  stem_cylinder found;
  found.cylinder = {{8.4, 12.1, 22.6}, vec3{0.25, 0.1, 1}.normalized(), 0.31, 0.03};
  const auto points = points_on(found.cylinder, 200, -0.5, 1.2, 2, random);
  found.support = all_of(points.size());
  const cylinder_options options{.usual_taper = 0.03, .taper_weight = 2};
  found.covariance = cylinder_covariance(found.cylinder, points, 0.02, options);
  const auto s = locate_stem(found, as_local_points(points), ground);
  REQUIRE(s);
  const cylinder& c = found.cylinder;
  const vec3 base = ground.frame.to_local(from_eigen(s->position));
  CHECK(base.z == Approx(20 + 0.15 * base.x - 0.1 * base.y).margin(0.02));
  CHECK(c.axis_distance(base) < 1e-6);
  CHECK(s->height_sigma > 0);
  CHECK((ground.frame.rotation * from_eigen(s->axis) - c.axis).norm() < 1e-9);
  const double along = (base.z - c.point.z) / c.axis.z, breast = along + 1.3 / c.axis.z;
  CHECK(s->radius == Approx(c.radius - c.taper * breast));
  const double lean = std::hypot(c.axis.x, c.axis.y) / c.axis.z;
  CHECK(s->radius_sigma ==
        Approx(std::hypot(2.3 * radius_uncertainty(found.covariance, breast), c.taper * s->height_sigma)));
  CHECK(s->position_sigma ==
        Approx(std::hypot(2.3 * axis_uncertainty(found.covariance, along), lean * s->height_sigma)));
}

}  // namespace globalmatch::test_stem_positions
