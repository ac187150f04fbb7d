#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "support/atomic_file.hpp"
#include "support/scan_files.hpp"

namespace globalmatch::support {

namespace {

// Below this, neighbouring floats are less than 0.1 mm apart.
constexpr double float_keeps_tenth_millimetre = 1024;

bool fits_float(std::span<const Eigen::Vector3d> points) {
  return std::none_of(points.begin(), points.end(), [](const Eigen::Vector3d& p) {
    return (p.array().abs() >= float_keeps_tenth_millimetre).any();
  });
}

template <class T>
void append(std::vector<char>& bytes, T value) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  if constexpr (std::endian::native == std::endian::big) std::reverse(raw, raw + sizeof(T));
  bytes.insert(bytes.end(), raw, raw + sizeof(T));
}

void write_header(std::ostream& out, std::size_t count, const char* type, bool with_colours) {
  out << "ply\nformat binary_little_endian 1.0\nelement vertex " << count << '\n';
  for (const char axis : {'x', 'y', 'z'}) out << "property " << type << ' ' << axis << '\n';
  if (with_colours) out << "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  out << "end_header\n";
}

template <class T>
void write_vertices(std::ostream& out, std::span<const Eigen::Vector3d> points,
                    std::span<const rgb> colours) {
  constexpr std::size_t block = 1 << 16;
  std::vector<char> bytes;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (const double coordinate : points[i]) append(bytes, static_cast<T>(coordinate));
    if (!colours.empty()) bytes.insert(bytes.end(), colours[i].begin(), colours[i].end());
    if (bytes.size() < block && i + 1 < points.size()) continue;
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    bytes.clear();
  }
}

}  // namespace

void write_ply(const std::filesystem::path& path, std::span<const Eigen::Vector3d> points,
               std::span<const rgb> colours) {
  if (!colours.empty() && colours.size() != points.size())
    throw std::invalid_argument("write_ply: colours must be none, or one for each point");
  atomic_file file(path);
  const bool as_float = fits_float(points);
  write_header(file.stream(), points.size(), as_float ? "float" : "double", !colours.empty());
  as_float ? write_vertices<float>(file.stream(), points, colours)
           : write_vertices<double>(file.stream(), points, colours);
  file.commit();
}

}  // namespace globalmatch::support
