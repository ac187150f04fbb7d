// Which stems evaluate_dataset gives to matching alone, and what it writes of that.
#include <Eigen/Geometry>

#include <cstddef>
#include <sstream>
#include <string>
#include <vector>

#include "catch.hpp"
#include "dataset/results.hpp"
#include "dataset/stem_selection.hpp"

namespace globalmatch::test_dataset_matching {

using namespace benchmarks;

namespace {

/// A scan of these stems of the plot, at `x` and turned.
evaluated_scan scan_at(double x, double yaw, const std::vector<double>& stems) {
  evaluated_scan scan;
  scan.plot_from_scan = Eigen::Translation3d(x, 0, 0) * Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ());
  for (const double place : stems) {
    stem s{};
    s.position = scan.plot_from_scan.inverse() * Eigen::Vector3d(place, 0, 0);
    s.radius = place / 100;
    scan.map.stems.push_back(s);
  }
  return scan;
}

/// Scanners at 0 and 10.4 m; stems along a line, of which those at 3, 4, 6 and 12 m are in both maps.
struct two_scans {
  evaluated_scan source = scan_at(0, 1, {12, 1, 3, 4, 6, 2});
  evaluated_scan target = scan_at(10.4, -2, {9, 3, 4, 11.5, 6, 12, 20});
  Eigen::Isometry3d truth = target.plot_from_scan.inverse() * source.plot_from_scan;

  two_maps select(const stem_selection& selection) const {
    return select_stems(source, target, truth, selection);
  }
};

std::vector<double> places(const std::vector<double>& radii) {
  std::vector<double> all;
  for (const double radius : radii) all.push_back(100 * radius);
  return all;
}

void require_places(const std::vector<double>& radii, const std::vector<double>& expected) {
  const std::vector<double> all = places(radii);
  REQUIRE(all.size() == expected.size());
  for (std::size_t i = 0; i < all.size(); ++i) CHECK(all[i] == Approx(expected[i]));
}

}  // namespace

TEST_CASE("whole maps have all stems, those in common first and nearest to the middle between the scanners") {
  const two_maps maps = two_scans{}.select({});
  CHECK(maps.common == 4);
  require_places(maps.source_radii, {6, 4, 3, 12, 1, 2});
  require_places(maps.target_radii, {6, 4, 3, 12, 11.5, 9, 20});
  for (std::size_t i = 0; i < maps.common; ++i)
    CHECK((maps.target_from_source * maps.source[i]).isApprox(maps.target[i], 1e-9));
}

TEST_CASE("simplified maps keep the common stems, then those nearest to the own scanner") {
  const two_maps maps = two_scans{}.select({.count = 5, .range = 0});
  CHECK(maps.common == 4);
  require_places(maps.source_radii, {6, 4, 3, 12, 1});
  require_places(maps.target_radii, {6, 4, 3, 12, 11.5});
  CHECK(two_scans{}.select({.count = 2, .range = 0}).common == 2);
}

TEST_CASE("maps that are cut off have the stems within the range of their scanner alone") {
  const two_maps maps = two_scans{}.select({.count = 0, .range = 6.5});
  require_places(maps.source_radii, {6, 4, 1, 2, 3});  // 3 is out of range of the target
  require_places(maps.target_radii, {6, 4, 11.5, 9, 12});
  CHECK(maps.common == 2);
}

TEST_CASE("names with commas are fields of their own, and what was not found stays empty") {
  matching_result run;
  run.plot = "plot, \"old\"";
  run.method = "index";
  run.selection.range = 8;
  std::ostringstream csv;
  write_matchings(csv, {run});
  const std::string line = csv.str().substr(csv.str().find('\n') + 1);
  CHECK(line == "\"plot, \"\"old\"\"\",,,0,index,all,8,0,0,0,0,0,0,,,\n");
}

}  // namespace globalmatch::test_dataset_matching
