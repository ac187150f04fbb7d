#include "globalmatch/detail/core/local_points.hpp"

#include <algorithm>
#include <limits>
#include <list>
#include <numeric>
#include <vector>

#include "catch.hpp"
#include "forest_scenes.hpp"

namespace globalmatch::test_local_points {

using namespace detail;

TEST_CASE("select keeps the frame, and the chosen points with their indices in the order of choice") {
  random_source random(5);
  local_points local = scenes::as_local(scenes::random_cloud(random, 10, 5));
  local.frame = {{1, 2, 3}, levelling_rotation({1, 1, 1})};
  for (point_index& i : local.index) i += 5;
  const local_points chosen = select(local, {6, 0, 6});
  REQUIRE(chosen.size() == 3);
  CHECK(chosen.frame.origin == local.frame.origin);
  CHECK(chosen.frame.rotation == local.frame.rotation);
  CHECK(chosen[0] == local[6]);
  CHECK(chosen[1] == local[0]);
  CHECK(chosen[2] == local[6]);
  CHECK(chosen.index == std::vector<point_index>{11, 5, 11});
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

}  // namespace globalmatch::test_local_points
