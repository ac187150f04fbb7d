// Own point types: the library reads them as they are, and gives equal results for all of them.
#include <globalmatch/stem_mapping.hpp>

#include <array>
#include <cmath>
#include <cstdint>
#include <iostream>
#include <numbers>
#include <string_view>
#include <vector>

namespace mine {

// Members x, y and z: nothing to do.
struct lidar_return {
  float x, y, z;
  std::uint16_t intensity;
};

// Anything else: specialise point_traits.
class survey_point {
 public:
  survey_point(double easting, double northing, double height) : values_{easting, northing, height} {}
  const std::array<double, 3>& coordinates() const { return values_; }

 private:
  std::array<double, 3> values_;
};

// A cloud in the manner of PCL: points with x, y and z, and begin() and end().
struct padded_point {
  float x, y, z, padding;
};
struct cloud {
  std::vector<padded_point> points;
  auto begin() const { return points.begin(); }
  auto end() const { return points.end(); }
};

}  // namespace mine

template <>
struct globalmatch::point_traits<mine::survey_point> {
  static const std::array<double, 3>& xyz(const mine::survey_point& p) { return p.coordinates(); }
};

namespace {

/// Four stems of 12 cm on level ground, on a millimetre grid of powers of two, so that float holds every
/// coordinate.
std::vector<Eigen::Vector3d> small_scene() {
  std::vector<Eigen::Vector3d> points;
  const auto add = [&](double x, double y, double z) {
    constexpr double grid = 1024;
    points.emplace_back(std::round(x * grid) / grid, std::round(y * grid) / grid,
                        std::round(z * grid) / grid);
  };
  for (double x = -1; x < 7; x += 0.1)
    for (double y = -1; y < 6; y += 0.1) add(x, y, 0);
  for (const auto& [x, y] : {std::pair(1.0, 1.0), {4.5, 0.5}, {2.0, 4.0}, {5.5, 3.5}})
    for (double z = 0.02; z < 4; z += 0.03)
      for (double angle = 0; angle < 2 * std::numbers::pi; angle += 0.2)
        add(x + 0.12 * std::cos(angle), y + 0.12 * std::sin(angle), z);
  return points;
}

bool same_stems(const globalmatch::stem_map& a, const globalmatch::stem_map& b) {
  if (a.stems.size() != b.stems.size()) return false;
  for (std::size_t i = 0; i < a.stems.size(); ++i)
    if (a.stems[i].position != b.stems[i].position || a.stems[i].radius != b.stems[i].radius) return false;
  return true;
}

}  // namespace

int main() {
  using globalmatch::map_stems;
  const std::vector<Eigen::Vector3d> doubles = small_scene();
  const globalmatch::stem_map expected = map_stems(doubles);
  std::cout << expected.stems.size() << " stems\n";
  bool all_equal = true;
  const auto check = [&](std::string_view name, const auto& points) {
    const bool equal = same_stems(map_stems(points), expected);
    std::cout << name << (equal ? ": equal\n" : ": DIFFERENT\n");
    all_equal = all_equal && equal;
  };

  std::vector<mine::lidar_return> returns;
  std::vector<mine::survey_point> survey;
  std::vector<std::array<float, 3>> arrays;
  std::vector<Eigen::Vector3f> floats;
  mine::cloud cloud;
  Eigen::Matrix3Xd matrix(3, static_cast<Eigen::Index>(doubles.size()));
  std::vector<float> xs, ys, zs;
  for (const Eigen::Vector3d& p : doubles) {
    const Eigen::Vector3f f = p.cast<float>();
    returns.push_back({f.x(), f.y(), f.z(), 0});
    survey.emplace_back(p.x(), p.y(), p.z());
    arrays.push_back({f.x(), f.y(), f.z()});
    floats.push_back(f);
    cloud.points.push_back({f.x(), f.y(), f.z(), 1});
    matrix.col(static_cast<Eigen::Index>(xs.size())) = p;
    xs.push_back(f.x());
    ys.push_back(f.y());
    zs.push_back(f.z());
  }
  check("std::vector of a struct", returns);
  check("a type with point_traits", survey);
  check("std::vector<std::array<float, 3>>", arrays);
  check("std::vector<Eigen::Vector3f>", floats);
  check("Eigen::Matrix3Xd::colwise()", matrix.colwise());
  check("a cloud in the manner of PCL", cloud);
  check("a structure of arrays", globalmatch::soa_points<float>(xs, ys, zs));
  check("strided raw memory",
        globalmatch::strided_points(&returns.front().x, returns.size(), sizeof(returns.front())));
  return all_equal ? 0 : 1;
}
