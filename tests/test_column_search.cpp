#include "globalmatch/detail/mapping/column_search.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include "catch.hpp"
#include "forest_scenes.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "globalmatch/detail/mapping/cell_sorter.hpp"
#include "leaning_stems.hpp"

namespace globalmatch::test_column_search {

using namespace detail;

using scenes::as_local_points;
using scenes::points_on;

namespace {

/// Points along a line that leans, with noise across it; a share of the height is missing.
std::vector<vec3> along(const vertical_line& line, double low, double high, double noise,
                        random_source& random) {
  std::vector<vec3> points;
  for (int i = 0; i < 400; ++i) {
    const double z = low + (high - low) * random.uniform();
    const vec2 at = line.at_height(z);
    points.push_back({at.x + noise * random.normal(), at.y + noise * random.normal(), z});
  }
  return points;
}

/// The understory with the points of stems, and the members of their one cluster.
struct cluster {
  cell_columns understory;
  std::vector<point_index> members;

  explicit cluster(const std::vector<vec3>& points)
      : understory(sort_into_cells(as_local_points(points), 0.05)) {
    for (point_index i = 0; i < understory.points().size(); ++i) members.push_back(i);
  }
  std::vector<stem_cylinder> find(std::size_t maximum, const stem_cylinder_options& changed = {}) const {
    stem_cylinder_options options = changed;
    options.cylinder.distance_tolerance = 0.02;
    const cylinder_fitter fitter{&fit_along_line};
    random_source random(1);
    return column_search(understory, members, fitter, options).run(random, maximum);
  }
};

cylinder stem_at(double x, double y, double radius, const vec3& axis) {
  return {{x, y, 41.5}, axis.normalized(), radius, 0};
}

}  // namespace

TEST_CASE("a vertical line passes its place at z0, and a rectangle over two metres above and below") {
  const vertical_line line{{3, -2}, {0.1, -0.2}, 5};
  CHECK((line.at_height(5) - vec2{3, -2}).norm() == 0);
  CHECK((line.at_height(6.5) - vec2{3.15, -2.3}).norm() < 1e-12);
  const rectangle seen = line.seen_from_above();
  CHECK((seen.low - vec2{2.8, -2.4}).norm() < 1e-12);
  CHECK((seen.high - vec2{3.2, -1.6}).norm() < 1e-12);
}

TEST_CASE("a column is followed from an upright start to the line that its points lie along") {
  random_source random(1);
  for (const vec2& slope : {vec2{0, 0}, vec2{0.07, -0.04}, vec2{-0.05, 0.08}}) {
    const vertical_line truth{{7, -4}, slope, 42};
    const auto points = along(truth, 40.6, 43.2, 0.02, random);
    const auto [line, filled] = follow_column(points, {7.03, -4.02}, 0.5);
    for (const double z : {40.6, 42.0, 43.2}) CHECK((line.at_height(z) - truth.at_height(z)).norm() < 0.015);
    CHECK(std::popcount(filled) >= 25);
    CHECK(std::popcount(filled) <= 28);
  }
}

TEST_CASE("points beside a column neither pull its line nor fill its height, and slopes are limited") {
  random_source random(2);
  const vertical_line truth{{2, 3}, {0.06, 0.03}, 1};
  auto points = along(truth, -0.5, 1.2, 0.01, random);
  const auto alone = follow_column(points, {2, 3}, 0.5);
  for (int i = 0; i < 300; ++i)
    points.push_back({2.6 + 0.3 * random.uniform(), 3.5 + random.uniform(), 2 + random.uniform()});
  const auto both = follow_column(points, {2, 3}, 0.5);
  for (const double z : {-0.5, 1.2})
    CHECK((both.first.at_height(z) - alone.first.at_height(z)).norm() < 0.01);
  CHECK(both.second == alone.second);
  const auto limited = follow_column(along({{2, 3}, {0.3, 0.4}, 1}, 0.75, 1.25, 0.002, random), {2, 3}, 0.1);
  CHECK(limited.first.slope.norm() == Approx(0.1));
  CHECK(limited.first.slope.y > limited.first.slope.x);
}

TEST_CASE("a column of one point, or of two slices, stays upright at its start") {
  for (const std::vector<vec3>& few : {std::vector<vec3>{{1, 2, 3}}, {{1, 2, 3}, {1.05, 2, 3.5}}}) {
    const auto [line, filled] = follow_column(few, {1.02, 2.01}, 0.5);
    CHECK(line.at == vec2{1.02, 2.01});
    CHECK(line.slope == vec2{});
    CHECK(std::popcount(filled) == int(few.size()));
  }
}

TEST_CASE("the cost of a circle is cut off at the tolerance and doubled inside, of any count of points") {
  random_source random(3);
  const circle c{{0.05, -0.02}, 0.2};
  constexpr double tolerance = 0.03;
  for (const std::size_t count : {0u, 1u, 7u, 63u, 64u, 65u, 300u}) {
    std::vector<float> x, y;
    double expected = 0;
    for (std::size_t i = 0; i < count; ++i) {
      x.push_back(float(0.2 * random.normal())), y.push_back(float(0.15 * random.normal()));
      const double d = std::hypot(x.back() - 0.05, y.back() + 0.02) - 0.2;
      expected += d < -tolerance ? 2 * tolerance * tolerance : std::min(d * d, tolerance * tolerance);
    }
    CHECK(circle_cost(x, y, c, tolerance, 1e9f) == Approx(expected).epsilon(1e-4).margin(1e-9));
    if (count == 300) {
      const float enough = float(expected / 3), some = circle_cost(x, y, c, tolerance, enough);
      CHECK(some >= enough);
      CHECK(some < 0.8 * expected);
    }
  }
}

TEST_CASE("the circle that most points lie on is found from a part of it, among others") {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    random_source random(seed);
    std::vector<float> x, y;
    for (int i = 0; i < 200; ++i) {
      const bool off = i % 4 == 0;
      const double angle = 2.5 * random.uniform(), r = 0.17 + 0.003 * random.normal();
      x.push_back(float(off ? 0.4 + 0.4 * random.uniform() : 0.1 + r * std::cos(angle)));
      y.push_back(float(off ? random.normal() : -0.08 + r * std::sin(angle)));
    }
    const auto found = fit_circle(x, y, 0.015, {}, random);
    REQUIRE(found);
    CHECK((found->center - vec2{0.1, -0.08}).norm() < 0.02);
    CHECK(found->radius == Approx(0.17).margin(0.02));
  }
}

