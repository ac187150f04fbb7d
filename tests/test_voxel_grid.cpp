#include "globalmatch/detail/published/voxel_grid.hpp"

#include "catch.hpp"
#include "forest_scenes.hpp"
#include "oracles/naive_voxel_grid.hpp"
#include "support/message_of.hpp"

namespace globalmatch::test_voxel_grid {

using namespace detail;

using Eigen::Vector3d;
using Eigen::Vector3f;
using indices = std::vector<point_index>;
using support::message_of;

TEST_CASE("the voxel grid equals a naive one") {
  random_source random(1);
  const scenes::cloud points = scenes::random_cloud(random, 3000, 2);
  for (const double voxel_size : {0.05, 0.3, 10.0}) {
    CAPTURE(voxel_size);
    CHECK(thin_by_voxels(scenes::as_local(points), voxel_size) ==
          oracles::naive_voxel_grid(points, voxel_size, Vector3d::Zero()));
  }
}

TEST_CASE("the point nearest the mean of its voxel's points stays") {
  const scenes::cloud points = {{0, 0, 0}, {0.9f, 0, 0}, {0.8f, 0, 0}, {0.6f, 0, 0}, {1.5f, 0, 0}};
  CHECK(thin_by_voxels(scenes::as_local(points), 1) == indices{3, 4});
}

TEST_CASE("of two points in a voxel, which are equally near their mean, the first stays") {
  random_source random(2);
  int others = 0;
  for (int i = 0; i < 500; ++i) {
    const auto random_point = [&] {
      return Vector3d(random.uniform(), random.uniform(), random.uniform()).cast<float>().eval();
    };
    const local_points pair = scenes::as_local({random_point(), random_point()});
    others += thin_by_voxels(pair, 1) == indices{0} ? 0 : 1;
  }
  CHECK(others == 0);
}

TEST_CASE("voxels are half open, below zero too") {
  const scenes::cloud points = {{0, 0, 0}, {-0.25f, 0, 0}, {-1, 0, 0}, {1, 0, 0}, {0.75f, 0, 0}};
  CHECK(thin_by_voxels(scenes::as_local(points), 1) == indices{0, 1, 3});
}

TEST_CASE("of equal points the first one stays") {
  CHECK(thin_by_voxels(scenes::as_local(scenes::cloud(50, Vector3f(1, 2, 3))), 0.01) == indices{0});
}

TEST_CASE("points further apart than a voxel all stay") {
  const scenes::cloud lattice = scenes::lattice_cloud(8);
  CHECK(thin_by_voxels(scenes::as_local(lattice), 0.5).size() == lattice.size());
}

TEST_CASE("nothing and one point come through the voxel grid") {
  CHECK(thin_by_voxels(local_points{}, 0.01).empty());
  CHECK(thin_by_voxels(scenes::as_local({{5, 5, 5}}), 0.01) == indices{0});
}

TEST_CASE("an outlier does not merge the other voxels, wherever it stands") {
  for (const float far : {1e9f, -1e9f, 1e30f}) {
    for (const bool first : {false, true}) {
      CAPTURE(far, first);
      scenes::cloud points = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}};
      points.insert(first ? points.begin() : points.end(), Vector3f(far, 0, 0));
      CHECK(thin_by_voxels(scenes::as_local(points), 0.01).size() == 5);
    }
  }
}

TEST_CASE("voxels of a tenth of a millimetre are distinct over 200 metres") {
  const scenes::cloud points = {{0, 0, 0}, {150, 0, 0}, {200, 0, 0}};
  CHECK(thin_by_voxels(scenes::as_local(points), 1e-4).size() == 3);
}

TEST_CASE("a voxel size that is not positive is refused by name") {
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    CHECK(message_of([&] { thin_by_voxels(local_points{}, bad); }).starts_with("voxel_size"));
  }
}

}  // namespace globalmatch::test_voxel_grid
