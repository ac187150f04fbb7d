#include "globalmatch/detail/core/local_points.hpp"

#include <numbers>
#include <utility>

#include <list>
#include <numeric>

#include "catch.hpp"
#include "containers.hpp"
#include "forest_scenes.hpp"
#include "support/message_of.hpp"

namespace globalmatch {

using namespace detail;

using Eigen::Vector3d;
using Eigen::Vector3f;
using support::message_of;

namespace {

using scenes::infinity;
using scenes::nan;

}  // namespace

TEST_CASE("for_each_finite visits the finite points in order and counts the others") {
  const auto n = float(nan), inf = float(infinity);
  const std::vector<Vector3f> points = {{n, 0, 0},   {1, 2, 3}, {0, n, 0},   {0, 0, n},
                                        {0, 0, inf}, {4, 5, 6}, {-inf, 0, 0}};
  containers::for_each_container(points, [](const std::string& kind, const auto& range) {
    CAPTURE(kind);
    std::vector<std::pair<vec3, point_index>> visits;
    const std::size_t skipped = for_each_finite(range, [&](const vec3& p, point_index i) {
      visits.push_back({p, i});
    });
    CHECK(skipped == 5);
    REQUIRE(visits.size() == 2);
    CHECK(visits[0] == std::pair(vec3{1, 2, 3}, point_index(1)));
    CHECK(visits[1] == std::pair(vec3{4, 5, 6}, point_index(5)));
  });
}

TEST_CASE("import_points keeps places, distances and indices of the finite points") {
  const std::vector<Vector3f> points = {{float(nan), 0, 0}, {10, 20, 30}, {11, 22, 33}};
  containers::for_each_container(points, [](const std::string& kind, const auto& range) {
    CAPTURE(kind);
    const local_points local = import_points(range);
    REQUIRE(local.size() == 2);
    CHECK(local.frame.to_scan(vec3(local[0])) == vec3{10, 20, 30});
    CHECK(local[1] - local[0] == vec3f{1, 2, 3});
    CHECK(local.index == std::vector<point_index>{1, 2});
  });
}

TEST_CASE("import_points keeps millimetres of coordinates in the millions") {
  random_source random(3);
  const Vector3d shift(500000, 5300000, 1000);
  const Vector3d up = Vector3d(0.2, -0.1, 1);
  std::vector<Vector3d> points;
  for (int i = 0; i < 500; ++i)
    points.push_back(shift + 500 * random.uniform() * scenes::random_direction(random));
  const local_points local = import_points(points, from_eigen(up));
  double largest = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    largest = std::max(largest, (local.frame.to_scan(vec3(local[i])) - from_eigen(points[i])).norm());
  CHECK(largest < 1e-4);
}

TEST_CASE("import_points gives a shifted scan the same local coordinates") {
  random_source random(4);
  const scenes::cloud points = scenes::random_cloud(random, 300, 100);
  std::vector<Vector3d> shifted;
  for (const Vector3f& p : points) shifted.push_back(p.cast<double>() + Vector3d(500000, 5300000, 1000));
  const local_points a = import_points(points), b = import_points(shifted);
  CHECK(a.x == b.x);
  CHECK(a.y == b.y);
  CHECK(a.z == b.z);
}

TEST_CASE("import_points of no finite points is empty") {
  CHECK(import_points(std::vector<Vector3d>{}).size() == 0);
  CHECK(import_points(std::vector<Vector3d>(3, Vector3d(0, nan, 0))).size() == 0);
}

TEST_CASE("local points are a point range whose heights grow along up") {
  const std::vector<Vector3d> points = {{0, 0, 0}, {5, 0, 0}, {0, 5, 0}};
  const local_points local = import_points(points, {1, 0, 0});
  CHECK(local[1].z - local[0].z == Approx(5));
  CHECK(local[2].z - local[0].z == Approx(0).margin(1e-6));
}

TEST_CASE("select keeps the frame, and the chosen points with their indices in the order of choice") {
  random_source random(5);
  scenes::cloud points = scenes::random_cloud(random, 10, 5);
  points[0].x() = float(nan);
  const local_points local = import_points(points, {1, 1, 1});
  const local_points chosen = select(local, {6, 0, 6});
  REQUIRE(chosen.size() == 3);
  CHECK(chosen.frame.origin == local.frame.origin);
  CHECK(chosen.frame.rotation == local.frame.rotation);
  CHECK(chosen[0] == local[6]);
  CHECK(chosen[1] == local[0]);
  CHECK(chosen[2] == local[6]);
  CHECK(chosen.index == std::vector<point_index>{7, 1, 7});
  CHECK(select(local, {}).size() == 0);
}

TEST_CASE("chunks hold every point once, with its index, in every container and for any number of threads") {
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 150000; ++i) points.push_back({double(i), 1, 2});
  points[70000].y() = std::numeric_limits<double>::quiet_NaN();
  points[149999].z() = std::numeric_limits<double>::infinity();
  const std::list<Eigen::Vector3d> listed(points.begin(), points.end());
  const auto check = [&](const auto& range, int threads) {
    std::vector<std::vector<point_index>> of_chunk;
    std::vector<std::size_t> finite, same;
    read_in_chunks(
        range, {.threads = threads}, "reading",
        [&](std::size_t chunks) {
          of_chunk.resize(chunks);
          finite.resize(chunks);
          same.resize(chunks);
        },
        [&](std::size_t chunk, const auto& visit_points) {
          visit_points([&](const vec3& p, point_index i) {
            same[chunk] += p.x == double(i);
            finite[chunk] += is_finite(p);
            of_chunk[chunk].push_back(i);
          });
        });
    std::vector<point_index> all;
    for (const auto& some : of_chunk) all.insert(all.end(), some.begin(), some.end());
    const auto sum = [](const auto& counts) {
      return std::accumulate(counts.begin(), counts.end(), std::size_t(0));
    };
    CHECK(sum(same) == points.size());
    CHECK(sum(finite) == points.size() - 2);
    CHECK(of_chunk.size() > 1);
    CHECK(all.size() == points.size());
    CHECK(std::is_sorted(all.begin(), all.end()));
  };
  check(points, 1);
  check(points, 2);
  check(listed, 2);
}

}  // namespace globalmatch
