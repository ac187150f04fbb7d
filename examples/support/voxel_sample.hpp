// Points that are picked evenly in space, however many there are, in one pass.
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <unordered_map>
#include <vector>

namespace globalmatch::support {

struct sampled_point {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< [m]
  double height = 0;                                   ///< [m] above the ground
};

/// Keeps the first point of each voxel, and of the voxels those of the smallest hashes: a sample of all that
/// does not depend on the order of the points but for which one of a voxel is kept. Memory is that of twice
/// the points that are kept.
class voxel_sample {
 public:
  voxel_sample(double voxel, std::size_t max_points) : voxel_(voxel), max_points_(max_points) {}

  void add(const sampled_point& p);

  /// At most `max_points`, in the order of the hashes.
  std::vector<sampled_point> points() const;

 private:
  void keep_smallest();

  double voxel_;
  std::size_t max_points_;
  std::uint64_t limit_ = std::numeric_limits<std::uint64_t>::max();  // hashes above it are not kept
  std::unordered_map<std::uint64_t, sampled_point> kept_;
};

}  // namespace globalmatch::support
