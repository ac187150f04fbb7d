// Pairs of samples, and the uncertainty of a transform that fits them.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/rigid_fit.hpp"
#include "globalmatch/detail/core/small_solver.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/icp_options.hpp"

namespace globalmatch::detail {

/// A transformed source sample with its partner in the target, the normal there, and its weight in the fit.
struct icp_pair {
  vec3 transformed, target, normal;
  double weight = 1;

  double off_plane() const { return normal.dot(transformed - target); }
};

/// What a pair says of a shift and turns about a center, along one direction.
inline small_vector observation_of(const vec3& direction, const vec3& arm, bool four) {
  const vec3 turn = arm.cross(direction);
  if (four) return {direction.x, direction.y, direction.z, turn.z};
  return {direction.x, direction.y, direction.z, turn.x, turn.y, turn.z};
}

/// Uncertainty of the transform that fits the pairs: how much the pairs of each block of ground move it alone
/// (infinitesimal jackknife, Jaeckel 1972; for clusters Liang and Zeger 1986, Biometrika 73(1)). Pairs of one
/// stem, or of one place on the ground, have errors in common: there are as many independent ones as blocks.
inline icp_uncertainty uncertainty_of_fit(const std::vector<icp_pair>& pairs, degrees_of_freedom dof,
                                          icp_metric metric) {
  constexpr double block_width = 2;  // [m] a stem and its surroundings
  const bool four = dof == degrees_of_freedom::four;
  icp_uncertainty result;
  double weights = 0;
  for (const icp_pair& pair : pairs) result.center += pair.weight * pair.transformed, weights += pair.weight;
  if (!(weights > 0)) return result;
  result.center /= weights;
  small_matrix normal;
  normal.size = four ? 4 : 6;
  std::map<std::pair<double, double>, small_vector> blocks;
  for (const icp_pair& pair : pairs) {
    if (!(pair.weight > 0)) continue;
    const vec3 arm = pair.transformed - result.center, off = pair.transformed - pair.target;
    small_vector& block = blocks[{std::floor(arm.x / block_width), std::floor(arm.y / block_width)}];
    const auto add = [&](const vec3& direction) {
      const small_vector row = observation_of(direction, arm, four);
      normal.add_square(row, pair.weight);
      for (std::size_t k = 0; k < normal.size; ++k) block[k] += pair.weight * direction.dot(off) * row[k];
    };
    if (metric == icp_metric::point_to_plane)
      add(pair.normal);
    else
      for (const vec3& axis : {vec3{1, 0, 0}, vec3{0, 1, 0}, vec3{0, 0, 1}}) add(axis);
  }
  const double count = double(blocks.size()), degrees = count - double(normal.size);
  const small_solver solver(normal);
  if (!(degrees > 2) || !solver.succeeded()) return result;
  result.covariance.size = normal.size;
  for (const auto& [place, block] : blocks)  // the variance of Student's t, as few blocks determine it
    result.covariance.add_square(solver.solve(block), count / (degrees - 2));
  result.is_determined = true;
  return result;
}

}  // namespace globalmatch::detail
