// The largest consensus of a few matches, by brute force: every angle of a fine grid, and at each every place
// that can be the centre of a ball around most of the translations that the matches ask for.
#pragma once

#include "globalmatch/detail/core/rigid.hpp"

#include "baselines/yaw_search.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace globalmatch {

/// The centre of the smallest sphere through one to four points.
inline Eigen::Vector3d center_of_sphere(const std::vector<Eigen::Vector3d>& points) {
  if (points.size() == 1) return points[0];
  Eigen::MatrixXd edges(3, Eigen::Index(points.size()) - 1);
  for (std::size_t i = 1; i < points.size(); ++i) edges.col(Eigen::Index(i) - 1) = points[i] - points[0];
  const Eigen::MatrixXd gram = edges.transpose() * edges;
  const Eigen::VectorXd shares = gram.ldlt().solve(gram.diagonal() / 2);
  return points[0] + edges * shares;
}

/// How many points a ball of this radius can hold at most: the smallest ball around any of them touches one
/// to four.
inline std::size_t most_in_ball(const std::vector<Eigen::Vector3d>& points, double radius) {
  constexpr double rounding = 1e-9;
  const std::size_t n = points.size();
  std::size_t most = 0;
  for (std::size_t chosen = 1; chosen < std::size_t(1) << n; ++chosen) {
    std::vector<Eigen::Vector3d> support;
    for (std::size_t i = 0; i < n; ++i)
      if (chosen >> i & 1) support.push_back(points[i]);
    if (support.size() > 4) continue;
    const Eigen::Vector3d center = center_of_sphere(support);
    const auto inside = std::size_t(std::count_if(points.begin(), points.end(), [&](const auto& p) {
      return (p - center).norm() <= radius + rounding;
    }));
    most = std::max(most, inside);
  }
  return most;
}

/// At most eight matches or so. What the grid misses, a threshold wider by half its step times the largest
/// distance of a source point from the axis does not.
inline std::size_t exhaustive_consensus(const std::vector<benchmarks::point_match>& matches, double threshold,
                                        double angle_step) {
  std::size_t most = 0;
  for (double angle = -std::numbers::pi; angle < std::numbers::pi; angle += angle_step) {
    std::vector<Eigen::Vector3d> translations;
    const detail::mat3 turn = detail::rotation_about_z(angle);
    for (const benchmarks::point_match& m : matches) {
      const detail::vec3 t = m.target - turn * m.source;
      translations.push_back({t.x, t.y, t.z});
    }
    most = std::max(most, most_in_ball(translations, threshold));
  }
  return most;
}

}  // namespace globalmatch
