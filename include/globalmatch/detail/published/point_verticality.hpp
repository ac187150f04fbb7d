// Verticality of points ([GM] Eq. (1)): v = 1 - |n . up| with normals n from principal component analysis of
// the neighbourhood. In: local points (their z axis is up). Out: a normal, a verticality and the spacing of
// points around each.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include "globalmatch/detail/core/decompositions.hpp"
#include "globalmatch/detail/core/local_points.hpp"
#include "globalmatch/detail/core/neighbor.hpp"
#include "globalmatch/detail/core/neighbors.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/mapping_options.hpp"
#include "globalmatch/points.hpp"

namespace globalmatch::detail {

/// The surface around a point.
struct local_surface {
  vec3f normal;       ///< unit, sign arbitrary; zero where there are too few neighbours
  float spacing = 0;  ///< [m] distance of points on the surface: that of a square grid of equal density

  /// [GM] Eq. (1); 0 without a normal.
  float verticality() const { return normal == vec3f{} ? 0.0f : 1.0f - std::abs(normal.z); }
};

/// Normal, verticality and spacing of each point. Cost: O(n log n) queries; parallel.
inline std::vector<local_surface> estimate_surfaces(const local_points& points,
                                                    const verticality_options& options = {},
                                                    const execution& exec = {}) {
  require_valid(options);
  constexpr double paper_radius = 0.10;  // [m] [GM] 3.1
  const neighbor_tree<float, 3> tree(points.size(), [&](std::size_t i) { return points[i]; });
  std::vector<local_surface> surfaces(points.size());
  parallel_chunks(exec, "verticality", points.size(), 1024, [&](std::size_t begin, std::size_t end) {
    std::vector<neighbor<float>> nearest;
    for (std::size_t i = begin; i < end; ++i) {
      const vec3f center = points[i];
      const neighbor_tree<float, 3>::query_point query{center.x, center.y, center.z};
      std::size_t count = 0;
      vec3 sum;
      mat3 squares;
      const auto gather = [&](std::uint32_t j, float) {
        const vec3 d(points[j] - center);  // small numbers keep the digits
        ++count;
        sum += d;
        squares += outer(d, d);
      };
      double radius = options.radius.value_or(paper_radius);
      tree.for_each_within(query, static_cast<float>(radius), gather);
      if (!options.radius && count < std::size_t(options.min_neighbors)) {
        count = 0;
        sum = {};
        squares = {};
        tree.nearest(query, std::size_t(options.min_neighbors), nearest);
        for (const auto& n : nearest) {
          if (n.squared_distance > options.max_radius * options.max_radius) break;
          gather(n.index, n.squared_distance);
          radius = std::max(paper_radius, std::sqrt(double(n.squared_distance)));
        }
      }
      surfaces[i].spacing = static_cast<float>(radius * std::sqrt(std::numbers::pi / double(count)));
      if (count < 3) continue;
      const vec3 mean = sum / double(count);
      const mat3 covariance = squares / double(count) - outer(mean, mean);
      surfaces[i].normal = vec3f(symmetric_eigen(covariance).vectors.col(0));
    }
  });
  return surfaces;
}

/// Positions of the points whose verticality exceeds the threshold; of all with a normal when the constraint
/// is off.
inline std::vector<point_index> select_stem_points(const std::vector<local_surface>& surfaces,
                                                   const verticality_options& options = {}) {
  require_valid(options);
  constexpr double paper_threshold = 0.9;
  const double threshold = options.threshold.value_or(paper_threshold);
  std::vector<point_index> chosen;
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    const bool has_normal = !(surfaces[i].normal == vec3f{});
    if (has_normal && (!options.constraint || surfaces[i].verticality() > threshold))
      chosen.push_back(static_cast<point_index>(i));
  }
  return chosen;
}

}  // namespace globalmatch::detail
