#include "globalmatch/detail/published/voxel_grid.hpp"

#include "catch.hpp"
#include "containers.hpp"
#include "forest_scenes.hpp"
#include "oracles/naive_voxel_grid.hpp"
#include "support/message_of.hpp"

namespace globalmatch {

using namespace detail;

using Eigen::Vector3d;
using Eigen::Vector3f;
using indices = std::vector<point_index>;
using support::message_of;

TEST_CASE("the voxel grid equals a naive one, in every container") {
  random_source random(1);
  const scenes::cloud points = scenes::random_cloud(random, 3000, 2);
  for (const double voxel_size : {0.05, 0.3, 10.0}) {
    const indices expected =
        oracles::naive_voxel_grid(points, voxel_size, to_eigen(import_points(points).frame.origin));
    containers::for_each_container(points, [&](const std::string& kind, const auto& range) {
      CAPTURE(kind, voxel_size);
      CHECK((thin_by_voxels(range, voxel_size) == expected));
    });
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
  CHECK(thin_by_voxels(scenes::cloud(50, Vector3f(1, 2, 3)), 0.01) == indices{0});
}

TEST_CASE("points further apart than a voxel all stay") {
  const scenes::cloud lattice = scenes::lattice_cloud(8);
  CHECK(thin_by_voxels(lattice, 0.5).size() == lattice.size());
}

TEST_CASE("nothing and one point come through the voxel grid") {
  CHECK(thin_by_voxels(scenes::cloud{}, 0.01).empty());
  CHECK(thin_by_voxels(scenes::cloud{{5, 5, 5}}, 0.01) == indices{0});
}

TEST_CASE("points that are not finite do not stay, and the indices are the caller's") {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  const scenes::cloud points = {{nan, 0, 0}, {1, 1, 1}, {2, nan, 2}, {3, 3, 3}};
  CHECK(thin_by_voxels(points, 0.01) == indices{1, 3});
}

TEST_CASE("a shifted cloud keeps the same points") {
  random_source random(3);
  const scenes::cloud points = scenes::random_cloud(random, 2000, 2);
  std::vector<Vector3d> shifted;
  for (const Vector3f& p : points) shifted.push_back(p.cast<double>() + Vector3d(500000, 5300000, 1000));
  CHECK((thin_by_voxels(shifted, 0.1) == thin_by_voxels(points, 0.1)));
}

TEST_CASE("an outlier does not merge the other voxels, wherever it stands") {
  for (const double far : {1e9, -1e9, 1e30}) {
    for (const bool first : {false, true}) {
      CAPTURE(far, first);
      std::vector<Vector3d> points = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}};
      points.insert(first ? points.begin() : points.end(), Vector3d(far, 0, 0));
      CHECK(thin_by_voxels(points, 0.01).size() == 5);
    }
  }
}

TEST_CASE("voxels of a tenth of a millimetre are distinct over 200 metres") {
  const scenes::cloud points = {{0, 0, 0}, {150, 0, 0}, {200, 0, 0}};
  CHECK(thin_by_voxels(points, 1e-4).size() == 3);
}

TEST_CASE("a voxel size that is not positive is refused by name") {
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    CHECK(message_of([&] { thin_by_voxels(scenes::cloud{}, bad); }).starts_with("voxel_size"));
    CHECK(message_of([&] { thin_by_voxels(local_points{}, bad); }).starts_with("voxel_size"));
  }
}

}  // namespace globalmatch
