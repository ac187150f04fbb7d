#include "support/voxel_thinning.hpp"

#include <array>
#include <cmath>
#include <map>
#include <stdexcept>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "support/scan_files.hpp"
#include "temporary_directory.hpp"

namespace globalmatch::support::test_voxel_thinning {

namespace {

/// Three scans of random points, some of them left out, in frames of their own.
struct three_scans {
  std::vector<scan_file> scans;
  std::vector<placed_scan> placed;

  three_scans() {
    detail::random_source random(3);
    for (int s = 0; s < 3; ++s) {
      std::vector<Eigen::Vector3d> points;
      for (int i = 0; i < 70'000; ++i)
        points.push_back({20 * random.uniform(), 12 * random.uniform(), 3 * random.uniform()});
      for (std::size_t i = 0; i < points.size(); i += 100) points[i].y() = std::nan("");
      scans.push_back(scan_file({std::make_unique<points_in_memory>(points)}));
    }
    for (std::size_t s = 0; s < scans.size(); ++s)
      placed.push_back({&scans[s],
                        Eigen::Translation3d(500'000 + 7.3 * double(s), -2, 0.1) *
                            Eigen::AngleAxisd(0.2 * double(s), Eigen::Vector3d::UnitZ()),
                        {}});
  }

  /// By a map of all voxels.
  std::vector<std::vector<bool>> expected(double voxel) const {
    std::map<std::array<double, 3>, int> seen;
    std::vector<std::vector<bool>> kept;
    for (const placed_scan& scan : placed) {
      kept.emplace_back();
      for (const Eigen::Vector3d& p : *scan.scan) {
        const Eigen::Vector3d cell = (scan.target_from_scan * p / voxel).array().floor();
        kept.back().push_back(p.allFinite() && seen[{cell.x(), cell.y(), cell.z()}]++ == 0);
      }
    }
    return kept;
  }
};

}  // namespace

TEST_CASE("the first point of each voxel is kept, whatever the memory and the number of threads") {
  const three_scans made;
  for (const double voxel : {0.5, 0.1}) {
    const auto expected = made.expected(voxel);
    for (const int threads : {1, 3})
      for (const std::size_t memory : {std::size_t(1) << 24, std::size_t(700), std::size_t(100)}) {
        if (voxel < 0.5 && memory < (threads == 1 ? 10'000u : 500u)) continue;  // as many passes more
        CHECK(first_in_voxels(made.placed, voxel, threads, memory) == expected);
      }
  }
}

TEST_CASE("points that are not kept are left out of the scan, and attributes stay") {
  const three_scans made;
  std::vector<bool> kept(made.scans[0].size(), false);
  kept[5] = kept[69'999] = kept[100] = true;  // the last of them is left out in the file
  const scan_file thinned = with_points(made.scans[0], kept);
  REQUIRE(thinned.size() == made.scans[0].size());
  std::size_t finite = 0;
  for (std::size_t i = 0; i < thinned.size(); ++i) {
    const Eigen::Vector3d p = thinned.begin()[std::ptrdiff_t(i)];
    if (!p.allFinite()) continue;
    ++finite;
    CHECK(kept[i]);
    CHECK(p == made.scans[0].begin()[std::ptrdiff_t(i)]);
  }
  CHECK(finite == 2);
}

TEST_CASE("voxels that are no lengths, or too small for the extent, are refused") {
  const three_scans made;
  CHECK_THROWS_AS(first_in_voxels(made.placed, 0, 1), std::invalid_argument);
  CHECK_THROWS_AS(first_in_voxels(made.placed, std::nan(""), 1), std::invalid_argument);
  CHECK_THROWS_WITH(first_in_voxels(made.placed, 1e-6, 1), Catch::Contains("too small"));
  CHECK(first_in_voxels({}, 0.1, 1).empty());
}

}  // namespace globalmatch::support::test_voxel_thinning
