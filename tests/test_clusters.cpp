#include "globalmatch/detail/mapping/clusters.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <vector>

#include "catch.hpp"
#include "forest_scenes.hpp"
#include "globalmatch/detail/mapping/cell_sorter.hpp"

namespace globalmatch::test_clusters {

using namespace detail;

using Eigen::Vector3f;

namespace {

using groups = std::vector<std::vector<point_index>>;

groups groups_of(const point_clusters& clusters) {
  groups result;
  for (std::size_t c = 0; c < clusters.size(); ++c)
    result.emplace_back(clusters[c].begin(), clusters[c].end());
  return result;
}

}  // namespace

TEST_CASE("clusters of cells equal brute-force union-find over cells") {
  random_source random(22);
  for (int repetition = 0; repetition < 12; ++repetition) {
    scenes::cloud cloud = scenes::random_cloud(random, 600, 1);
    if (repetition % 2 == 1)  // a strip of many rows, which are worked on in blocks
      for (Vector3f& p : cloud) p = p.cwiseProduct(Vector3f(0.2f, 15, 0.2f));
    const cell_columns cells = sort_into_cells(scenes::as_local(cloud), 0.05);
    if (repetition % 2 == 1) REQUIRE(cells.rows() > 256);
    std::vector<cell_surface> surfaces;
    for (std::size_t i = 0; i < cells.cells(); ++i)
      surfaces.push_back({float(scenes::in_range(random, 0.2, 1)), 0.02f, std::uint8_t(random.below(4))});
    struct place {
      int x, y, z;
    };
    std::vector<place> places(cells.cells());
    for (std::size_t column = 0; column < cells.columns(); ++column)
      for (auto c = cells.cells_begin(column); c < cells.cells_end(column); ++c)
        places[c] = {cells.column_at(column).x, cells.column_at(column).y, cells[c].height};
    detail::disjoint_sets sets(cells.cells());
    for (point_index a = 0; a < cells.cells(); ++a)
      for (point_index b = 0; b < a; ++b) {
        const int away = std::max({std::abs(places[a].x - places[b].x), std::abs(places[a].y - places[b].y),
                                   std::abs(places[a].z - places[b].z)});
        if (is_stem_cell(surfaces[a], {}) && is_stem_cell(surfaces[b], {}) &&
            away <= std::max(surfaces[a].half_width, surfaces[b].half_width))
          sets.join(a, b);
      }
    std::map<point_index, std::vector<point_index>> expected;
    for (point_index c = 0; c < cells.cells(); ++c)
      if (is_stem_cell(surfaces[c], {}))
        for (std::uint32_t p = cells.points_begin(c); p < cells.points_end(c); ++p)
          expected[sets.find(c)].push_back(p);
    groups kept;
    for (auto& [representative, members] : expected)
      if (members.size() >= 3) kept.push_back(members);
    CHECK((groups_of(cluster_cells(cells, surfaces, {}, 3)) == kept));
  }
}

TEST_CASE("without cells, or without stem cells, there are no clusters of cells") {
  const cell_columns none = sort_into_cells(local_points{}, 0.05);
  CHECK(cluster_cells(none, {}, {}, 1).size() == 0);
  const cell_columns some = sort_into_cells(scenes::as_local({{0, 0, 0}, {0.06f, 0, 0}}), 0.05);
  REQUIRE(some.cells() == 2);
  CHECK(cluster_cells(some, std::vector<cell_surface>(2, {0.1f, 0.02f, 1}), {}, 1).size() == 0);
  CHECK(cluster_cells(some, std::vector<cell_surface>(2, {0.9f, 0.02f, 1}), {}, 1).size() == 1);
  CHECK(cluster_cells(some, std::vector<cell_surface>(2, {0.9f, 0.02f, 1}), {}, 3).size() == 0);
}

}  // namespace globalmatch::test_clusters
