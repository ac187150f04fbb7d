#include "globalmatch/detail/mapping/lowest_points.hpp"

#include "catch.hpp"
#include "containers.hpp"
#include "forest_scenes.hpp"
#include "oracles/naive_lowest_points.hpp"
#include "support/message_of.hpp"

namespace globalmatch::test_lowest_points {

using namespace detail;

using Eigen::Vector3d;
using Eigen::Vector3f;

namespace {

constexpr double resolution = 0.25;  // [m]
using scenes::nan;
const Vector3d up = Vector3d::UnitZ();

template <class R>
lowest_raster lowest_of(const R& scan, ground_funnel& funnel) {
  return gather_lowest_points(scan, resolution, from_eigen(up), funnel);
}

std::size_t occupied(const lowest_raster& raster) {
  std::size_t count = 0;
  for (int r = 0; r < raster.rows; ++r)
    for (int c = 0; c < raster.columns; ++c) count += raster.holds(c, r) ? 1 : 0;
  return count;
}

std::vector<Vector3d> in_double(const scenes::cloud& points, const Vector3d& shift = Vector3d::Zero()) {
  std::vector<Vector3d> moved;
  for (const Vector3f& p : points) moved.push_back(p.cast<double>() + shift);
  return moved;
}

bool same_bits(const lowest_raster& a, const lowest_raster& b) {
  return a.columns == b.columns && a.rows == b.rows &&
         std::equal(
             a.points.begin(), a.points.end(), b.points.begin(), b.points.end(),
             [](const vec3f& p, const vec3f& q) { return p == q || (std::isnan(p.z) && std::isnan(q.z)); });
}

/// A raster of the given heights, row by row.
lowest_raster raster_of(int columns, int rows, const std::vector<float>& heights) {
  lowest_raster raster;
  raster.resolution = resolution;
  raster.columns = columns;
  raster.rows = rows;
  for (const float z : heights) raster.points.push_back({0, 0, z});
  return raster;
}

/// A tile with so many cells that hold points.
std::unique_ptr<tiled_minima::tile> tile_at(std::int64_t row, std::int64_t column, std::size_t cells) {
  auto tile = std::make_unique<tiled_minima::tile>();
  tile->at.row = row;
  tile->at.column = column;
  for (std::size_t i = 0; i < cells; ++i) tile->keep(i, {1, 0, 0});
  return tile;
}

}  // namespace

TEST_CASE("the lowest points of cells equal those of a naive map, in every container") {
  random_source random(1);
  const scenes::cloud points = scenes::random_cloud(random, 3000, 15);
  containers::for_each_container(points, [&](const std::string& kind, const auto& range) {
    CAPTURE(kind);
    ground_funnel funnel;
    const lowest_raster raster = lowest_of(range, funnel);
    const auto expected =
        oracles::naive_lowest_points(in_double(points), resolution, to_eigen(raster.frame.origin));
    CHECK(occupied(raster) == expected.size());
    int wrong = 0;
    for (const auto& [cell, p] : expected) {
      const vec3f& kept = raster.points[raster.cell(cell.first, cell.second)];
      wrong += raster.frame.to_scan(vec3(kept)) == from_eigen(p) ? 0 : 1;
    }
    CHECK(wrong == 0);
    CHECK(funnel.points == points.size());
    CHECK(funnel.cells == expected.size());
    CHECK(funnel.not_finite == 0);
    CHECK(funnel.cells_apart == 0);
  });
}

TEST_CASE("lowest points are lowest along up") {
  random_source random(2);
  const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(up, Vector3d(0.3, -0.5, 1));
  std::vector<Vector3d> turned;
  for (const Vector3f& p : scenes::random_cloud(random, 2000, 10)) turned.push_back(turn * p.cast<double>());
  ground_funnel funnel;
  const lowest_raster raster = gather_lowest_points(turned, resolution, from_eigen(turn * up), funnel);
  std::vector<Vector3d> levelled;
  for (const Vector3d& p : turned) levelled.push_back(to_eigen(raster.frame.to_local(from_eigen(p))));
  const auto expected = oracles::naive_lowest_points(levelled, resolution, Vector3d::Zero());
  REQUIRE(occupied(raster) == expected.size());
  double largest = 0;
  for (const auto& [cell, p] : expected)
    largest = std::max(largest,
                       (scenes::in_double(raster.points[raster.cell(cell.first, cell.second)]) - p).norm());
  CHECK(largest < 1e-5);
}

TEST_CASE("a scan shifted to map coordinates has the same raster, bit for bit") {
  random_source random(3);
  const scenes::cloud points = scenes::random_cloud(random, 2000, 20);
  ground_funnel funnel;
  const lowest_raster raster = lowest_of(points, funnel);
  for (const Vector3d& shift :
       {Vector3d(500000, 5300000, 1000), Vector3d(-1e6, 1e6 + 1.0 / 1024, 3.0 / 1024)}) {
    ground_funnel shifted_funnel;
    const lowest_raster shifted = lowest_of(in_double(points, shift), shifted_funnel);
    CHECK(same_bits(raster, shifted));
    CHECK(shifted.frame.origin == raster.frame.origin + from_eigen(shift));
  }
}

TEST_CASE("points that are not finite are counted and do not matter") {
  random_source random(4);
  scenes::cloud points = scenes::random_cloud(random, 500, 10);
  ground_funnel funnel, clean_funnel;
  const lowest_raster clean = lowest_of(points, clean_funnel);
  const auto n = float(nan);
  points.insert(points.begin(), {n, 0, 0});
  points.insert(points.begin() + 100, {1, 1, -std::numeric_limits<float>::infinity()});
  points.push_back({2, 2, n});
  points.push_back({2, 2, std::numeric_limits<float>::infinity()});
  points.push_back({n, n, n});
  CHECK(same_bits(clean, lowest_of(points, funnel)));
  CHECK(funnel.points == 505);
  CHECK(funnel.not_finite == 5);
  CHECK(funnel.cells == clean_funnel.cells);
}

TEST_CASE("parts that lie apart are left out and counted, even when they come first") {
  random_source random(5);
  const std::vector<Vector3d> points = in_double(scenes::random_cloud(random, 2000, 20));
  ground_funnel clean_funnel;
  const std::size_t cells = occupied(lowest_of(points, clean_funnel));
  for (const Vector3d& outlier :
       {Vector3d(1e8, 0, 0), Vector3d(0, -1e8, 5), Vector3d(1e8, 1e8, 1e8), Vector3d(100, 100, 0)}) {
    for (const bool first : {true, false}) {
      CAPTURE(outlier.transpose(), first);
      std::vector<Vector3d> scan = points;
      scan.insert(first ? scan.begin() : scan.end(), outlier);
      ground_funnel funnel;
      const lowest_raster raster = lowest_of(scan, funnel);
      CHECK(funnel.cells_apart == 1);
      // The raster's cells begin at the first point.
      CHECK(std::abs(double(occupied(raster)) - double(cells)) <= (first ? 200 : 0));
      CHECK(raster.columns <= 128);
      CHECK(raster.rows <= 128);
      CHECK(funnel.cells == occupied(raster) + 1);
    }
  }
}

TEST_CASE("a point too far away for any raster is left out") {
  ground_funnel funnel;
  CHECK(occupied(lowest_of(std::vector<Vector3d>{{0, 0, 0}, {1, 1, 0}, {1e300, 0, 0}}, funnel)) == 2);
  CHECK(funnel.points == 3);
}

TEST_CASE("the counts of an earlier scan do not matter") {
  const std::vector<Vector3d> points = {{100, 100, 5}, {101, 101, 5}};
  ground_funnel fresh, used{.points = 7, .cells_apart = 3};
  const lowest_raster expected = lowest_of(points, fresh), raster = lowest_of(points, used);
  CHECK(same_bits(raster, expected));
  CHECK(raster.frame.origin == expected.frame.origin);
  CHECK(used.points == 2);
  CHECK(used.cells_apart == 0);
}

TEST_CASE("a scan without finite points has an empty raster") {
  for (const auto& scan : {std::vector<Vector3d>{}, std::vector<Vector3d>(4, Vector3d(0, nan, 0))}) {
    ground_funnel funnel;
    CHECK(lowest_of(scan, funnel).points.empty());
    CHECK(funnel.points == scan.size());
    CHECK(funnel.not_finite == scan.size());
    CHECK(funnel.cells == 0);
  }
}

TEST_CASE("one point, or many equal ones, fill one cell") {
  for (const std::size_t count : {1u, 100u}) {
    ground_funnel funnel;
    const Vector3d p(7.5, -3.25, 2.75);
    const lowest_raster raster = lowest_of(std::vector<Vector3d>(count, p), funnel);
    CHECK(occupied(raster) == 1);
    CHECK(funnel.cells == 1);
    CHECK(raster.holds(0, 0));
    CHECK(raster.frame.to_scan(vec3(raster.points[0])) == from_eigen(p));
  }
}

TEST_CASE("a cell beyond the raster holds nothing") {
  const lowest_raster raster = raster_of(2, 1, {1, 2});
  CHECK(raster.holds(1, 0));
  for (const auto& [c, r] : {std::pair(-1, 0), std::pair(2, 0), std::pair(0, -1), std::pair(0, 1)})
    CHECK_FALSE(raster.holds(c, r));
}

TEST_CASE("gathering lowest points can be cancelled") {
  ground_funnel funnel;
  const execution exec{.on_progress = [](const progress&) { return false; }};
  CHECK_THROWS_AS(gather_lowest_points(std::vector<Vector3d>(5, Vector3d::Zero()), resolution, from_eigen(up),
                                       funnel, exec),
                  operation_cancelled);
}

TEST_CASE("gathering lowest points refuses an up without direction") {
  ground_funnel funnel;
  CHECK(support::message_of([&] {
          gather_lowest_points(std::vector<Vector3d>{}, resolution, vec3{}, funnel);
        }).starts_with("up must be"));
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

}  // namespace globalmatch::test_lowest_points
