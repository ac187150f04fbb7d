// Verticality ([GM] Eq. (1)): v = 1 - |n . up| with normals n from principal component analysis of the
// neighbourhood. In: local points (their z axis is up). Out: a normal, a verticality and the spacing of
// points around each.
#pragma once

#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <vector>

#include "globalmatch/execution.hpp"
#include "globalmatch/local_points.hpp"
#include "globalmatch/neighbors.hpp"
#include "globalmatch/points.hpp"

namespace globalmatch {

struct verticality_options {
  bool constraint = true;  ///< false: every understory point may be of a stem ([GM] 5.3.1)
  double threshold = 0.9;  ///< gamma: stem points have a higher verticality ([GM] 3.1: 0.9)
  /// [m] radius of the ball whose points make the normal ([GM] 3.1: 0.10). Empty: 0.10 where such a ball
  /// holds `least_neighbors`, else as much more as it takes to hold them, up to `largest_radius`.
  std::optional<double> radius = {};
  int least_neighbors = 10;      ///< for a radius from the data (ours)
  double largest_radius = 0.25;  ///< [m] for a radius from the data (ours)
};

/// Throws `std::invalid_argument` naming the field that makes no sense.
inline void require_valid(const verticality_options& options) {
  if (!(options.threshold >= 0 && options.threshold < 1))
    throw std::invalid_argument("verticality.threshold must lie in [0, 1)");
  if (options.radius && !(*options.radius > 0))
    throw std::invalid_argument("verticality.radius must be positive");
  if (options.least_neighbors < 3)
    throw std::invalid_argument("verticality.least_neighbors must be at least 3");
  if (!(options.largest_radius > 0))
    throw std::invalid_argument("verticality.largest_radius must be positive");
}

/// The surface around a point.
struct local_surface {
  Eigen::Vector3f normal =
      Eigen::Vector3f::Zero();  ///< unit, sign arbitrary; zero where there are too few neighbours
  float spacing = 0;  ///< [m] distance of points on the surface: that of a square grid of equal density

  /// [GM] Eq. (1); 0 without a normal.
  float verticality() const { return normal.isZero() ? 0.0f : 1.0f - std::abs(normal.z()); }
};

inline namespace GLOBALMATCH_THREADING {

/// Normal, verticality and spacing of each point. Cost: O(n log n) queries; parallel.
inline std::vector<local_surface> estimate_surfaces(const local_points& points,
                                                    const verticality_options& options = {},
                                                    const execution& how = {}) {
  require_valid(options);
  constexpr double paper_radius = 0.10;  // [m] [GM] 3.1
  const neighbor_tree<float, 3> tree(points.size(), [&](std::size_t i) { return points[i]; });
  std::vector<local_surface> surfaces(points.size());
  parallel_chunks(how, "verticality", points.size(), 1024, [&](std::size_t begin, std::size_t end) {
    std::vector<neighbor<float>> nearest;
    for (std::size_t i = begin; i < end; ++i) {
      const Eigen::Vector3f center = points[i];
      const neighbor_tree<float, 3>::query_point query{center.x(), center.y(), center.z()};
      std::size_t count = 0;
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
      const auto gather = [&](std::uint32_t j, float) {
        const Eigen::Vector3d d = (points[j] - center).cast<double>();  // small numbers keep the digits
        ++count;
        sum += d;
        squares += d * d.transpose();
      };
      double radius = options.radius.value_or(paper_radius);
      tree.for_each_within(query, static_cast<float>(radius), gather);
      if (!options.radius && count < std::size_t(options.least_neighbors)) {
        count = 0;
        sum.setZero();
        squares.setZero();
        tree.nearest(query, std::size_t(options.least_neighbors), nearest);
        for (const auto& n : nearest) {
          if (n.squared_distance > options.largest_radius * options.largest_radius) break;
          gather(n.index, n.squared_distance);
          radius = std::max(paper_radius, std::sqrt(double(n.squared_distance)));
        }
      }
      surfaces[i].spacing = static_cast<float>(radius * std::sqrt(std::numbers::pi / double(count)));
      if (count < 3) continue;
      const Eigen::Vector3d mean = sum / double(count);
      const Eigen::Matrix3d covariance = squares / double(count) - mean * mean.transpose();
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
      solver.computeDirect(covariance);
      surfaces[i].normal = solver.eigenvectors().col(0).cast<float>();
    }
  });
  return surfaces;
}

}  // namespace GLOBALMATCH_THREADING

/// Positions of the points whose verticality exceeds the threshold; of all with a normal when the constraint
/// is off.
inline std::vector<point_index> select_stem_points(const std::vector<local_surface>& surfaces,
                                                   const verticality_options& options = {}) {
  require_valid(options);
  std::vector<point_index> chosen;
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    const bool has_normal = !surfaces[i].normal.isZero();
    if (has_normal && (!options.constraint || surfaces[i].verticality() > options.threshold))
      chosen.push_back(static_cast<point_index>(i));
  }
  return chosen;
}

}  // namespace globalmatch
