// Clouds of the real PCL and Open3D, and Eigen's maps over memory of others: results are those of a vector of
// Eigen::Vector3d, bit for bit. tests/containers.hpp has types like them, which need no library.
#include <open3d/geometry/PointCloud.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cstring>
#include <sstream>
#include <string>
#include <vector>

#include "catch.hpp"
#include "forest_scenes.hpp"
#include "globalmatch/registration.hpp"
#include "globalmatch/stem_map_io.hpp"
#include "globalmatch/stem_matching.hpp"

namespace globalmatch::test_foreign_containers {

namespace {

using vector_cloud = std::vector<Eigen::Vector3d>;

vector_cloud in_double(const scenes::cloud& points) {
  vector_cloud result;
  for (const Eigen::Vector3f& p : points) result.push_back(p.cast<double>());
  return result;
}

template <class P>
pcl::PointCloud<P> as_pcl(const vector_cloud& points) {
  pcl::PointCloud<P> cloud;
  for (const Eigen::Vector3d& p : points) {
    P point;
    point.getVector3fMap() = p.cast<float>();
    cloud.push_back(point);
  }
  return cloud;
}

/// Memory as another program may have it.
template <class T>
std::vector<T> numbers_of(const vector_cloud& points) {
  std::vector<T> numbers;
  for (const Eigen::Vector3d& p : points)
    for (const double coordinate : p) numbers.push_back(T(coordinate));
  return numbers;
}

template <class T>
auto columns_over(const std::vector<T>& numbers) {
  return Eigen::Map<const Eigen::Matrix<T, 3, Eigen::Dynamic>>(numbers.data(), 3,
                                                               Eigen::Index(numbers.size() / 3));
}

/// x, y, z and what follows them, of a point each.
auto columns_of(const pcl::PointCloud<pcl::PointXYZI>& cloud) {
  return Eigen::Map<const Eigen::Matrix<float, 4, Eigen::Dynamic>, 0, Eigen::OuterStride<>>(
      &cloud.front().x, 4, Eigen::Index(cloud.size()),
      Eigen::OuterStride<>(sizeof(pcl::PointXYZI) / sizeof(float)));
}

/// Calls `check(name, range)` with the points in each; floats hold their coordinates.
template <class Check>
void for_each_foreign(const vector_cloud& points, const Check& check) {
  check("pcl::PointCloud<pcl::PointXYZ>", as_pcl<pcl::PointXYZ>(points));
  check("pcl::PointCloud<pcl::PointXYZI>", as_pcl<pcl::PointXYZI>(points));
  check("pcl::PointCloud<pcl::PointXYZRGBNormal>", as_pcl<pcl::PointXYZRGBNormal>(points));
  const auto cloud = as_pcl<pcl::PointXYZI>(points);
  check("map of the memory of a pcl::PointCloud", columns_of(cloud).colwise());
  check("open3d::geometry::PointCloud", open3d::geometry::PointCloud(points).points_);
  const auto doubles = numbers_of<double>(points);
  check("columns of a map over doubles", columns_over(doubles).colwise());
  const auto floats = numbers_of<float>(points);
  check("columns of a map over floats", columns_over(floats).colwise());
  using rows = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
  check("rows of a map over doubles",
        Eigen::Map<const rows>(doubles.data(), Eigen::Index(points.size()), 3).rowwise());
}

std::string bytes_of(const stem_map& map) {
  std::ostringstream out;
  write_stem_map(out, map);
  return std::move(out).str();
}

bool is_same(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return std::memcmp(a.data(), b.data(), sizeof(double) * 16) == 0;
}

/// The plot, turned by a right angle and shifted, so that floats hold it, too.
vector_cloud seen_from_elsewhere(const vector_cloud& points) {
  vector_cloud moved;
  for (const Eigen::Vector3d& p : points) moved.push_back({p.y() - 5, 8 - p.x(), p.z() + 1});
  return moved;
}

}  // namespace

TEST_CASE("real clouds and maps are mapped as a vector of Vector3d is, bit for bit") {
  const vector_cloud scan = in_double(scenes::small_plot().scan());
  const stem_map reference = map_stems(scan);
  REQUIRE(reference.stems.size() >= 10);
  const std::string expected = bytes_of(reference);
  for_each_foreign(scan, [&](const std::string& kind, const auto& range) {
    INFO(kind);
    CHECK(bytes_of(map_stems(range)) == expected);
  });
}

TEST_CASE("real clouds and maps are registered as a vector of Vector3d is, bit for bit") {
  const vector_cloud target = in_double(scenes::small_plot().scan()), source = seen_from_elsewhere(target);
  const registration reference = register_scans(source, target).registration;
  REQUIRE(reference.target_from_source);
  for_each_foreign(source, [&](const std::string& kind, const auto& range) {
    INFO(kind);
    const registration result = register_scans(range, target).registration;
    REQUIRE(result.target_from_source);
    CHECK(is_same(*result.target_from_source, *reference.target_from_source));
  });
}

TEST_CASE("stems in real clouds and maps are matched as those in a vector are, bit for bit") {
  vector_cloud stems;
  for (const stem& s : map_stems(scenes::small_plot().scan()).stems)
    stems.push_back(scenes::exact(s.position).cast<double>());
  const vector_cloud seen = seen_from_elsewhere(stems);
  const matching reference = match_stems(seen, stems);
  REQUIRE(reference.target_from_source);
  for_each_foreign(seen, [&](const std::string& kind, const auto& range) {
    INFO(kind);
    const matching result = match_stems(range, stems);
    REQUIRE(result.target_from_source);
    CHECK(is_same(*result.target_from_source, *reference.target_from_source));
    CHECK(result.hypotheses.front().log10_nfa == reference.hypotheses.front().log10_nfa);
  });
}

TEST_CASE("coordinates that a cloud rounds to float count as it rounds them") {
  vector_cloud scan = in_double(scenes::small_plot().scan());
  for (Eigen::Vector3d& p : scan) p *= 1.0000321;
  vector_cloud rounded;
  for (const Eigen::Vector3d& p : scan) rounded.push_back(p.cast<float>().cast<double>());
  REQUIRE(!std::equal(scan.begin(), scan.end(), rounded.begin()));
  const std::string expected = bytes_of(map_stems(rounded));
  CHECK(bytes_of(map_stems(as_pcl<pcl::PointXYZ>(scan))) == expected);
  CHECK(bytes_of(map_stems(columns_over(numbers_of<float>(scan)).colwise())) == expected);
  CHECK(bytes_of(map_stems(open3d::geometry::PointCloud(scan).points_)) == bytes_of(map_stems(scan)));
}

TEST_CASE("points that PCL marks as invalid are left out and counted") {
  const vector_cloud scan = in_double(scenes::small_plot().scan());
  auto cloud = as_pcl<pcl::PointXYZ>(scan);
  cloud.insert(cloud.begin(), pcl::PointXYZ(scenes::nan, scenes::nan, scenes::nan));
  cloud.is_dense = false;
  const stem_map map = map_stems(cloud);
  CHECK(map.funnel.ground.not_finite == 1);
  CHECK(map.stems.size() == map_stems(scan).stems.size());
}

}  // namespace globalmatch::test_foreign_containers
