// Own point types: the library reads them as they are, and gives equal results for all of them.
#include <globalmatch/stem_mapping.hpp>

#include <array>
#include <cmath>
#include <cstdint>
#include <iostream>
#include <utility>
#include <vector>

namespace mine {
struct lidar_return {  // members x, y and z, or a fixed size and [0] [1] [2]: nothing to do
  float x, y, z;
  std::uint16_t intensity;
};
struct survey_point {  // anything else: specialise point_traits
  std::array<double, 3> coordinates;
};
}  // namespace mine

template <>
struct globalmatch::point_traits<mine::survey_point> {
  static const std::array<double, 3>& xyz(const mine::survey_point& p) { return p.coordinates; }
};

namespace {

/// Four stems of 12 cm radius on level ground; whole 1024ths of a metre, which float holds exactly.
std::vector<mine::lidar_return> small_scene() {
  std::vector<mine::lidar_return> points;
  const auto add = [&](double x, double y, double z) {
    const auto rounded = [](double v) { return float(std::round(v * 1024) / 1024); };
    points.push_back({rounded(x), rounded(y), rounded(z), 0});
  };
  for (double x = -1; x < 7; x += 0.1)
    for (double y = -1; y < 6; y += 0.1) add(x, y, 0);
  for (const auto& [x, y] : {std::pair(1.0, 1.0), {4.5, 0.5}, {2.0, 4.0}, {5.5, 3.5}})
    for (double z = 0.02; z < 4; z += 0.03)
      for (double angle = 0; angle < 6.28; angle += 0.2)
        add(x + 0.12 * std::cos(angle), y + 0.12 * std::sin(angle), z);
  return points;
}

/// For any range of points: pcl::PointCloud, matrix.colwise(), globalmatch::soa_points(x, y, z), ...
void print_stems(const char* name, const globalmatch::point_range auto& points) {
  std::cout << name << ":\n";
  for (const globalmatch::stem& s : globalmatch::map_stems(points).stems)
    std::cout << "  " << s.position.transpose() << ", radius " << s.radius << '\n';
}

}  // namespace

int main() {
  const auto returns = small_scene();
  std::vector<mine::survey_point> survey;
  for (const auto& p : returns) survey.push_back({{p.x, p.y, p.z}});
  print_stems("a vector of structs", returns);
  print_stems("a type with point_traits", survey);
  print_stems("raw memory", globalmatch::strided_points(&returns[0].x, returns.size(), sizeof(returns[0])));
}
