#include "globalmatch/detail/published/stem_points_by_points.hpp"

#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "catch.hpp"
#include "forest_scenes.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "leaning_stems.hpp"

namespace globalmatch::test_stem_points_by_points {

using namespace detail;

using scenes::as_local_points;
using scenes::points_on;

TEST_CASE("vertical points are linked over three of their spacings, five centimetres or what was asked for") {
  local_points understory;
  for (int i = 0; i < 8; ++i) understory.push_back({0.1f * float(i), 0, 0}, point_index(i));
  const std::vector<point_index> vertical = {0, 1, 2, 4, 5, 7};
  const auto clusters_of = [&](float spacing, std::optional<double> link = {}) {
    mapping_options options;
    options.stems.min_points = 1;
    options.link_distance = link;
    const std::vector<local_surface> surfaces(8, {{1, 0, 0}, spacing});
    const point_clusters found = cluster_stem_points(understory, surfaces, vertical, options, {});
    std::vector<std::vector<point_index>> result;
    for (std::size_t c = 0; c < found.size(); ++c) result.emplace_back(found[c].begin(), found[c].end());
    return result;
  };
  using groups = std::vector<std::vector<point_index>>;
  CHECK(clusters_of(0.04f) == groups{{0, 1, 2}, {4, 5}, {7}});  // 0.12
  CHECK(clusters_of(0.07f) == groups{{0, 1, 2, 4, 5, 7}});      // 0.21
  CHECK(clusters_of(0.001f) == groups{{0}, {1}, {2}, {4}, {5}, {7}});
  CHECK(clusters_of(0.001f, 0.15) == groups{{0, 1, 2}, {4, 5}, {7}});
  CHECK(clusters_of(0.07f, 0.15) == groups{{0, 1, 2}, {4, 5}, {7}});
  understory.x[1] = 0.049f;
  CHECK(clusters_of(0.001f).front() == std::vector<point_index>{0, 1});
}

TEST_CASE("stem points by points are thinned, have normals, and are counted as points") {
  random_source random(1);
  std::vector<vec3> points =
      points_on({{3, 4, 21.5}, vec3{0.05, 0, 1}.normalized(), 0.15, 0}, 4000, -1, 1, 6.3, random);
  for (int i = 0; i < 3000; ++i)  // level
    points.push_back({5 + random.uniform(), 5 + random.uniform(), 21 + 0.002 * random.normal()});
  stem_map map;
  map.terrain.frame.origin = {7, 8, 9};
  parted_points parts(as_local_points(points));
  parts.parts.push_back({parts.gathered[0].get(), points.size(), points.size()});  // an empty one
  mapping_options options;
  options.voxel_size = 0.02;
  const stem_points found = stem_points_by_points(std::move(parts), options, map, {});
  const local_points& kept = found.understory.points();
  CHECK_FALSE(map.funnel.by_cells);
  CHECK(map.funnel.thinned == kept.size());
  CHECK(kept.size() < points.size());
  CHECK(kept.frame.origin == vec3{7, 8, 9});
  REQUIRE(found.normals.size() == kept.size());
  CHECK(found.fitter().fit == &fit_by_normals);
  CHECK(found.fitter().normals.data() == found.normals.data());
  std::size_t vertical = 0;
  for (const vec3f& n : found.normals) vertical += !(n == vec3f{}) && 1 - std::abs(n.z) > 0.9f;
  CHECK(map.funnel.stem_points == vertical);
  REQUIRE(found.clusters.size() == 1);
  for (const point_index i : found.clusters[0]) {
    const vec2 from_axis = vec3(kept[i]).xy() - vec2{3 + 0.05 * (kept[i].z - 21.5), 4};
    CHECK(from_axis.norm() == Approx(0.15).margin(0.01));
    CHECK(std::abs(vec3(found.normals[i]).xy().dot(from_axis.normalized())) > 0.9);
  }
  CHECK(map.spacing_near > 0.005);
}

TEST_CASE("a column is fitted with the normals of its own points") {
  random_source random(2);
  const cylinder truth{{3, 4, 21.5}, vec3{0.1, -0.05, 1}.normalized(), 0.2, 0};
  const auto points = points_on(truth, 300, -1, 1, 3, random);
  std::vector<vec3f> normals(1000, vec3f(0, 0, 1));  // of points that are not in the column
  column_sample column;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const vec3 from = points[k] - truth.point;
    column.members.push_back(point_index(3 * k + 1));
    column.points.push_back(points[k]);
    normals[3 * k + 1] = vec3f((from - from.dot(truth.axis) * truth.axis).normalized());
  }
  random_source draws(3);
  const auto found = fit_by_normals({&fit_by_normals, normals}, column, {}, draws);
  REQUIRE(found);
  CHECK(found->axis.dot(truth.axis) > 0.9999);
  CHECK(found->radius == Approx(0.2).margin(0.002));
}

TEST_CASE("an understory without points has no stem points by points") {
  stem_map map;
  const stem_points found = stem_points_by_points({}, {}, map, {});
  CHECK(found.clusters.size() == 0);
  CHECK(map.funnel.thinned == 0);
  CHECK(map.funnel.stem_points == 0);
}

}  // namespace globalmatch::test_stem_points_by_points
