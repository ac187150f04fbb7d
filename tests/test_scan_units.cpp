#include "globalmatch/detail/mapping/scan_units.hpp"

#include <forward_list>

#include "catch.hpp"
#include "forest_scenes.hpp"
#include "support/message_of.hpp"

namespace globalmatch::test_scan_units {

using namespace detail;
using support::message_of;

namespace {

std::vector<Eigen::Vector3d> scaled(double scale) {
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3f& p : scenes::small_plot().scan()) points.push_back(scale * p.cast<double>());
  return points;
}

}  // namespace

TEST_CASE("metres and feet pass, centimetres and millimetres are named, in every container") {
  for (const double scale : {1.0, 1 / 0.3048})
    CHECK_NOTHROW(require_metres(points_all_over(scaled(scale)), {0, 0, 1}));
  const auto cm = scaled(100), mm = scaled(1000);
  CHECK_THAT(message_of([&] {
               require_metres(points_all_over(cm), {0, 0, 1});
             }),
             Catch::Contains("centimetres"));
  CHECK_THAT(message_of([&] {
               require_metres(points_all_over(mm), {0, 0, 1});
             }),
             Catch::Contains("millimetres"));
  CHECK_THAT(message_of([&] {
               require_metres(points_all_over(mm), {0, 0, -1});
             }),
             Catch::Contains("millimetres"));
  const std::forward_list<Eigen::Vector3d> forward(mm.rbegin(), mm.rend());  // stems first
  CHECK_THAT(message_of([&] {
               require_metres(points_all_over(forward), {0, 0, 1});
             }),
             Catch::Contains("extent of"));
}

TEST_CASE("a corridor of ten kilometres over a mountain is in metres") {
  random_source random(3);
  std::vector<Eigen::Vector3d> corridor;
  for (int i = 0; i < 50000; ++i) {
    const double x = scenes::in_range(random, 0, 10000);
    corridor.push_back(
        {x, 0.5 * x + scenes::in_range(random, 0, 20), 0.4 * x + scenes::in_range(random, 0, 40)});
  }
  CHECK_NOTHROW(require_metres(points_all_over(corridor), {0, 0, 1}));
}

TEST_CASE("no points, few points, equal ones and outliers are no sign of a unit") {
  CHECK_NOTHROW(require_metres({}, {0, 0, 1}));
  CHECK_NOTHROW(require_metres(std::vector<vec3>(1000, vec3{0, 0, 0}), {0, 0, 1}));
  auto points = scaled(1);
  for (std::size_t i = 0; i < points.size(); i += 1000) points[i].z() = 1e6;
  CHECK_NOTHROW(require_metres(points_all_over(points), {0, 0, 1}));
}

TEST_CASE("coordinates in steps of decimetres are noticed") {
  auto points = scaled(1);
  CHECK(coordinate_step(points_all_over(points)) == 0);
  for (auto& p : points) p.y() = double(float(p.y() + 5300000));
  CHECK(coordinate_step(points_all_over(points)) == 0.5);
  for (auto& p : points) p.y() = 7;
  CHECK(coordinate_step(points_all_over(points)) == 0);
  CHECK(coordinate_step(std::vector<vec3>(50, vec3{1, 2, 3})) == 0);
}

}  // namespace globalmatch::test_scan_units
