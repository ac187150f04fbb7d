#include "globalmatch/detail/core/planes.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "catch.hpp"
#include "forest_scenes.hpp"
#include "globalmatch/detail/core/random.hpp"

namespace globalmatch::test_planes {

using namespace detail;

namespace {

/// Height at (x, y) of the least squares plane through points, its slope held down as `plane_moments` does.
double plane_height(const std::vector<vec3f>& points, double x, double y) {
  const double n = double(points.size());
  double mx = 0, my = 0, mz = 0;
  for (const vec3f& p : points) mx += p.x / n, my += p.y / n, mz += p.z / n;
  double a = 3e-4, b = 0, c = 3e-4, u = 0, v = 0;
  for (const vec3f& p : points) {
    const double dx = p.x - mx, dy = p.y - my, dz = p.z - mz;
    a += dx * dx / n, b += dx * dy / n, c += dy * dy / n, u += dx * dz / n, v += dy * dz / n;
  }
  const double determinant = a * c - b * b;
  return mz + (u * c - v * b) / determinant * (x - mx) + (v * a - u * b) / determinant * (y - my);
}

std::vector<vec3f> scattered_points(std::size_t count, random_source& random) {
  std::vector<vec3f> points;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = 12 * random.uniform(), y = 9 * random.uniform() + 0.3 * x;
    points.push_back(vec3f(vec3{x, y, 40 + 0.3 * x - 0.2 * y + 0.1 * random.normal()}));
  }
  return points;
}

}  // namespace

TEST_CASE("a plane through moments is that of least squares") {
  random_source random(201);
  for (int trial = 0; trial < 20; ++trial) {
    const auto points = scattered_points(15, random);
    plane_moments moments;
    for (const vec3f& p : points) moments.add(p);
    const local_plane plane = moments.fit(4, 7, 3);
    CHECK(plane.height == Approx(plane_height(points, 4, 7)).epsilon(1e-6));
    CHECK(plane.at(1, 0) == Approx(plane_height(points, 5, 7)).epsilon(1e-6));
    CHECK(plane.at(0, 1) == Approx(plane_height(points, 4, 8)).epsilon(1e-6));
  }
}

TEST_CASE("the planes of a pyramid are those through the blocks around each") {
  random_source random(202);
  const auto points = scattered_points(900, random);
  constexpr int columns = 12, rows = 14, half_width = 1;
  plane_pyramid pyramid;
  const auto& planes = pyramid.fit(1.0, columns, rows, half_width, 5,
                                   [&](int row, plane_moments* moments) {
                                     for (const vec3f& p : points)
                                       if (int(p.y) == row && int(p.x) < columns) moments[int(p.x)].add(p);
                                   },
                                   {});
  std::size_t compared = 0;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      std::vector<vec3f> around;
      for (const vec3f& p : points)
        if (std::abs(int(p.x) - c) <= half_width && std::abs(int(p.y) - r) <= half_width) around.push_back(p);
      const local_plane& plane = planes[std::size_t(r * columns + c)];
      CHECK(plane.known());
      if (around.size() < 5) {  // that of wider blocks, which is of the same slope
        CHECK(plane.height == Approx(40 + 0.3 * (c + 0.5) - 0.2 * (r + 0.5)).margin(1));
        continue;
      }
      CHECK(plane.height == Approx(plane_height(around, c + 0.5, r + 0.5)).epsilon(1e-5));
      ++compared;
    }
  CHECK(compared > 100);
  CHECK(compared < std::size_t(columns * rows));
}

