#include "globalmatch/detail/mapping/understory.hpp"

#include "catch.hpp"
#include "containers.hpp"
#include "forest_scenes.hpp"
#include "support/message_of.hpp"

namespace globalmatch::test_understory {

using namespace detail;

using Eigen::Vector3d;
using Eigen::Vector3f;
using support::message_of;

namespace {

/// A sloped plane through (10, 20, 30) over 8 m x 8 m, in a frame whose origin is there.
terrain sloped_terrain(double gradient) {
  terrain ground;
  ground.frame.origin = {10, 20, 30};
  ground.resolution = 0.5;
  ground.columns = ground.rows = 16;
  for (int r = 0; r < 16; ++r)
    for (int c = 0; c < 16; ++c) ground.heights.push_back(static_cast<float>(gradient * (c + 0.5) * 0.5));
  ground.has_data.assign(256, 1);
  return ground;
}

}  // namespace

TEST_CASE("the understory holds both of its limits and nothing beyond them") {
  const terrain ground = sloped_terrain(0);
  const understory_options options{.min_height = 0.25, .max_height = 3};
  const std::vector<Vector3d> scan = {{12, 22, 30.2499}, {12, 22, 30.25}, {12, 22, 31}, {12, 22, 33},
                                      {12, 22, 33.0001}, {12, 22, 29},    {12, 22, 1e9}};
  CHECK(select_understory(scan, ground, options).index == std::vector<point_index>{1, 2, 3});
}

TEST_CASE("heights of the understory are measured from the terrain, in every container") {
  random_source random(1);
  const terrain ground = sloped_terrain(0.5);
  scenes::cloud scan;
  for (int i = 0; i < 500; ++i) {
    const double x = scenes::in_range(random, 0, 8), y = scenes::in_range(random, 0, 8);
    scan.push_back(scenes::exact({10 + x, 20 + y, 30 + scenes::in_range(random, -1, 8)}));
  }
  std::vector<point_index> expected;
  for (point_index i = 0; i < scan.size(); ++i) {
    const double height = double(scan[i].z()) - 30 - 0.5 * (double(scan[i].x()) - 10);
    if (height >= 0.2 && height <= 3) expected.push_back(i);
  }
  REQUIRE(expected.size() > 100);
  containers::for_each_container(scan, [&](const std::string& kind, const auto& range) {
    CAPTURE(kind);
    const local_points understory = select_understory(range, ground);
    CHECK(understory.index == expected);
    CHECK(understory.frame.origin == vec3{10, 20, 30});
    std::size_t exact = 0;
    for (std::size_t i = 0; i < understory.size(); ++i)
      exact += understory[i] == vec3f(vec3::from(scan[understory.index[i]]) - vec3{10, 20, 30}) ? 1 : 0;
    CHECK(exact == understory.size());
  });
}

TEST_CASE("to the very edge of the terrain, and into its corners, heights are measured as it slopes") {
  terrain ground = sloped_terrain(0);
  for (int r = 0; r < 16; ++r)
    for (int c = 0; c < 16; ++c)
      ground.heights[ground.node(c, r)] = float(0.5 * (c + 0.5) - 0.4 * (r + 0.5)) * 0.5f;
  std::vector<Vector3d> scan;
  for (const double across : {0.0, 0.01, 0.2, 7.8, 7.99, 8.0})
    for (const double along : {0.0, 0.01, 0.2, 3.3, 7.8, 7.99, 8.0})
      for (int i = 0; i < 330; ++i)
        for (const auto& [x, y] : {std::pair(across, along), {along, across}})
          scan.push_back({10 + x, 20 + y, 30 + 0.5 * x - 0.4 * y + 0.01 * i + 0.005});
  std::vector<point_index> expected;
  for (point_index i = 0; i < scan.size(); ++i) {
    const double height = scan[i].z() - 30 - 0.5 * (scan[i].x() - 10) + 0.4 * (scan[i].y() - 20);
    if (height >= 0.2 && height <= 3) expected.push_back(i);
  }
  CHECK(select_understory(scan, ground).index == expected);
}

TEST_CASE("along the order of the scan points are kept that lie apart from the one kept before") {
  const terrain ground = sloped_terrain(0);
  std::vector<Vector3d> scan;
  for (int i = 0; i < 40000; ++i) scan.push_back({10.5 + 1.75e-4 * i, 22, 31 + (i % 2 ? 0 : 1e-3)});
  scan[100].z() = 30;  // on the ground
  scan[200].y() = 25;  // elsewhere
  scan[39999] = scan[39998];
  for (const int threads : {1, 2}) {
    auto layer = detail::select_understory_parts(scan, ground, {}, 0.01, {.threads = threads});
    CHECK(layer.in_layer == scan.size() - 1);
    const std::size_t chunks = layer.points.parts.size();
    const local_points kept = detail::join_parts(std::move(layer.points), ground.frame, "understory", {});
    CHECK(kept.index.front() == 0);
    CHECK(std::is_sorted(kept.index.begin(), kept.index.end()));
    CHECK(std::count(kept.index.begin(), kept.index.end(), point_index(200)) == 1);
    CHECK(std::count(kept.index.begin(), kept.index.end(), point_index(100)) == 0);
    std::size_t together = 0;
    for (std::size_t i = 1; i < kept.size(); ++i) together += vec3(kept[i] - kept[i - 1]).norm() < 0.0099;
    CHECK(together <= chunks);  // chunks begin anew
    CHECK(kept.size() > 690);
    CHECK(kept.size() < 720);
  }
  auto all = detail::select_understory_parts(scan, ground, {}, 0, {});
  CHECK(detail::join_parts(std::move(all.points), ground.frame, "understory", {}).size() == all.in_layer);
}

TEST_CASE("how far the scanner saw is told by all points, whatever the threads and the range") {
  const terrain ground = sloped_terrain(0);
  random_source random(7);
  std::vector<Vector3d> scan;
  for (int i = 0; i < 600'000; ++i)  // more than are sampled
    scan.push_back({10 + 8 * random.uniform(), 20 + 8 * random.uniform(), 28 + 8 * random.uniform()});
  scan.push_back({std::nan(""), 22, 31});
  const std::array<double, 3> scanner = {14, 24, 31};
  const auto visible_to = [&](const auto& points, int threads) {
    return detail::select_understory_parts(points, ground, {}, 0, {.threads = threads}, scanner).visible;
  };
  const visible_ranges visible = visible_to(scan, 1);
  REQUIRE_FALSE(visible.empty());
  CHECK(visible.scanner == ground.frame.to_local({14, 24, 31}));
  CHECK(visible_to(scan, 3).ranges == visible.ranges);
  CHECK(visible_to(std::list<Vector3d>(scan.begin(), scan.end()), 2).ranges == visible.ranges);
  const auto furthest = *std::max_element(visible.ranges.begin(), visible.ranges.end());
  CHECK(furthest <= 566);  // [cm] to a corner
  CHECK(furthest > 500);
  CHECK(detail::select_understory_parts(scan, ground, {}, 0, {}).visible.empty());
}

TEST_CASE("points that are not finite or beyond the terrain are not of the understory") {
  const terrain ground = sloped_terrain(0);
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Vector3d> scan = {{nan, 22, 31}, {12, 22, nan}, {9.9, 22, 31}, {12, 28.1, 31},
                                      {1e9, 22, 31}, {12, 22, 31},  {18, 28, 31}};
  CHECK(select_understory(scan, ground).index == std::vector<point_index>{5, 6});
  constexpr double unbounded = std::numeric_limits<double>::infinity();
  const std::vector<Vector3d> infinite = {{12, nan, unbounded}, {12, 22, unbounded}, {12, 22, -unbounded},
                                          {unbounded, 22, 31},  {12, 22, 31},        {12, 22, 3000}};
  CHECK(select_understory(infinite, ground, {-unbounded, unbounded}).index == std::vector<point_index>{4, 5});
  CHECK(select_understory(std::vector<Vector3d>{}, ground).size() == 0);
}

TEST_CASE("without a terrain there is no understory") {
  CHECK(select_understory(std::vector<Vector3d>{{0, 0, 1}}, terrain{}).size() == 0);
}

TEST_CASE("the understory follows the up of the terrain") {
  terrain ground = sloped_terrain(0);
  ground.frame.rotation = levelling_rotation({1, 0, 0});
  std::vector<Vector3d> scan;
  for (const double height : {0.1, 1.0, 2.9, 3.1})
    scan.push_back(to_eigen(ground.frame.to_scan({2, 2, height})));
  const local_points understory = select_understory(scan, ground);
  CHECK(understory.index == std::vector<point_index>{1, 2});
  REQUIRE(understory.size() == 2);
  CHECK((vec3(understory[0]) - vec3{2, 2, 1}).norm() < 1e-5);
}

TEST_CASE("understory limits that hold no layer are refused by name") {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  for (const understory_options& options : {understory_options{3, 3}, understory_options{3, 1},
                                            understory_options{nan, 3}, understory_options{0, nan}})
    CHECK(message_of([&] {
            select_understory(std::vector<Vector3d>{}, terrain{}, options);
          }).starts_with("understory.min_height"));
}

TEST_CASE("selecting the understory can be cancelled") {
  const execution exec{.on_progress = [](const progress& p) { return p.stage != "understory"; }};
  CHECK_THROWS_AS(
      select_understory(std::vector<Vector3d>(3, Vector3d(12, 22, 31)), sloped_terrain(0), {}, exec),
      operation_cancelled);
}

}  // namespace globalmatch::test_understory