TEST_CASE("a circle beyond the limits of the radius, or through points of a line, is not found") {
  random_source random(4);
  std::vector<float> x, y, zero(100, 0.0f);
  for (int i = 0; i < 100; ++i) {
    x.push_back(float(0.3 * std::cos(0.05 * i))), y.push_back(float(0.3 * std::sin(0.05 * i)));
  }
  CHECK(fit_circle(x, y, 0.01, {}, random));
  CHECK_FALSE(fit_circle(x, y, 0.01, {.max_radius = 0.29}, random));
  CHECK_FALSE(fit_circle(x, y, 0.01, {.min_radius = 0.31}, random));
  CHECK_FALSE(fit_circle(x, zero, 0.01, {}, random));
}

TEST_CASE(
    "both stems of a cluster are found, however they lean, the fullest first and no more than asked for") {
  random_source random(5);
  const cylinder high = stem_at(6.2, -3.1, 0.14, {0.08, 0.05, 1}),
                 low = stem_at(7.4, -2.3, 0.09, {-0.05, 0.1, 1});
  std::vector<vec3> points = points_on(high, 700, -1.3, 1.3, 3.5, random);
  for (const vec3& p : points_on(low, 400, -0.9, 0.9, 4, random)) points.push_back(p);
  const cluster both(points);
  const auto found = both.find(5);
  REQUIRE(found.size() == 2);
  const cylinder* expected[] = {&high, &low};
  for (std::size_t i = 0; i < 2; ++i) {
    const cylinder& c = found[i].cylinder;
    for (const double z : {40.5, 42.5})
      CHECK((c.at_height(z) - expected[i]->at_height(z)).xy().norm() < 0.005);
    CHECK(c.radius == Approx(expected[i]->radius).margin(0.005));
    CHECK(found[i].support.size() > (i == 0 ? 650 : 350));
  }
  CHECK(both.find(1).size() == 1);
  CHECK(both.find(0).empty());
  CHECK(both.find(5, {.min_height = 2.0}).size() == 1);
}

TEST_CASE("a cluster without points, of one point or of equal ones holds no stem") {
  CHECK(cluster({}).find(5).empty());
  CHECK(cluster({{1, 2, 3}}).find(5).empty());
  CHECK(cluster(std::vector<vec3>(300, vec3{1, 2, 3})).find(5).empty());
}

TEST_CASE("a stem takes the columns near its axis out of the raster, along its lean") {
  std::vector<vec3> points;
  for (int x = -30; x < 30; ++x)
    for (int y = -30; y < 30; ++y) points.push_back({0.05 * x + 0.02, 0.05 * y + 0.02, 41.5});
  const cluster carpet(points);
  column_raster raster(carpet.understory.points(), carpet.members, 0.25);
  const cylinder c{{0.2, -0.1, 41.5}, vec3{0.4, 0.1, 1}.normalized(), 0.1, 0};
  remove_stem(raster, {{-1.5, -1.5}, {1.5, 1.5}}, c);
  std::set<std::pair<int, int>> left;
  raster.for_each_in({{-9, -9}, {9, 9}}, 1, [&](point_index i) {
    const vec3f p = carpet.understory.points()[i];
    left.insert({int(std::floor(p.x / 0.05f)), int(std::floor(p.y / 0.05f))});
  });
  std::size_t gone = 0;
  for (int x = -30; x < 30; ++x)
    for (int y = -30; y < 30; ++y) {
      const vec2 from{0.05 * (x + 0.5) - 0.2, 0.05 * (y + 0.5) + 0.1};
      double nearest = 1e9;
      for (double h = -1.5; h <= 1.5; h += 0.001)
        nearest = std::min(nearest, (from - h * vec2{0.4, 0.1}).norm());
      if (std::abs(nearest - 0.15) < 0.002) continue;  // rounding decides
      CHECK((left.count({x, y}) == 0) == (nearest < 0.15));
      gone += nearest < 0.15;
    }
  CHECK(gone > 100);
}

}  // namespace globalmatch::test_column_search