TEST_CASE("planes at all scales go through a slope, next to points and far from them") {
  detail::plane_pyramid pyramid;
  const auto fit = [&](int columns, int rows, const std::vector<vec3f>& points) {
    return pyramid.fit(1, columns, rows, 1, 5,
                       [&](int row, detail::plane_moments* moments) {
                         for (const vec3f& p : points)
                           if (int(p.y) == row) moments[int(p.x)].add(p);
                       },
                       {});
  };
  CHECK(fit(70, 50, {{0.5f, 0.5f, 100}}).size() == 70 * 50);  // forgotten, though its memory is kept
  const auto height = [](double x, double y) { return 2 + 0.3 * x - 0.2 * y; };
  random_source random(31);
  std::vector<vec3f> points;
  for (int i = 0; i < 200; ++i) {  // in one corner
    const double x = scenes::in_range(random, 0, 6), y = scenes::in_range(random, 0, 6);
    points.push_back(vec3f(vec3{x, y, height(x, y)}));
  }
  const auto planes = fit(40, 30, points);
  REQUIRE(planes.size() == 40 * 30);
  for (const auto& [c, r] : {std::pair(2, 2), {5, 5}, {12, 8}, {39, 29}}) {
    const double expected = height(c + 0.5, r + 0.5), away = std::hypot(c, r);
    CHECK(planes[std::size_t(r) * 40 + std::size_t(c)].height ==
          Approx(expected).margin(0.001 + 0.002 * away));
  }
  CHECK_FALSE(fit(40, 30, {}).front().known());
}

TEST_CASE("planes are those through the points of the blocks around each block") {
  constexpr int columns = 37, rows = 41, half_width = 2;  // not whole parts
  random_source random(32);
  std::vector<vec3f> points;
  for (int i = 0; i < 4 * columns * rows; ++i)
    points.push_back(vec3f(vec3{scenes::in_range(random, 0, columns), scenes::in_range(random, 0, rows),
                                scenes::in_range(random, 0, 1)}));
  detail::plane_pyramid pyramid;
  const auto& planes = pyramid.fit(1, columns, rows, half_width, 5,
                                   [&](int row, detail::plane_moments* moments) {
                                     for (const vec3f& p : points)
                                       if (int(p.y) == row) moments[int(p.x)].add(p);
                                   },
                                   {});
  double most = 0;
  std::size_t known = 0;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      detail::plane_moments around;
      for (const vec3f& p : points)
        if (std::abs(int(p.x) - c) <= half_width && std::abs(int(p.y) - r) <= half_width) around.add(p);
      const detail::local_plane& plane = planes[std::size_t(r * columns + c)];
      known += plane.known();
      most = std::max(most, double(std::abs(plane.height - around.fit(c + 0.5, r + 0.5, 5).height)));
    }
  CHECK(known == columns * rows);
  CHECK(most < 1e-5);
}

TEST_CASE("moments that are taken away again leave those of the others, and none are known of too few") {
  random_source random(206);
  const auto points = scattered_points(12, random), others = scattered_points(7, random);
  plane_moments all, some, rest;
  for (const vec3f& p : points) all.add(p), some.add(p);
  for (const vec3f& p : others) all.add(p), rest.add(p);
  plane_moments summed = some;
  summed += rest;
  const auto same = [](const plane_moments& a, const plane_moments& b) {
    const local_plane p = a.fit(3, 5, 3), q = b.fit(3, 5, 3);
    return a.n == b.n && p.height == Approx(q.height) && p.slope_x == Approx(q.slope_x).margin(1e-5) &&
           p.slope_y == Approx(q.slope_y).margin(1e-5);
  };
  CHECK(same(summed, all));
  summed -= rest;
  CHECK(same(summed, some));
  CHECK(some.fit(3, 5, 12).known());
  CHECK_FALSE(some.fit(3, 5, 13).known());
}

TEST_CASE("points at one place have a level plane, and collinear ones no slope across their line") {
  plane_moments pile, line;
  for (int i = 0; i < 8; ++i) {
    pile.add({2, 3, 5});
    line.add({float(i), 4, 7 + 0.5f * float(i)});
  }
  CHECK(pile.fit(9, 9, 3).height == Approx(5));
  CHECK(line.fit(0, 4, 3).slope_x == Approx(0.5).epsilon(1e-3));
  CHECK(line.fit(0, 4, 3).slope_y == Approx(0).margin(1e-9));
  CHECK(line.fit(2, 9, 3).height == Approx(8).margin(0.01));
}

}  // namespace globalmatch::test_planes
