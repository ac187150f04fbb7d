#include "support/scan_summary.hpp"

#include <cstring>
#include <limits>
#include <numbers>

#include "catch.hpp"
#include "file_checks.hpp"

namespace globalmatch::support::test_scan_summary {

TEST_CASE("a summary counts points with coordinates, and tells their extent and density around the scanner") {
  const temporary_directory directory;
  points written;
  for (int i = -300; i < 300; ++i)  // 4 points in each square metre of 300 m x 300 m
    for (int k = -300; k < 300; ++k) written.emplace_back(i / 2.0, k / 2.0, 1);
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  written.emplace_back(none, 0, 0);
  write_ply(directory / "a.ply", written);
  const scan_summary summary = summarise(open_scan(directory / "a.ply"), Eigen::Vector3d(20, 0, 5));
  CHECK(summary.points == written.size() - 1);
  CHECK(summary.extent.min() == Eigen::Vector3d(-150, -150, 1));
  CHECK(summary.extent.max() == Eigen::Vector3d(149.5, 149.5, 1));
  REQUIRE(summary.density);
  for (const double density : *summary.density) CHECK(density == Approx(4).epsilon(0.1));
}

TEST_CASE("a summary is the same for any number of threads") {
  const temporary_directory directory;
  points written;
  for (int i = 0; i < 300'000; ++i)
    written.emplace_back(i % 631 - 300.5, i % 467 - 200.25, i % 2 == 0 ? 0.0 : -0.0);
  write_ply(directory / "a.ply", written);
  const scan_file scan = open_scan(directory / "a.ply");
  const scan_summary one = summarise(scan, {}, {.threads = 1});
  CHECK(one.points == written.size());
  for (const int threads : {2, 3, 8}) {
    const scan_summary other = summarise(scan, {}, {.threads = threads});
    CHECK(other.points == one.points);
    CHECK(other.density == one.density);
    CHECK(std::memcmp(&other.extent, &one.extent, sizeof(one.extent)) == 0);
  }
}

TEST_CASE("a scan without points has an empty extent and no density") {
  const temporary_directory directory;
  write_ply(directory / "a.ply", {});
  const scan_summary summary = summarise(open_scan(directory / "a.ply"), {});
  CHECK(summary.points == 0);
  CHECK(summary.extent.isEmpty());
  CHECK_FALSE(summary.density);
}

TEST_CASE(
    "density is not measured around an origin that is outside of the scan, unless the scanner is given") {
  const temporary_directory directory;
  points written;
  for (int i = 0; i < 10000; ++i) written.emplace_back(432000 + i % 100, 5300000 + i / 100, 1);
  write_ply(directory / "a.ply", written);
  const scan_file scan = open_scan(directory / "a.ply");
  CHECK_FALSE(summarise(scan, {}).density);
  REQUIRE(summarise(scan, Eigen::Vector3d(432050, 5300050, 0)).density);
  CHECK(summarise(scan, Eigen::Vector3d(432050, 5300050, 0)).density->at(2) == Approx(1).epsilon(0.15));
}

}  // namespace globalmatch::support::test_scan_summary
