// The transform on which most stems agree, of all that three correspondences define.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "globalmatch/transform.hpp"

namespace globalmatch::oracles {

/// Source stems that end within `inlier_threshold` [m horizontal] of a target stem.
inline std::size_t agreeing_stems(const std::vector<Eigen::Vector3d>& source,
                                  const std::vector<Eigen::Vector3d>& target,
                                  const Eigen::Isometry3d& target_from_source, double inlier_threshold) {
  return std::size_t(std::count_if(source.begin(), source.end(), [&](const Eigen::Vector3d& p) {
    const Eigen::Vector3d at = target_from_source * p;
    return std::any_of(target.begin(), target.end(), [&](const Eigen::Vector3d& q) {
      return (at - q).head<2>().norm() < inlier_threshold;
    });
  }));
}

/// Three stems, by their indices.
using stem_triplet = std::array<std::size_t, 3>;

/// Twice the signed area [m^2] in plan.
inline double doubled_area(const std::vector<Eigen::Vector3d>& stems, const stem_triplet& t) {
  const Eigen::Vector3d a = stems[t[1]] - stems[t[0]], b = stems[t[2]] - stems[t[0]];
  return a.x() * b.y() - a.y() * b.x();
}

/// Area [m^2] in plan, twice, over the longest edge.
inline double horizontal_width(const std::vector<Eigen::Vector3d>& stems, const stem_triplet& t) {
  double longest = 0;
  for (std::size_t i = 0; i < 3; ++i)
    longest = std::max(longest, (stems[t[i]] - stems[t[(i + 1) % 3]]).head<2>().norm());
  return std::abs(doubled_area(stems, t)) / longest;
}

/// Whether the horizontal edges of both are alike, and their senses of rotation unless the source's is
/// narrow.
inline bool congruent_triplets(const std::vector<Eigen::Vector3d>& source, const stem_triplet& s,
                               const std::vector<Eigen::Vector3d>& target, const stem_triplet& t,
                               double threshold) {
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    if (std::abs((source[s[i]] - source[s[j]]).head<2>().norm() -
                 (target[t[i]] - target[t[j]]).head<2>().norm()) >= threshold)
      return false;
  }
  return horizontal_width(source, s) < threshold ||
         (doubled_area(source, s) > 0) == (doubled_area(target, t) > 0);
}

/// Of the transforms of all congruent triplets that `accept(source triplet, target triplet)` the number of
/// stems that agree on the best.
template <class Accept>
std::size_t most_agreeing_stems(const std::vector<Eigen::Vector3d>& source,
                                const std::vector<Eigen::Vector3d>& target, double threshold,
                                const Accept& accept) {
  std::size_t most = 0;
  const auto try_triplets = [&](const stem_triplet& s, const stem_triplet& t) {
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0] ||
        !congruent_triplets(source, s, target, t, threshold) || !accept(s, t))
      return;
    const std::array from = {source[s[0]], source[s[1]], source[s[2]]};
    const std::array to = {target[t[0]], target[t[1]], target[t[2]]};
    if (const auto transform = fit_transform(from, to, degrees_of_freedom::four))
      most = std::max(most, agreeing_stems(source, target, *transform, threshold));
  };
  for (std::size_t i = 0; i < source.size(); ++i)
    for (std::size_t j = i + 1; j < source.size(); ++j)
      for (std::size_t k = j + 1; k < source.size(); ++k)
        for (std::size_t a = 0; a < target.size(); ++a)
          for (std::size_t b = 0; b < target.size(); ++b)
            for (std::size_t c = 0; c < target.size(); ++c) try_triplets({i, j, k}, {a, b, c});
  return most;
}

}  // namespace globalmatch::oracles
