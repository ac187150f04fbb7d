#include "globalmatch/detail/published/point_clusters.hpp"

#include <limits>
#include <vector>

#include "catch.hpp"
#include "forest_scenes.hpp"
#include "oracles/union_find_clusters.hpp"
#include "support/message_of.hpp"

namespace globalmatch::test_point_clusters {

using namespace detail;

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

/// With one link distance [m].
point_clusters clusters_of(const scenes::cloud& points, double link, std::size_t min_points = 1,
                           const execution& exec = {}) {
  return cluster_points(scenes::as_local(points), std::vector<float>(points.size(), float(link)), min_points,
                        exec);
}

}  // namespace

TEST_CASE("clusters equal brute-force union-find") {
  random_source random(1);
  const scenes::cloud points = scenes::random_cloud(random, 400, 10);
  for (const double link : {0.3, 0.8, 1.2, 3.0})
    for (const std::size_t min_points : {1u, 2u, 5u}) {
      CAPTURE(link, min_points);
      CHECK(groups_of(clusters_of(points, link, min_points)) ==
            oracles::union_find_clusters(points, std::vector<float>(points.size(), float(link)), min_points));
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

TEST_CASE("two points are linked by the larger of their distances, whichever comes first") {
  const local_points points = scenes::as_local({{0, 0, 0}, {1, 0, 0}});
  CHECK(cluster_points(points, std::vector<float>{2, 0.1f}, 1).size() == 1);
  CHECK(cluster_points(points, std::vector<float>{0.1f, 2}, 1).size() == 1);
  CHECK(cluster_points(points, std::vector<float>{0.1f, 0.1f}, 1).size() == 2);
}

TEST_CASE("points exactly the link distance apart are not linked") {
  const scenes::cloud lattice = scenes::lattice_cloud(5);
  CHECK(clusters_of(lattice, 1, 1).size() == lattice.size());
  CHECK(clusters_of(lattice, 1.001, 1).size() == 1);
}

TEST_CASE("clusters of fewer points than asked for are left out") {
  const scenes::cloud points = {{0, 0, 0}, {9, 0, 0}, {0.5f, 0, 0}, {9.5f, 0, 0}, {1, 0, 0}, {20, 0, 0}};
  CHECK(groups_of(clusters_of(points, 0.6, 1)) == groups{{0, 2, 4}, {1, 3}, {5}});
  CHECK(groups_of(clusters_of(points, 0.6, 2)) == groups{{0, 2, 4}, {1, 3}});
  CHECK(groups_of(clusters_of(points, 0.6, 3)) == groups{{0, 2, 4}});
  CHECK(clusters_of(points, 0.6, 4).size() == 0);
}

TEST_CASE("equal points and a long chain are one cluster each") {
  CHECK(clusters_of(scenes::cloud(500, Vector3f(1, 2, 3)), 0.01).size() == 1);
  scenes::cloud chain;
  for (int i = 0; i < 5000; ++i) chain.push_back({float(i * 37 % 5000), 0, 0});
  CHECK(clusters_of(chain, 1.5).size() == 1);
}

TEST_CASE("without points there are no clusters") {
  CHECK(clusters_of(scenes::cloud{}, 1).size() == 0);
  CHECK(cluster_points(local_points{}, {}, 1).size() == 0);
}

TEST_CASE("an outlier changes no other cluster, wherever it stands") {
  const scenes::cloud near = {{0, 0, 0}, {0.5f, 0, 0}, {5, 0, 0}};
  for (const bool first : {false, true}) {
    CAPTURE(first);
    scenes::cloud points = near;
    points.insert(first ? points.begin() : points.end(), Vector3f(1e9f, 1e9f, 1e9f));
    CHECK(clusters_of(points, 1).size() == 3);
  }
}

TEST_CASE("clustering refuses link distances of other points by name") {
  const local_points points = scenes::as_local(scenes::cloud(3, Vector3f::Zero()));
  CHECK(
      message_of([&] { cluster_points(points, std::vector<float>(2, 1), 1); }).starts_with("link_distances"));
}

TEST_CASE("clustering can be cancelled") {
  const execution exec{.on_progress = [](const progress& p) { return p.stage != "clusters"; }};
  CHECK_THROWS_AS(clusters_of(scenes::cloud(3, Vector3f::Zero()), 1, 1, exec), operation_cancelled);
}

}  // namespace globalmatch::test_point_clusters
