#include "globalmatch/detail/mapping/tiled_minima.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"

namespace globalmatch::test_tiled_minima {

using namespace detail;

TEST_CASE("equally low points are merged the same whichever thread came first") {
  tiled_minima::tile a, b;
  for (std::size_t i = 0; i < 50; ++i) {
    a.keep(i, {-3.5, 0.25f, 0.75f});
    b.keep(i, {-3.5, i % 2 == 0 ? 0.5f : 0.25f, 0.125f});
  }
  tiled_minima::tile first = a, second = b;
  first.take_lower(b);
  second.take_lower(a);
  for (std::size_t i = 0; i < 50; ++i) {
    CHECK(first[i].x == second[i].x);
    CHECK(first[i].y == second[i].y);
    CHECK(first[i].x == 0.25f);
    CHECK(first[i].y == (i % 2 == 0 ? 0.75f : 0.125f));
  }
}

TEST_CASE("heights far up are kept to a micrometre, and of two that are nearly equal the lower") {
  const double high = 123456.789012;
  const std::vector<vec3> points = {{1.1, 1.1, high + 2e-6}, {1.15, 1.1, high}, {1.1, 1.15, high + 1e-6}};
  for (std::size_t first = 0; first < points.size(); ++first) {
    tiled_minima minima(0.25);
    for (std::size_t i = 0; i < points.size(); ++i) minima.add({&points[(first + i) % points.size()], 1});
    REQUIRE(minima.tiles().size() == 1);
    const auto kept = (*minima.tiles().front())[4 * 32 + 4];
    CHECK(kept.z == Approx(high).margin(1e-9));
    CHECK(kept.x == 1.15f);
  }
}

TEST_CASE("which of two points is lower depends on neither threads nor order, also between two floats") {
  const double half = std::ldexp(1.0, -24), little = std::ldexp(1.0, -50);
  const vec3 a{0.2, 0.1, 1 + half - little}, b{0.1, 0.1, 1 + half + little};
  for (const bool a_first : {true, false}) {
    tiled_minima one(0.25), other(0.25);
    one.add({a_first ? &a : &b, 1}), other.add({a_first ? &b : &a, 1});
    tiled_minima::tile merged = *one.tiles().front();
    merged.take_lower(*other.tiles().front());
    one.add({a_first ? &b : &a, 1});
    CHECK(merged[0].x == 0.2f);
    CHECK((*one.tiles().front())[0].x == 0.2f);
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
    for (const tiled_minima::tile* tile : minima.tiles())
      for (std::size_t i = 0; i < tiled_minima::cells_a_tile; ++i)
        if (const auto cell = (*tile)[i]; !cell.empty()) places.push_back({cell.x, cell.y});
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
      const auto kept = (*tile)[i];
      const double x = (double(tile->at.column) * 32 + double(i % 32)) * resolution,
                   y = (double(tile->at.row) * 32 + double(i / 32)) * resolution;
      const vec3* lowest = nullptr;
      for (const vec3& p : points)
        if (p.x >= x && p.x < x + resolution && p.y >= y && p.y < y + resolution &&
            (!lowest || p.z < lowest->z))
          lowest = &p;
      REQUIRE(kept.empty() == (lowest == nullptr));
      if (!lowest) continue;
      CHECK(kept.z == Approx(lowest->z).epsilon(1e-14));
      CHECK(double(tile->at.column) * 16 + kept.x == Approx(lowest->x).margin(1e-5));
      CHECK(double(tile->at.row) * 16 + kept.y == Approx(lowest->y).margin(1e-5));
      ++cells;
    }
  CHECK(cells > 60);
}

TEST_CASE("tiles far from the first point, of which there are many, are kept like near ones") {
  random_source random(207);
  constexpr double resolution = 0.5, tile_size = 16;
  tiled_minima minima(resolution);
  std::vector<vec3> points;
  for (int i = 0; i < 600; ++i) {  // more tiles than the table has at first
    const double x = 1e4 + 16 * (i % 25) + 3.2, y = -3e4 + 16 * double(i / 25) + 9.7;
    points.push_back({x, y, random.normal()});
    points.push_back({x + 0.1, y - 0.1, points.back().z + (i % 2 == 0 ? 1 : -1)});
  }
  for (const vec3& p : points) CHECK(minima.add({&p, 1}) == 0);
  REQUIRE(minima.tiles().size() == 600);
  for (std::size_t i = 0; i < 600; ++i) {
    const tiled_minima::tile& tile = *minima.tiles()[i];
    const vec3& lower = points[2 * i + i % 2];
    CHECK(double(tile.at.column) == std::floor(lower.x / tile_size));
    CHECK(double(tile.at.row) == std::floor(lower.y / tile_size));
    std::size_t held = 0;
    for (std::size_t k = 0; k < tiled_minima::cells_a_tile; ++k) {
      const auto cell = tile[k];
      if (cell.empty()) continue;
      ++held;
      CHECK(cell.z == Approx(lower.z).epsilon(1e-14));
      CHECK(double(tile.at.column) * tile_size + cell.x == Approx(lower.x).epsilon(1e-9));
      CHECK(double(tile.at.row) * tile_size + cell.y == Approx(lower.y).epsilon(1e-9));
    }
    CHECK(held == 1);
  }
}

TEST_CASE("what is no number, infinite or further than any plot is out of range and counted") {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(),
                   inf = std::numeric_limits<double>::infinity();
  const std::vector<vec3> bad = {{nan, 0, 0},  {0, nan, 0},  {0, 0, nan},  {inf, 0, 0},
                                 {0, -inf, 0}, {0, 0, -inf}, {2e11, 0, 0}, {0, 0, -2e11}};
  for (const vec3& p : bad) CHECK_FALSE(tiled_minima::is_within_range(p));
  tiled_minima minima(0.25);
  CHECK(minima.add(bad) == bad.size());
  CHECK(minima.tiles().empty());
  std::vector<vec3> mixed = bad;
  mixed.push_back({1, 2, 3});
  CHECK(minima.add(mixed) == bad.size());
  CHECK(minima.tiles().size() == 1);
  CHECK(minima.add({}) == 0);
  const vec3 far{9e10, -9e10, 9e10};
  CHECK(tiled_minima::is_within_range(far));
  CHECK(minima.add({&far, 1}) == 0);
  CHECK(minima.tiles().size() == 2);
}

}  // namespace globalmatch::test_tiled_minima
