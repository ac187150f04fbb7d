#include "globalmatch/detail/core/wrapped_grid.hpp"

#include <algorithm>
#include <set>

#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"

namespace globalmatch::test_wrapped_grid {

using namespace detail;

namespace {

using point2 = std::array<double, 2>;

std::vector<point2> random_points(std::size_t count, double extent, random_source& random) {
  std::vector<point2> points(count);
  for (point2& p : points)
    for (double& c : p) c = extent * (random.uniform() - 0.5);
  return points;
}

template <class Point>
auto grid_of(const std::vector<Point>& points, typename Point::value_type cell) {
  using grid = wrapped_grid<typename Point::value_type, std::tuple_size_v<Point>>;
  return grid(points.size(), cell, [&](std::size_t i) {
    return typename grid::item{points[i], static_cast<std::uint32_t>(i)};
  });
}

/// Indices of the points in a box, each as often as it was visited.
std::vector<std::uint32_t> found_near(const wrapped_grid<double, 2>& grid, const point2& center,
                                      double reach) {
  std::vector<std::uint32_t> found;
  grid.for_each_near(center, reach, [&](const auto& item) { found.push_back(item.label); });
  std::sort(found.begin(), found.end());
  return found;
}

std::vector<std::uint32_t> brute_force(const std::vector<point2>& points, const point2& center,
                                       double reach) {
  std::vector<std::uint32_t> found;
  for (std::uint32_t i = 0; i < points.size(); ++i)
    if (std::abs(points[i][0] - center[0]) <= reach && std::abs(points[i][1] - center[1]) <= reach)
      found.push_back(i);
  return found;
}

}  // namespace

TEST_CASE("a wrapped grid finds what brute force finds, each point once, for cells and boxes of any size") {
  random_source random(1);
  for (const std::size_t count : {0u, 1u, 2u, 7u, 100u, 1000u}) {
    const auto points = random_points(count, 100, random);
    for (const double cell : {0.01, 1.0, 30.0, 1e4}) {
      const auto grid = grid_of(points, cell);
      REQUIRE(grid.size() == count);
      for (const double reach : {0.0, 0.5, 10.0, 1e6}) {
        const point2 center = random_points(1, 120, random).front();
        CHECK(found_near(grid, center, reach) == brute_force(points, center, reach));
      }
    }
  }
}

TEST_CASE("a wrapped grid holds points however far apart, and infinitely many at one place") {
  random_source random(2);
  auto points = random_points(200, 50, random);
  points.push_back({1e12, -1e12});
  points.push_back({-1e300, 1e300});
  points.insert(points.end(), 100, {1, 1});
  const auto grid = grid_of(points, 1.0);
  for (const point2& center : {point2{1e12, -1e12}, point2{-1e300, 1e300}, point2{1, 1}, point2{20, 20}})
    CHECK(found_near(grid, center, 2) == brute_force(points, center, 2));
}

TEST_CASE("a wrapped grid of three dimensions finds what brute force finds") {
  random_source random(3);
  std::vector<std::array<float, 3>> points(2000);
  for (auto& p : points)
    for (float& c : p) c = static_cast<float>(15 * random.uniform());
  const auto grid = grid_of(points, 0.2f);
  for (int query = 0; query < 50; ++query) {
    const auto& center = points[random.below(2000)];
    const float reach = 0.4f;
    std::set<std::uint32_t> expected, found;
    for (std::uint32_t i = 0; i < points.size(); ++i) {
      bool near = true;
      for (std::size_t d = 0; d < 3; ++d) near = near && std::abs(points[i][d] - center[d]) <= reach;
      if (near) expected.insert(i);
    }
    grid.for_each_near(center, reach, [&](const auto& item) { CHECK(found.insert(item.label).second); });
    CHECK(found == expected);
  }
}

TEST_CASE("a wrapped grid visits its points in one order, whatever parts they were sorted in") {
  using grid = wrapped_grid<double, 2>;
  random_source random(4);
  const auto points = random_points(500, 10, random);  // some ten to a cell
  const auto visited = [&](const grid& g) {
    std::vector<std::uint32_t> order;
    g.for_each_near({0, 0}, 4, [&](const auto& item) { order.push_back(item.label); });
    return order;
  };
  const auto in_one = visited(grid_of(points, 2.0));
  REQUIRE(in_one.size() > 100);
  for (const std::size_t parts : {2u, 3u, 7u}) {
    CAPTURE(parts);
    const grid in_parts(
        points.size(), 2.0, parts,
        [&](std::size_t part, std::size_t all, const auto& visit) {
          for (auto i = part * points.size() / all; i < (part + 1) * points.size() / all; ++i)
            visit(grid::item{points[i], static_cast<std::uint32_t>(i)});
        },
        [](std::size_t all, const auto& work) {
          for (std::size_t part = all; part-- > 0;) work(part);  // in any order
        });
    CHECK(visited(in_parts) == in_one);
  }
}

TEST_CASE("cells of any width find the same points") {
  using grid = wrapped_grid<float, 2>;
  random_source random(5);
  std::vector<std::array<float, 2>> points;
  for (int i = 0; i < 50; ++i) points.push_back({float(random.uniform()), float(random.uniform())});
  for (const float cell : {0.0f, 1e-40f, 1e-6f, 0.1f, 1e20f, std::numeric_limits<float>::infinity()}) {
    CAPTURE(cell);
    const grid g(points.size(), cell, [&](std::size_t i) {
      return grid::item{points[i], static_cast<std::uint32_t>(i)};
    });
    std::size_t found = 0, expected = 0;
    g.for_each_near({0.5f, 0.5f}, 0.25f, [&](const auto&) { ++found; });
    for (const auto& p : points) expected += std::abs(p[0] - 0.5f) <= 0.25f && std::abs(p[1] - 0.5f) <= 0.25f;
    CHECK(found == expected);
    std::size_t all = 0;
    g.for_each_near({0.5f, 0.5f}, std::numeric_limits<float>::infinity(), [&](const auto&) { ++all; });
    CHECK(all == points.size());
  }
}

TEST_CASE("a grid that was moved away is empty, and one of too many points is refused") {
  using grid = wrapped_grid<double, 2>;
  random_source random(6);
  grid from = grid_of(random_points(20, 10, random), 1.0);
  const grid to = std::move(from);
  CHECK(to.size() == 20);
  CHECK(from.size() == 0);
  CHECK(!from.any_near({5, 5}, 10, [](const auto&) { return true; }));
  CHECK_THROWS_AS(grid(std::size_t(1) << 32, 1.0, [](std::size_t) { return grid::item{}; }),
                  std::length_error);
}

TEST_CASE("points on the border of a box are in it") {
  std::vector<point2> points;
  for (int x = -6; x <= 6; ++x)
    for (int y = -6; y <= 6; ++y) points.push_back({0.5 * x, 0.5 * y});
  const auto grid = grid_of(points, 1.0);
  for (const point2& center : {point2{0, 0}, point2{-1.5, 2}})
    for (const double reach : {0.0, 0.5, 1.0}) {
      const auto found = found_near(grid, center, reach);
      const double across = 4 * reach + 1;
      CHECK(double(found.size()) == across * across);
      CHECK(found == brute_force(points, center, reach));
    }
}

TEST_CASE("the mean occupancy counts the points in the cell of each point") {
  // Four cells, by the number of points: 1, 2, 5 and none.
  const auto grid = grid_of(
      std::vector<point2>{
          {0.5, 0.5}, {1.5, 0.5}, {1.2, 0.1}, {0.1, 1.1}, {0.2, 1.2}, {0.3, 1.3}, {0.4, 1.4}, {0.5, 1.5}},
      1.0);
  CHECK(grid.mean_occupancy() == Approx((1 + 4 + 25) / 8.0));
  CHECK(grid_of(std::vector<point2>{}, 1.0).mean_occupancy() == 0);
}

}  // namespace globalmatch::test_wrapped_grid
