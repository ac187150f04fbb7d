#include "globalmatch/detail/mapping/stem_points.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "catch.hpp"
#include "forest_scenes.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "leaning_stems.hpp"

namespace globalmatch::test_stem_points {

using namespace detail;

using scenes::as_local_points;
using scenes::points_on;

namespace {

/// Two stems that lean, and a shrub.
std::vector<vec3> understory_points(random_source& random) {
  std::vector<vec3> points =
      points_on({{3, 4, 21.5}, vec3{0.1, 0, 1}.normalized(), 0.15, 0}, 3000, -1.2, 1.2, 6.3, random);
  for (const vec3& p :
       points_on({{6, 2, 22}, vec3{0, -0.1, 1}.normalized(), 0.1, 0}, 2000, -1, 1, 6.3, random))
    points.push_back(p);
  for (int i = 0; i < 400; ++i)
    points.push_back({8 + 0.8 * random.uniform(), 6 + 0.8 * random.uniform(), 21 + 0.8 * random.uniform()});
  return points;
}

}  // namespace

TEST_CASE("the spacings that are noted are the first and the last decile of the positive ones, by sorting") {
  random_source random(1);
  for (const std::size_t count : {1u, 2u, 10u, 11u, 500u}) {
    std::vector<float> spacings, positive;
    for (std::size_t i = 0; i < count; ++i) {
      positive.push_back(float(0.001 + random.uniform()));
      spacings.push_back(positive.back());
      spacings.push_back(i % 2 == 0 ? 0 : -float(random.uniform()));
    }
    spacings.push_back(std::numeric_limits<float>::quiet_NaN());
    std::sort(positive.begin(), positive.end());
    stem_map map;
    record_spacing(spacings, map);
    CHECK(map.spacing_near == positive[std::size_t(0.1 * double(count - 1))]);
    CHECK(map.spacing_far == positive[std::size_t(0.9 * double(count - 1))]);
  }
}

TEST_CASE("without a positive spacing none is noted") {
  stem_map map;
  map.spacing_near = 0.5, map.spacing_far = 0.7;
  record_spacing({}, map);
  record_spacing({0, -1, 0}, map);
  CHECK(map.spacing_near == 0.5);
  CHECK(map.spacing_far == 0.7);
}

TEST_CASE("stem points by cells are the vertical ones, clustered by stem, and the funnel counts them") {
  random_source random(2);
  const std::vector<vec3> points = understory_points(random);
  stem_map map;
  map.terrain.frame.origin = {70, 80, 90};
  parted_points parts(as_local_points(points));  // as a scan that is read in parts
  const local_points& all = *parts.gathered[0];
  parts.parts = {{&all, 0, all.size() / 3}, {&all, all.size() / 3, all.size()}};
  const stem_points found = stem_points_by_cells(std::move(parts), {}, map, {});
  CHECK(found.understory.points().size() == points.size());
  CHECK(found.understory.points().frame.origin == vec3{70, 80, 90});
  CHECK(found.normals.empty());
  CHECK(found.fitter().fit == &fit_along_line);
  CHECK(map.funnel.by_cells);
  CHECK(map.funnel.thinned == found.understory.cells());
  const auto surfaces = estimate_surfaces(found.understory, {}, {});
  CHECK(map.funnel.stem_points ==
        std::size_t(std::count_if(surfaces.begin(), surfaces.end(),
                                  [](const auto& s) { return is_stem_cell(s, {}); })));
  CHECK(map.funnel.stem_points < map.funnel.thinned);
  CHECK(map.spacing_near > 0);
  CHECK(map.spacing_near < map.spacing_far);
  std::size_t of_stems[2] = {0, 0};
  for (std::size_t c = 0; c < found.clusters.size(); ++c) {
    bool has[2] = {false, false};
    for (const point_index i : found.clusters[c])
      for (const int s : {0, 1}) {
        const vec3 axis = s == 0 ? vec3{3, 4, 0} : vec3{6, 2, 0};
        const bool near = (vec3(found.understory.points()[i]) - axis).xy().norm() < 0.4;
        has[s] = has[s] || near;
        of_stems[s] += near;
      }
    CHECK_FALSE((has[0] && has[1]));
  }
  CHECK(of_stems[0] > 2700);
  CHECK(of_stems[1] > 1800);
}

TEST_CASE("an understory without points has no stem points, and counts none") {
  stem_map map;
  const stem_points found = stem_points_by_cells({}, {}, map, {});
  CHECK(found.understory.cells() == 0);
  CHECK(found.clusters.size() == 0);
  CHECK(map.funnel.thinned == 0);
  CHECK(map.funnel.stem_points == 0);
  CHECK(map.spacing_near == 0);
}

}  // namespace globalmatch::test_stem_points
