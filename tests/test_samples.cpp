#include "globalmatch/detail/mapping/samples.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "globalmatch/detail/mapping/cell_sorter.hpp"
#include "leaning_stems.hpp"

namespace globalmatch::test_samples {

using namespace detail;

using scenes::all_of;
using scenes::as_local_points;
using scenes::leaning_cylinder;
using scenes::points_on;

TEST_CASE("samples on stems are those nearest to the middles of cells, with normals across the axis") {
  random_source random(10);
  stem_map map;
  map.terrain.frame = {{1000, -2000, 300}, levelling_rotation(vec3{-0.2, 0.3, 0.8})};
  stem_cylinder stem;
  stem.cylinder = leaning_cylinder();
  const cell_columns cells =
      sort_into_cells(as_local_points(points_on(stem.cylinder, 6000, -1, 1, 4, random)), cell_width);
  stem.support = all_of(cells.points().size());
  collect_samples({stem}, cells.points(), map, {});
  REQUIRE(map.stem_samples.size() > 100);
  REQUIRE(map.stem_samples.size() < 4000);
  REQUIRE(map.stem_normals.size() == map.stem_samples.size());
  const auto off_middle = [&](const vec3& p) {
    double squares = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double share = p[axis] / cell_width;
      squares += std::pow(share - std::floor(share) - 0.5, 2);
    }
    return squares;
  };
  const auto cell_of = [&](const vec3& p) {
    return std::array{std::floor(p.x / cell_width), std::floor(p.y / cell_width),
                      std::floor(p.z / cell_width)};
  };
  for (std::size_t i = 0; i < map.stem_samples.size(); i += 7) {
    const vec3 p = map.terrain.frame.to_local(from_eigen(map.stem_samples[i]));
    const vec3 normal = map.terrain.frame.rotation * from_eigen(map.stem_normals[i]);
    const vec3 from_axis = p - stem.cylinder.point;
    CHECK(normal.norm() == Approx(1));
    CHECK(std::abs(normal.dot(stem.cylinder.axis)) < 1e-9);
    CHECK(normal.dot(from_axis) == Approx(stem.cylinder.axis_distance(p)));
    for (std::size_t k = 0; k < cells.points().size(); ++k)
      if (const vec3 other(cells.points()[k]); cell_of(other) == cell_of(p))
        CHECK(off_middle(other) > off_middle(p) - 1e-3);
  }
}

TEST_CASE(
    "samples on the ground are all its points, in the frame of the scan, also where there are no stems") {
  stem_map map;
  map.terrain.frame = {{1000, -2000, 300}, levelling_rotation(vec3{0.4, 0.1, 0.9})};
  random_source random(15);
  for (int i = 0; i < 30; ++i)
    map.terrain.ground.push_back(vec3f(vec3{20 * random.uniform(), 9 * random.uniform(), random.normal()}));
  collect_samples({}, {}, map, {});
  REQUIRE(map.ground_samples.size() == 30);
  for (std::size_t i = 0; i < 30; ++i)
    CHECK(
        (map.terrain.frame.to_local(from_eigen(map.ground_samples[i])) - vec3(map.terrain.ground[i])).norm() <
        1e-9);
  CHECK(map.stem_samples.empty());
  CHECK(map.stem_normals.empty());
}

TEST_CASE("samples of several stems follow each other, each with the normal of its own stem") {
  random_source random(16);
  cylinder other = leaning_cylinder();
  other.point += vec3{3, 2, 0.4};
  other.axis = vec3{-0.1, 0.2, 1}.normalized();
  std::vector<vec3> points = points_on(leaning_cylinder(), 900, -0.5, 0.5, 2, random);
  for (const vec3& p : points_on(other, 700, -0.5, 0.5, 3, random)) points.push_back(p);
  const cell_columns cells = sort_into_cells(as_local_points(points), cell_width);
  std::vector<stem_cylinder> stems(2);
  stems[0].cylinder = other, stems[1].cylinder = leaning_cylinder();
  for (std::uint32_t i = 0; i < cells.points().size(); ++i)
    stems[cells.points().x[i] > 8.8f ? 0 : 1].support.push_back(i);
  stem_map map;
  collect_samples(stems, cells.points(), map, {});
  const auto first = thin_in_cells(cells.points(), stems[0].support);
  const auto second = thin_in_cells(cells.points(), stems[1].support);
  REQUIRE(map.stem_samples.size() == first.size() + second.size());
  for (std::size_t k = 0; k < map.stem_samples.size(); ++k) {
    const bool of_first = k < first.size();
    const cylinder& c = stems[of_first ? 0 : 1].cylinder;
    const vec3 p(cells.points()[of_first ? first[k] : second[k - first.size()]]);
    CHECK((from_eigen(map.stem_samples[k]) - p).norm() < 1e-9);
    CHECK(from_eigen(map.stem_normals[k]).dot(p - c.point) == Approx(c.axis_distance(p)));
  }
}

TEST_CASE("of equally near points of a cell the first is kept, and of no points none") {
  local_points sorted;
  for (point_index i = 0; i < 4; ++i) sorted.push_back({-0.01f, 0.02f, 0.03f}, i);
  sorted.push_back({0.01f, 0.02f, 0.03f}, 4);  // the next cell, beyond zero
  CHECK(thin_in_cells(sorted, {0, 1, 2, 3, 4}) == std::vector<point_index>{0, 4});
  CHECK(thin_in_cells(sorted, {2, 3}) == std::vector<point_index>{2});
  CHECK(thin_in_cells(sorted, {}).empty());
}

}  // namespace globalmatch::test_samples
