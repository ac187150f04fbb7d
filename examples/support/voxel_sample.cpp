#include "support/voxel_sample.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "globalmatch/detail/core/random.hpp"

namespace globalmatch::support {

namespace {

std::uint64_t hash_of_voxel(const Eigen::Vector3d& p, double voxel) {
  std::uint64_t hash = 0;
  for (Eigen::Index axis = 0; axis < 3; ++axis)
    hash = detail::random_source(hash, std::uint64_t(std::int64_t(std::floor(p[axis] / voxel)))).next();
  return hash;
}

}  // namespace

void voxel_sample::add(const sampled_point& p) {
  const std::uint64_t hash = hash_of_voxel(p.position, voxel_);
  if (hash > limit_ || max_points_ == 0) return;
  kept_.try_emplace(hash, p);
  if (kept_.size() > 2 * max_points_) keep_smallest();
}

void voxel_sample::keep_smallest() {
  std::vector<std::uint64_t> hashes;
  for (const auto& [hash, p] : kept_) hashes.push_back(hash);
  const auto last = hashes.begin() + std::ptrdiff_t(max_points_ - 1);
  std::nth_element(hashes.begin(), last, hashes.end());
  limit_ = *last;
  std::erase_if(kept_, [&](const auto& entry) { return entry.first > limit_; });
}

std::vector<sampled_point> voxel_sample::points() const {
  std::vector<std::pair<std::uint64_t, sampled_point>> sorted(kept_.begin(), kept_.end());
  std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<sampled_point> points;
  for (std::size_t i = 0; i < std::min(sorted.size(), max_points_); ++i) points.push_back(sorted[i].second);
  return points;
}

}  // namespace globalmatch::support
