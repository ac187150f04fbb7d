#include "support/scan_summary.hpp"

#include <limits>
#include <numbers>

#include "catch.hpp"
#include "file_checks.hpp"

namespace globalmatch::support {

TEST_CASE("a summary counts points with coordinates, and tells their extent and density around the scanner") {
  const temporary_directory directory;
  points written;
  for (int i = -300; i < 300; ++i)  // 4 points in each square metre of 300 m x 300 m
    for (int k = -300; k < 300; ++k) written.emplace_back(i / 2.0, k / 2.0, 1);
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  written.emplace_back(none, 0, 0);
  write_ply(directory / "a.ply", written);
  const scan_summary summary = summarise(open_scan(directory / "a.ply"), {20, 0, 5});
  CHECK(summary.points == written.size() - 1);
  CHECK(summary.extent.min() == Eigen::Vector3d(-150, -150, 1));
  CHECK(summary.extent.max() == Eigen::Vector3d(149.5, 149.5, 1));
  for (const double density : summary.density) CHECK(density == Approx(4).epsilon(0.1));
}

TEST_CASE("a scan without points has an empty extent and no density") {
  const temporary_directory directory;
  write_ply(directory / "a.ply", {});
  const scan_summary summary = summarise(open_scan(directory / "a.ply"), {0, 0, 0});
  CHECK(summary.points == 0);
  CHECK(summary.extent.isEmpty());
  CHECK(summary.density == std::array<double, 3>{});
}

}  // namespace globalmatch::support
