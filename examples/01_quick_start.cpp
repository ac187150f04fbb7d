// Quick start: two scans in, the transform from source to target out.
#include <globalmatch/registration.hpp>

#include <fstream>
#include <iomanip>
#include <iostream>
#include <stdexcept>
#include <string>
#include <vector>

struct point {  // any type of your own: see 02_own_point_types.cpp
  float x, y, z;
};

std::vector<point> read_ply(const std::string& path) {  // binary, vertices of three floats
  std::ifstream file(path, std::ios::binary);
  std::size_t count = 0;
  for (std::string word; file >> word && word != "end_header";)
    if (word == "vertex") file >> count;
  std::vector<point> points(count);
  file.ignore().read(reinterpret_cast<char*>(points.data()), std::streamsize(count * sizeof(point)));
  if (!file || file.peek() != std::ifstream::traits_type::eof())
    throw std::runtime_error(path + ": not x, y, z as floats");
  return points;
}

int main(int argc, char** argv) {
  if (argc != 3) return std::cerr << "usage: 01_quick_start SOURCE.ply TARGET.ply\n", 2;
  const auto result = globalmatch::register_scans(read_ply(argv[1]), read_ply(argv[2])).registration;
  if (!result.target_from_source) {
    std::cerr << to_string(result.outcome) << ": " << result.reason << '\n';
    return 1;
  }
  std::cout << std::setprecision(12) << result.target_from_source->matrix() << '\n';
}
