#include "support/simulator/terrain.hpp"

#include "support/simulator/detail.hpp"

#include <algorithm>
#include <cmath>

namespace globalmatch::support {
namespace {

using namespace simulator_detail;
using Eigen::Vector2d;

struct wave {
  Vector2d frequency;  ///< [rad/m]
  double phase = 0;
  double amplitude = 0;  ///< [m]
};

/// Waves with these wavelengths [m], the longer the higher; their amplitudes add up to `height`.
void add_waves(std::vector<wave>& all, int count, double shortest, double longest, double height,
               detail::random_source& random) {
  std::vector<wave> added;
  double wavelengths = 0;
  for (int i = 0; i < count; ++i) {
    const double wavelength = between(shortest, longest, random);
    const Vector2d frequency = 2 * pi / wavelength * random_direction(random);
    added.push_back({frequency, between(-pi, pi, random), wavelength});
    wavelengths += wavelength;
  }
  for (wave& w : added) w.amplitude *= height / wavelengths;
  all.insert(all.end(), added.begin(), added.end());
}

void require_valid(const ground_options& o) {
  require(o.slope >= 0 && o.slope <= 45, "ground_options.slope must be in [0, 45] degrees");
  require(o.relief >= 0 && o.relief <= 10, "ground_options.relief must be in [0, 10] m");
  require(o.wavelength >= 5 && o.wavelength <= 1000, "ground_options.wavelength must be in [5, 1000] m");
  require(o.hump_height >= 0 && o.hump_height <= 2, "ground_options.hump_height must be in [0, 2] m");
  require(o.roughness >= 0 && o.roughness <= 0.2, "ground_options.roughness must be in [0, 0.2] m");
}

std::size_t nodes_over(double half_length) {
  return static_cast<std::size_t>(std::ceil(2 * half_length / terrain::cell)) + 1;
}

}  // namespace

terrain::terrain(const Vector2d& half_size, const std::function<double(const Vector2d&)>& height_at)
    : corner_(-half_size), columns_(nodes_over(half_size.x())), rows_(nodes_over(half_size.y())) {
  heights_.reserve(columns_ * rows_);
  for (std::size_t row = 0; row < rows_; ++row)
    for (std::size_t column = 0; column < columns_; ++column)
      heights_.push_back(height_at(corner_ + cell * Vector2d(double(column), double(row))));
}

double terrain::height(double x, double y) const {
  const double across = std::clamp((x - corner_.x()) / cell, 0.0, double(columns_ - 1));
  const double along = std::clamp((y - corner_.y()) / cell, 0.0, double(rows_ - 1));
  const std::size_t column = std::min(static_cast<std::size_t>(across), columns_ - 2);
  const std::size_t row = std::min(static_cast<std::size_t>(along), rows_ - 2);
  const double u = across - double(column), v = along - double(row);
  const double right = node(column + 1, row), left = node(column, row + 1);  // both triangles share these
  if (u + v <= 1) return (1 - u - v) * node(column, row) + u * right + v * left;
  return (u + v - 1) * node(column + 1, row + 1) + (1 - v) * right + (1 - u) * left;
}

quad_mesh terrain::mesh() const {
  quad_mesh mesh;
  mesh.vertices.reserve(heights_.size());
  for (std::size_t row = 0; row < rows_; ++row) {
    for (std::size_t column = 0; column < columns_; ++column) {
      const Vector2d place = corner_ + cell * Vector2d(double(column), double(row));
      mesh.vertices.emplace_back(float(place.x()), float(place.y()), float(node(column, row)));
      if (row + 1 == rows_ || column + 1 == columns_) continue;
      const auto i = static_cast<std::uint32_t>(row * columns_ + column);
      const auto above = i + static_cast<std::uint32_t>(columns_);
      mesh.quads.push_back({i, i + 1, above + 1, above});
    }
  }
  return mesh;
}

terrain make_terrain(const ground_options& options, const Vector2d& half_size, std::uint64_t seed) {
  require_valid(options);
  detail::random_source random = random_for(seed, stream::ground);
  const Vector2d gradient = std::tan(radians(options.slope)) * random_direction(random);
  std::vector<wave> waves;
  add_waves(waves, 6, 0.5 * options.wavelength, 1.5 * options.wavelength, options.relief, random);
  add_waves(waves, 8, 1.5, 4, options.hump_height, random);
  return terrain(half_size, [&](const Vector2d& place) {
    double height = gradient.dot(place) + options.roughness * random.normal();
    for (const wave& w : waves) height += w.amplitude * std::cos(w.frequency.dot(place) + w.phase);
    return height;
  });
}

}  // namespace globalmatch::support
