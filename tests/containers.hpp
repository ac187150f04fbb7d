// The types that callers keep their points in, all holding the same coordinates.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstring>
#include <list>
#include <span>
#include <string>
#include <vector>

#include "globalmatch/points.hpp"

namespace globalmatch::containers {

struct colored_point {
  float x, y, z;
  unsigned char red, green, blue;
};

struct survey_point {
  std::string name;
  double x, y, z;
};

/// Like the points of the Point Cloud Library: aligned and padded.
struct alignas(16) pcl_like_point {
  float x, y, z;
  float padding = 1;
  float intensity = 0;
};

/// As much of `pcl::PointCloud` as a range needs.
template <class P>
class pcl_like_cloud {
 public:
  using value_type = P;
  using const_iterator = typename std::vector<P>::const_iterator;

  std::vector<P> points;

  const_iterator begin() const { return points.begin(); }
  const_iterator end() const { return points.end(); }
};

/// A class with accessors only: `point_traits` makes it a point.
class geodetic_mark {
 public:
  geodetic_mark(double easting, double northing, double elevation) : at_{easting, northing, elevation} {}
  double easting() const { return at_[0]; }
  double northing() const { return at_[1]; }
  double elevation() const { return at_[2]; }

 private:
  std::array<double, 3> at_;
};

}  // namespace globalmatch::containers

template <>
struct globalmatch::point_traits<globalmatch::containers::geodetic_mark> {
  static std::array<double, 3> xyz(const globalmatch::containers::geodetic_mark& m) {
    return {m.easting(), m.northing(), m.elevation()};
  }
};

namespace globalmatch::containers {

/// Calls `check(name, range)` with the points in every kind of container.
template <class Check>
void for_each_container(const std::vector<Eigen::Vector3f>& points, const Check& check) {
  const std::size_t count = points.size();
  const auto columns = static_cast<Eigen::Index>(count);
  std::vector<colored_point> colored;
  std::list<survey_point> surveyed;
  std::vector<geodetic_mark> marks;
  std::vector<std::array<float, 3>> arrays;
  std::vector<Eigen::Vector3d> doubles;
  std::vector<Eigen::Vector4f> homogeneous;
  pcl_like_cloud<pcl_like_point> cloud;
  Eigen::Matrix3Xd matrix(3, columns);
  std::vector<float> x, y, z;
  constexpr std::size_t record = 17;  // bytes: leaves the floats unaligned
  std::vector<std::byte> records(record * count + 1);
  for (const Eigen::Vector3f& p : points) {
    const std::size_t i = colored.size();
    colored.push_back({p.x(), p.y(), p.z(), 10, 20, 30});
    surveyed.push_back({"mark", p.x(), p.y(), p.z()});
    marks.push_back({p.x(), p.y(), p.z()});
    arrays.push_back({p.x(), p.y(), p.z()});
    doubles.push_back(p.cast<double>());
    homogeneous.push_back({p.x(), p.y(), p.z(), 1});
    cloud.points.push_back({p.x(), p.y(), p.z()});
    matrix.col(static_cast<Eigen::Index>(i)) = p.cast<double>();
    x.push_back(p.x());
    y.push_back(p.y());
    z.push_back(p.z());
    std::memcpy(records.data() + i * record + 1, p.data(), 3 * sizeof(float));
  }
  check("vector of Vector3f", points);
  check("vector of Vector3d", doubles);
  check("vector of Vector4f", homogeneous);
  check("vector of structs with float x, y, z", colored);
  check("list of structs with double x, y, z", surveyed);
  check("vector of a type with point_traits", marks);
  check("vector of arrays", arrays);
  check("cloud like those of PCL", cloud);
  check("columns of a matrix", matrix.colwise());
  check("structure of arrays",
        soa_points(std::span<const float>(x), std::span<const float>(y), std::span<const float>(z)));
  check("records in raw memory",
        strided_points(reinterpret_cast<const float*>(records.data() + 1), count, record));
}

}  // namespace globalmatch::containers
