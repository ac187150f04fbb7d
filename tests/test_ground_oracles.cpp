// Steps of the ground against brute force, in scenes that are neither level nor at zero.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/planes.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "globalmatch/detail/mapping/lowest_points.hpp"
#include "globalmatch/detail/published/cloth_ground.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch {

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

/// A tile with so many cells that hold points.
std::unique_ptr<tiled_minima::tile> tile_at(std::int64_t row, std::int64_t column, std::size_t cells) {
  auto tile = std::make_unique<tiled_minima::tile>();
  tile->at.row = row;
  tile->at.column = column;
  for (std::size_t i = 0; i < cells; ++i) tile->cells[i].z = 1;
  return tile;
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

TEST_CASE("equally low points are merged the same whichever thread came first") {
  tiled_minima::tile a, b;
  for (std::size_t i = 0; i < 50; ++i) {
    a.cells[i].z = b.cells[i].z = -3.5;
    a.cells[i].x = 0.25f, b.cells[i].x = i % 2 == 0 ? 0.5f : 0.25f;
    a.cells[i].y = 0.75f, b.cells[i].y = 0.125f;
  }
  tiled_minima::tile first = a, second = b;
  first.take_lower(b);
  second.take_lower(a);
  for (std::size_t i = 0; i < 50; ++i) {
    CHECK(first.cells[i].x == second.cells[i].x);
    CHECK(first.cells[i].y == second.cells[i].y);
    CHECK(first.cells[i].x == 0.25f);
    CHECK(first.cells[i].y == (i % 2 == 0 ? 0.75f : 0.125f));
  }
}

TEST_CASE("of points at equal heights each order keeps the same") {
  std::vector<vec3> points;
  for (int i = 0; i < 40; ++i)
    points.push_back({-3.3 + 0.011 * ((7 * i) % 40), 5.1 + 0.009 * ((11 * i) % 40), -2});
  const auto kept = [&](std::vector<vec3> order) {
    tiled_minima minima(0.25);
    for (const vec3& p : order) minima.add({&p, 1});  // batches of their own
    std::vector<std::pair<float, float>> places;
    for (const auto& tile : minima.tiles())
      for (const auto& cell : tile->cells)
        if (!cell.empty()) places.push_back({cell.x, cell.y});
    return places;
  };
  const auto given = kept(points);
  CHECK(given.size() >= 2);
  std::reverse(points.begin(), points.end());
  CHECK(kept(points) == given);
}

TEST_CASE("the lowest point of each cell is kept, with its place, on all sides of the first point") {
  random_source random(203);
  std::vector<vec3> points;
  for (int i = 0; i < 250; ++i)
    points.push_back({8 * random.uniform() - 5, 6 * random.uniform() - 2, 3 * random.normal() - 7});
  constexpr double resolution = 0.5;
  tiled_minima minima(resolution);
  minima.add(points);
  std::size_t cells = 0;
  for (const auto& tile : minima.tiles())
    for (std::size_t i = 0; i < tiled_minima::cells_a_tile; ++i) {
      const auto& kept = tile->cells[i];
      const double x = (double(tile->at.column) * 32 + double(i % 32)) * resolution,
                   y = (double(tile->at.row) * 32 + double(i / 32)) * resolution;
      const vec3* lowest = nullptr;
      for (const vec3& p : points)
        if (p.x >= x && p.x < x + resolution && p.y >= y && p.y < y + resolution &&
            (!lowest || p.z < lowest->z))
          lowest = &p;
      REQUIRE(kept.empty() == (lowest == nullptr));
      if (!lowest) continue;
      CHECK(kept.z == lowest->z);
      CHECK(double(tile->at.column) * 16 + kept.x == Approx(lowest->x).margin(1e-5));
      CHECK(double(tile->at.row) * 16 + kept.y == Approx(lowest->y).margin(1e-5));
      ++cells;
    }
  CHECK(cells > 60);
}

TEST_CASE("the main group is the one of most cells, not of most tiles, and goes around corners") {
  std::vector<std::unique_ptr<tiled_minima::tile>> owned;
  std::vector<gathered_tile> tiles;
  const auto add = [&](std::int64_t row, std::int64_t column, std::size_t cells) {
    owned.push_back(tile_at(row, column, cells));
    tiles.push_back({owned.back().get(), cells, 1});
  };
  add(-4, 0, 10), add(-4, 1, 10), add(-3, 2, 10), add(-2, 3, 10);  // four tiles, 40 cells
  add(5, 5, 200), add(6, 4, 100);                                  // two at a corner, 300
  add(20, 20, 250);
  CHECK(main_group(tiles) == std::vector<std::size_t>{4, 5});
}

TEST_CASE("the cloth falls on the lowest point of each node") {
  random_source random(204);
  lowest_raster lowest;
  lowest.columns = 10, lowest.rows = 6;
  for (int i = 0; i < 60; ++i)
    lowest.points.push_back(i % 7 == 3 ? no_point : vec3f(vec3{0.0, 0.0, 300 + random.normal()}));
  const auto minima = cloth_cell_minima(lowest, 5, 3);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 5; ++c) {
      float expected = std::numeric_limits<float>::infinity();
      for (int k = 0; k < 4; ++k) {
        const float z = lowest.points[lowest.cell(2 * c + k % 2, 2 * r + k / 2)].z;
        if (!std::isnan(z)) expected = std::min(expected, z);
      }
      CHECK(minima[std::size_t(5 * r + c)] == expected);
    }
}

