// What a ray can hit: the simulator's scene as plain triangles, cones and discs.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace globalmatch::support {

constexpr std::uint32_t no_stem = UINT32_MAX;

/// Quads, each of two triangles (0, 1, 3) and (2, 3, 1).
struct quad_mesh {
  std::vector<Eigen::Vector3f> vertices = {};  ///< [m]
  std::vector<std::array<std::uint32_t, 4>> quads = {};
};

/// A scene in the frame of its plot.
struct surfaces {
  quad_mesh ground = {};
  quad_mesh stems = {};
  std::vector<std::uint32_t> stem_of_quad = {};  ///< for each quad of `stems`

  std::vector<Eigen::Vector4f> curve_points = {};  ///< [m] place and radius
  std::vector<std::uint32_t> curves = {};          ///< each a cone from this point to the next

  std::vector<Eigen::Vector4f> discs = {};  ///< [m] centre and radius
  std::vector<Eigen::Vector3f> disc_normals = {};

  /// A chain of cones with flat ends. Each point is a place and a radius [m].
  void add_curve(std::span<const Eigen::Vector4d> points);
  void add_curve(std::initializer_list<Eigen::Vector4d> points) {
    add_curve(std::span(points.begin(), points.size()));
  }
  void add_disc(const Eigen::Vector3d& centre, double radius, const Eigen::Vector3d& normal);
};

}  // namespace globalmatch::support
