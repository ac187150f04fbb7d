// The points that a report shows: which are picked, and how they are written.
#include <Eigen/Geometry>

#include <algorithm>
#include <limits>
#include <memory>
#include <string_view>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "support/report/view_3d.hpp"
#include "support/scan_sample.hpp"
#include "support/voxel_sample.hpp"

namespace globalmatch::support::test_report_points {

namespace {

std::string base64_of(std::string_view text) {
  return base64({reinterpret_cast<const unsigned char*>(text.data()), text.size()});
}

/// The inverse of `base64`, digit by digit.
std::vector<unsigned char> decoded(const std::string& text) {
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<unsigned char> bytes;
  unsigned bits = 0, count = 0;
  for (const char c : text) {
    if (c == '=') break;
    bits = bits << 6 | unsigned(digits.find(c));
    if ((count += 6) >= 8) bytes.push_back(static_cast<unsigned char>(bits >> (count -= 8)));
  }
  return bytes;
}

std::vector<Eigen::Vector3d> positions_of(const std::vector<sampled_point>& points) {
  std::vector<Eigen::Vector3d> positions;
  for (const sampled_point& p : points) positions.push_back(p.position);
  return positions;
}

std::vector<sampled_point> random_points(std::size_t count) {
  detail::random_source random(1);
  std::vector<sampled_point> points(count);
  for (sampled_point& p : points)
    p = {{500000 + 10 * random.uniform(), 10 * random.uniform(), -random.uniform()}, 3 * random.uniform()};
  return points;
}

}  // namespace

TEST_CASE("base64 is that of RFC 4648, by its own examples") {
  CHECK(base64_of("").empty());
  CHECK(base64_of("f") == "Zg==");
  CHECK(base64_of("fo") == "Zm8=");
  CHECK(base64_of("foo") == "Zm9v");
  CHECK(base64_of("foobar") == "Zm9vYmFy");
}

TEST_CASE("a sample has one point a voxel, and the same places whatever the order of the points") {
  std::vector<sampled_point> points;
  for (int x = 0; x < 40; ++x)
    for (int y = 0; y < 40; ++y)
      for (int again = 0; again < 2; ++again) points.push_back({{0.25 * x + 0.1, 0.25 * y + 0.1, -0.1}, 1});
  const auto picked = [&](std::size_t max_points) {
    voxel_sample sample(0.25, max_points);
    for (const sampled_point& p : points) sample.add(p);
    return positions_of(sample.points());
  };
  const auto some = picked(500), all = picked(100000);
  CHECK(some.size() == 500);
  CHECK(all.size() == 40 * 40);
  std::reverse(points.begin(), points.end());
  CHECK(picked(500) == some);
  CHECK(picked(0).empty());
}

TEST_CASE("a sample is spread evenly: each half of space has half of it") {
  voxel_sample sample(0.05, 1000);
  for (const sampled_point& p : random_points(50000)) sample.add(p);
  const auto points = sample.points();
  REQUIRE(points.size() == 1000);
  const auto left = std::count_if(points.begin(), points.end(),
                                  [](const sampled_point& p) { return p.position.x() < 500005; });
  CHECK(std::abs(left - 500) < 80);  // five standard deviations
}

TEST_CASE("points of a view come back within a step, and heights within a centimetre") {
  const std::vector<sampled_point> points = random_points(100);
  const view_scan scan{"a", {1, 2, 255}, points};
  const view_placement placement{"placed", {Eigen::Isometry3d(Eigen::Translation3d(1, 2, 3))}};
  const auto view = describe_view({&scan, 1}, {&placement, 1});
  const auto& described = view["scans"][0];
  CHECK(described["colour"] == "#0102ff");
  CHECK(described["count"] == 100);
  const auto bytes = decoded(described["points"].get<std::string>());
  REQUIRE(bytes.size() == 800);
  const auto integer = [&](std::size_t at) { return bytes[2 * at] + 256 * bytes[2 * at + 1]; };
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double step = described["step"][axis].get<double>(), low = described["low"][axis].get<double>();
      CHECK(step < 0.0002);
      CHECK(std::abs(low + step * integer(4 * i + axis) - points[i].position[Eigen::Index(axis)]) < step);
    }
    CHECK(std::abs(integer(4 * i + 3) - 100 * points[i].height) <= 0.5);
  }
}

TEST_CASE("a view is about the middle of its first scan, so that map coordinates lose no digits") {
  const view_scan scan{"a", {}, random_points(100)};
  const view_placement placement{"placed", {Eigen::Isometry3d::Identity()}};
  const auto matrix = describe_view({&scan, 1}, {&placement, 1})["placements"][0]["matrices"][0];
  REQUIRE(matrix.size() == 16);
  CHECK(std::abs(matrix[3].get<double>() + 500005) < 1);
  CHECK(matrix[0] == 1.0);
}

TEST_CASE("of a scan the understory is picked, and a section up to some metres, but not what has no ground") {
  terrain ground;
  ground.resolution = 1;
  ground.columns = ground.rows = 10;
  ground.heights.assign(100, 2.0f);
  ground.has_data.assign(100, 1);
  const double none = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Eigen::Vector3d> points = {{5, 5, 3},  {5, 5, 2.1}, {5, 5, 5.5}, {5, 5, 9},
                                               {50, 5, 3}, {6, 5.1, 3}, {6, 6, 3},   {none, 0, 0}};
  const scan_file scan({std::make_unique<points_in_memory>(points)});
  vertical_section section{Eigen::Isometry3d(Eigen::Translation3d(-4, -5, 0)), 3, 0.2};
  const scan_sample sample = sample_of(scan, ground, 100, section);
  CHECK(sample.understory.size() == 3);
  CHECK(sample.section.size() == 4);
  for (const sampled_point& p : sample.section) {
    CHECK(p.position.x() > 0);
    CHECK(std::abs(p.position.y()) < 0.2);
  }
  CHECK(sample_of(scan, ground, 0, std::nullopt).section.empty());
}

}  // namespace globalmatch::support::test_report_points
