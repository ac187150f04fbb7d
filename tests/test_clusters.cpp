#include "globalmatch/detail/mapping/cell_sorter.hpp"
#include "globalmatch/detail/mapping/clusters.hpp"
#include "globalmatch/detail/published/point_clusters.hpp"

#include <map>

#include "catch.hpp"
#include "containers.hpp"
#include "forest_scenes.hpp"
#include "oracles/union_find_clusters.hpp"
#include "support/message_of.hpp"

namespace globalmatch {

using namespace detail;

using Eigen::Vector3d;
using Eigen::Vector3f;
using support::message_of;

namespace {

using groups = std::vector<std::vector<point_index>>;

groups groups_of(const point_clusters& clusters) {
  groups result;
  for (std::size_t c = 0; c < clusters.size(); ++c)
    result.emplace_back(clusters[c].begin(), clusters[c].end());
  return result;
}

}  // namespace

TEST_CASE("clusters equal brute-force union-find, in every container") {
  random_source random(1);
  const scenes::cloud points = scenes::random_cloud(random, 400, 10);
  for (const double link : {0.3, 0.8, 1.2, 3.0})
    for (const std::size_t min_points : {1u, 2u, 5u}) {
      const groups expected =
          oracles::union_find_clusters(points, std::vector<float>(points.size(), float(link)), min_points);
      containers::for_each_container(points, [&](const std::string& kind, const auto& range) {
        CAPTURE(kind, link, min_points);
        CHECK((groups_of(cluster_points(range, link, min_points)) == expected));
      });
    }
}

TEST_CASE("clusters with a link distance of each point equal brute-force union-find") {
  random_source random(2);
  for (int repetition = 0; repetition < 20; ++repetition) {
    const scenes::cloud points = scenes::random_cloud(random, 300, 10);
    std::vector<float> links;
    for (std::size_t i = 0; i < points.size(); ++i)
      links.push_back(float(scenes::in_range(random, 0.1, i % 10 == 0 ? 3 : 0.8)));
    const groups expected = oracles::union_find_clusters(points, links, 2);
    CHECK((groups_of(cluster_points(scenes::as_local(points), links, 2)) == expected));
  }
}

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

TEST_CASE("two points are linked by the larger of their distances, whichever comes first") {
  const local_points points = scenes::as_local({{0, 0, 0}, {1, 0, 0}});
  CHECK(cluster_points(points, std::vector<float>{2, 0.1f}, 1).size() == 1);
  CHECK(cluster_points(points, std::vector<float>{0.1f, 2}, 1).size() == 1);
  CHECK(cluster_points(points, std::vector<float>{0.1f, 0.1f}, 1).size() == 2);
}

TEST_CASE("points exactly the link distance apart are not linked") {
  const scenes::cloud lattice = scenes::lattice_cloud(5);
  CHECK(cluster_points(lattice, 1, 1).size() == lattice.size());
  CHECK(cluster_points(lattice, 1.001, 1).size() == 1);
}

TEST_CASE("clusters of fewer points than asked for are left out") {
  const scenes::cloud points = {{0, 0, 0}, {9, 0, 0}, {0.5f, 0, 0}, {9.5f, 0, 0}, {1, 0, 0}, {20, 0, 0}};
  CHECK(groups_of(cluster_points(points, 0.6, 1)) == groups{{0, 2, 4}, {1, 3}, {5}});
  CHECK(groups_of(cluster_points(points, 0.6, 2)) == groups{{0, 2, 4}, {1, 3}});
  CHECK(groups_of(cluster_points(points, 0.6, 3)) == groups{{0, 2, 4}});
  CHECK(cluster_points(points, 0.6, 4).size() == 0);
}

TEST_CASE("equal points and a long chain are one cluster each") {
  CHECK(cluster_points(scenes::cloud(500, Vector3f(1, 2, 3)), 0.01).size() == 1);
  scenes::cloud chain;
  for (int i = 0; i < 5000; ++i) chain.push_back({float(i * 37 % 5000), 0, 0});
  CHECK(cluster_points(chain, 1.5).size() == 1);
}

TEST_CASE("without points there are no clusters") {
  CHECK(cluster_points(scenes::cloud{}, 1).size() == 0);
  CHECK(cluster_points(local_points{}, {}, 1).size() == 0);
}

TEST_CASE("points that are not finite belong to no cluster, and members are the caller's indices") {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  const scenes::cloud points = {{nan, 0, 0}, {0, 0, 0}, {0, nan, 0}, {0.5f, 0, 0}};
  CHECK(groups_of(cluster_points(points, 1)) == groups{{1, 3}});
}

TEST_CASE("an outlier changes no other cluster, wherever it stands") {
  const std::vector<Vector3d> near = {{0, 0, 0}, {0.5, 0, 0}, {5, 0, 0}};
  for (const bool first : {false, true}) {
    CAPTURE(first);
    std::vector<Vector3d> points = near;
    points.insert(first ? points.begin() : points.end(), Vector3d(1e9, 1e9, 1e9));
    CHECK(cluster_points(points, 1).size() == 3);
  }
}

TEST_CASE("clusters of shifted points are the same") {
  random_source random(3);
  const scenes::cloud points = scenes::random_cloud(random, 300, 10);
  std::vector<Vector3d> shifted;
  for (const Vector3f& p : points) shifted.push_back(p.cast<double>() + Vector3d(500000, 5300000, 1000));
  CHECK(groups_of(cluster_points(shifted, 0.8)) == groups_of(cluster_points(points, 0.8)));
}

TEST_CASE("clustering refuses bad link distances by name") {
  const scenes::cloud points(3, Vector3f::Zero());
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()})
    CHECK(message_of([&] { cluster_points(points, bad); }).starts_with("link_distance"));
  CHECK(message_of([&] {
          cluster_points(scenes::as_local(points), std::vector<float>(2, 1), 1);
        }).starts_with("link_distances"));
}

TEST_CASE("clustering can be cancelled") {
  const execution exec{.on_progress = [](const progress& p) { return p.stage != "clusters"; }};
  CHECK_THROWS_AS(cluster_points(scenes::cloud(3, Vector3f::Zero()), 1, 1, exec), operation_cancelled);
}

}  // namespace globalmatch
