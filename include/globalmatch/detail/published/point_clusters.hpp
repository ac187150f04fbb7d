// Euclidean clusters of points ([GM] 3.1): points joined, directly or through others, by steps shorter than a
// link distance. Cost: O(n log n) and the number of links.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <vector>

#include "globalmatch/detail/core/disjoint_sets.hpp"
#include "globalmatch/detail/core/local_points.hpp"
#include "globalmatch/detail/core/neighbors.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/mapping/clusters.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/points.hpp"

namespace globalmatch::detail {

/// Clusters of at least `min_points` points, ordered by their first point. Two points are linked when they
/// are nearer than the larger of their link distances [m].
inline point_clusters cluster_points(const local_points& points, std::span<const float> link_distances,
                                     std::size_t min_points, const execution& exec = {}) {
  if (link_distances.size() != points.size())
    throw std::invalid_argument("link_distances must hold one distance for each point");
  const neighbor_tree<float, 3> tree(points.size(), [&](std::size_t i) { return points[i]; });
  disjoint_sets sets(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i % 65536 == 0) report_progress(exec, "clusters", double(i) / double(points.size()));
    tree.for_each_within({points.x[i], points.y[i], points.z[i]}, link_distances[i],
                         [&](std::uint32_t j, float) { sets.join(static_cast<point_index>(i), j); });
  }

  std::vector<std::size_t> size_of(points.size(), 0), place(points.size(), 0);
  for (point_index i = 0; i < points.size(); ++i) ++size_of[sets.find(i)];
  point_clusters clusters;
  for (point_index i = 0; i < points.size(); ++i) {
    if (size_of[i] == 0 || size_of[i] < min_points) continue;
    place[i] = clusters.first.back();
    clusters.first.push_back(place[i] + size_of[i]);
  }
  clusters.members.resize(clusters.first.back());
  for (point_index i = 0; i < points.size(); ++i) {
    const point_index representative = sets.find(i);
    if (size_of[representative] >= min_points) clusters.members[place[representative]++] = i;
  }
  return clusters;
}

}  // namespace globalmatch::detail
