// Clusters by linking every pair of points: the oracle of `cluster_points`.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <map>
#include <numeric>
#include <vector>

#include "globalmatch/points.hpp"

namespace globalmatch::oracles {

/// Groups of at least `min_points`, members increasing, groups ordered by their first member. A pair is
/// linked when it is nearer than the larger of its two link distances.
inline std::vector<std::vector<point_index>> union_find_clusters(const std::vector<Eigen::Vector3f>& points,
                                                                 const std::vector<float>& link_distances,
                                                                 std::size_t min_points) {
  std::vector<point_index> label(points.size());
  std::iota(label.begin(), label.end(), point_index(0));
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const float link = std::max(link_distances[i], link_distances[j]);
      if (!((points[i] - points[j]).squaredNorm() < link * link)) continue;
      const auto [kept, given_up] = std::minmax({label[i], label[j]});
      std::replace(label.begin(), label.end(), given_up, kept);
    }
  std::map<point_index, std::vector<point_index>> groups;
  for (point_index i = 0; i < points.size(); ++i) groups[label[i]].push_back(i);
  std::vector<std::vector<point_index>> clusters;
  for (const auto& [least, members] : groups)
    if (members.size() >= min_points) clusters.push_back(members);
  return clusters;
}

}  // namespace globalmatch::oracles
