#include "globalmatch/detail/published/cloth.hpp"

#include <cmath>
#include <functional>

#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"

namespace globalmatch::test_cloth {

using namespace detail;

namespace {

constexpr int columns = 40, rows = 30;
constexpr double step = 0.5;  // [m] distance of cells
constexpr float no_height = std::numeric_limits<float>::quiet_NaN();

std::size_t cell(int c, int r) {
  return std::size_t(r * columns + c);
}

std::vector<float> raster_of(const std::function<double(double, double)>& height) {
  std::vector<float> heights;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) heights.push_back(static_cast<float>(height(c * step, r * step)));
  return heights;
}

/// Largest distance [m] of the cloth from the ground.
float max_gap(const cloth& surface, const std::vector<float>& ground) {
  REQUIRE(surface.heights.size() == ground.size());
  float largest = 0;
  for (std::size_t i = 0; i < ground.size(); ++i)
    largest = std::max(largest, std::abs(surface.heights[i] - ground[i]));
  return largest;
}

double steep_hills(double x, double y) {
  return 100 + std::sin(x / 3) + 0.5 * std::cos(y / 2);
}

}  // namespace

TEST_CASE("the cloth lies on level ground") {
  const auto ground = raster_of([](double, double) { return -7.5; });
  const cloth surface = simulate_cloth(ground, columns, rows);
  CHECK(surface.columns == columns);
  CHECK(surface.rows == rows);
  CHECK(max_gap(surface, ground) == 0);
}

TEST_CASE("the cloth lies within the ground band of slopes up to 30 degrees and of rolling ground") {
  for (const double gradient : {0.1, 0.27, 0.58}) {
    CAPTURE(gradient);
    const auto slope = raster_of([&](double x, double) { return gradient * x; });
    CHECK(max_gap(simulate_cloth(slope, columns, rows), slope) < 0.5f);
    const auto diagonal = raster_of([&](double x, double y) { return gradient * (x + y) * std::sqrt(0.5); });
    CHECK(max_gap(simulate_cloth(diagonal, columns, rows), diagonal) < 0.5f);
  }
  const auto hills = raster_of(steep_hills);
  CHECK(max_gap(simulate_cloth(hills, columns, rows), hills) < 0.5f);
}

TEST_CASE("the cloth does not climb trees that stand on the ground") {
  random_source random(1);
  const auto ground = raster_of(steep_hills);
  auto lowest = ground;
  for (int tree = 0; tree < 40; ++tree)  // crowns whose lowest branches hide the ground of 2 x 2 cells
    for (const auto& [c, r] : {std::pair(0, 0), {0, 1}, {1, 0}, {1, 1}}) {
      const int column = std::min(columns - 1, int(random.below(columns)) + c);
      const int row = std::min(rows - 1, int(random.below(rows)) + r);
      lowest[cell(column, row)] = ground[cell(column, row)] + 2 + 3 * float(random.uniform());
    }
  CHECK(max_gap(simulate_cloth(lowest, columns, rows), ground) < 0.7f);
}

TEST_CASE("the cloth spans cells without points") {
  const auto ground = raster_of(steep_hills);
  auto lowest = ground;
  for (int r = 10; r < 16; ++r)
    for (int c = 10; c < 16; ++c) lowest[cell(c, r)] = no_height;
  for (int r = 0; r < rows; ++r) lowest[cell(0, r)] = lowest[cell(columns - 1, r)] = no_height;
  const cloth surface = simulate_cloth(lowest, columns, rows);
  CHECK(max_gap(surface, ground) < 0.8f);
}

TEST_CASE("a raster with a single height makes a level cloth, whatever its size") {
  CHECK(simulate_cloth({5}, 1, 1).heights == std::vector<float>{5});
  std::vector<float> lowest(std::size_t(columns * rows), no_height);
  lowest[cell(17, 3)] = 5;
  CHECK(simulate_cloth(lowest, columns, rows).heights == std::vector<float>(lowest.size(), 5));
}

TEST_CASE("a raster of one row or one column makes a cloth") {
  const std::vector<float> heights = {1, 1.1f, no_height, 1.3f, 1.4f};
  CHECK(simulate_cloth(heights, 5, 1).heights == simulate_cloth(heights, 1, 5).heights);
}

TEST_CASE("a cloth over shifted ground is the same, shifted") {
  const auto ground =
      raster_of([](double x, double y) { return std::round(1024 * 0.1 * (x + 2 * y)) / 1024; });
  auto shifted = ground;
  for (float& z : shifted) z += 64;
  const cloth low = simulate_cloth(ground, columns, rows), high = simulate_cloth(shifted, columns, rows);
  float largest = 0;
  for (std::size_t i = 0; i < ground.size(); ++i)
    largest = std::max(largest, std::abs(high.heights[i] - low.heights[i] - 64));
  CHECK(largest < 1e-3f);
}

TEST_CASE("a cell takes the height of the nearest cell with one, along rows and columns") {
  std::vector<float> heights = {
      no_height, no_height, 3,         no_height, no_height, no_height, no_height,  //
      no_height, no_height, no_height, no_height, no_height, no_height, 7};
  detail::fill_from_nearest(heights, 7, 2);
  CHECK(heights == std::vector<float>{3, 3, 3, 3, 3, 7, 7, 3, 3, 3, 3, 7, 7, 7});
}

TEST_CASE("the fall of the cloth can be watched and cancelled") {
  int reports = 0;
  const auto ground = raster_of(steep_hills);
  const execution watch{.on_progress = [&](const progress& p) {
    ++reports;
    return p.stage == "ground";
  }};
  simulate_cloth(ground, columns, rows, {}, watch);
  CHECK(reports > 0);
  const execution cancel{.on_progress = [](const progress&) { return false; }};
  CHECK_THROWS_AS(simulate_cloth(ground, columns, rows, {}, cancel), operation_cancelled);
}

}  // namespace globalmatch::test_cloth