TEST_CASE("the terrain is bilinear between nodes, and goes on beyond the last ones") {
  terrain ground;
  ground.resolution = 0.5;
  ground.columns = 6, ground.rows = 4;
  const auto height = [](double x, double y) { return 20 + 3 * x - 2 * y + 0.7 * x * y; };
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 6; ++c) {
      ground.heights.push_back(float(height((c + 0.5) * 0.5, (r + 0.5) * 0.5)));
      ground.has_data.push_back(c == 4 && r == 1 ? 0 : 1);
    }
  for (const auto& [x, y] : {std::pair(0.3, 0.9), {1.1, 0.6}, {2.2, 1.6}, {0.05, 0.1}, {2.95, 1.9}})
    CHECK(ground.interpolated_height(x, y) == Approx(height(x, y)).epsilon(1e-5));
  CHECK_FALSE(ground.height_at(2.25, 0.75));
  CHECK(ground.height_at(0.75, 1.75).has_value());
  CHECK_FALSE(ground.height_at(1, 2.1));
}

TEST_CASE("ground points of the nodes around a place are visited, each once") {
  random_source random(205);
  terrain ground;
  ground.resolution = 0.5;
  ground.columns = 12, ground.rows = 8;
  ground.first_ground.push_back(0);
  for (int r = 0; r < 8; ++r)
    for (int c = 0; c < 12; ++c) {
      ground.heights.push_back(0);
      for (std::uint32_t k = random.below(3); k > 0; --k)
        ground.ground.push_back(vec3f(vec3{(c + random.uniform()) * 0.5, (r + random.uniform()) * 0.5, 1}));
      ground.first_ground.push_back(std::uint32_t(ground.ground.size()));
    }
  for (const auto& [x, y] : {std::pair(4.4, 1.3), {0.2, 3.8}, {5.9, 0.1}}) {
    std::size_t visited = 0, expected = 0;
    ground.for_each_ground_near(x, y, 0.8, [&, x = x, y = y](const vec3f& p) {
      ++visited;
      CHECK(std::abs(p.x - x) < 0.8 + 0.5);
      CHECK(std::abs(p.y - y) < 0.8 + 0.5);
    });
    const auto node = [](double v) { return std::floor(v / 0.5); };
    for (const vec3f& p : ground.ground)
      expected += node(p.x) >= node(x - 0.8) && node(p.x) <= node(x + 0.8) && node(p.y) >= node(y - 0.8) &&
                  node(p.y) <= node(y + 0.8);
    CHECK(visited == expected);
  }
}

}  // namespace globalmatch
