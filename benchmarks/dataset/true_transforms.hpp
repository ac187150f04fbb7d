// The true transforms between the scans of a plot, from poses or from pairs.
#pragma once

#include <Eigen/Geometry>

#include "matrix_tables.hpp"

#include <algorithm>
#include <cstddef>
#include <iomanip>
#include <limits>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace globalmatch::benchmarks {

/// [m] and [rad] by which two truths may differ. Published ones are good to some millimetres; a matrix of
/// other scans, or of the wrong direction, is off by metres.
constexpr double max_truth_distance = 0.1, max_truth_angle = 0.01;

/// How far apart two transforms of a scan put its scanner, and by how much they turn it.
struct transform_difference {
  double distance = 0, angle = 0;  ///< [m], [rad]

  bool is_contradiction() const { return distance > max_truth_distance || angle > max_truth_angle; }
};

inline transform_difference difference(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  const Eigen::Matrix3d turned = a.linear().transpose() * b.linear();
  return {(a.translation() - b.translation()).norm(), Eigen::AngleAxisd(turned).angle()};
}

/// A known transform between two scans, and where it is written.
struct true_pair {
  std::size_t source = 0, target = 0;
  Eigen::Isometry3d target_from_source;
  std::string place = {};
};

/// What is known of the places of scans; of some perhaps nothing.
class true_transforms {
 public:
  true_transforms() = default;

  /// Of scans that have poses in one frame, the plot's, whose z is up.
  explicit true_transforms(std::vector<std::optional<Eigen::Isometry3d>> plot_from_scan)
      : poses_(std::move(plot_from_scan)) {}

  /// Of pairs. The frame of the plot is that of scan `root`; scans that no chain of pairs connects with it
  /// have no pose.
  true_transforms(std::size_t scans, std::vector<true_pair> pairs, std::size_t root = 0)
      : poses_(scans), pairs_(std::move(pairs)), root_(root) {
    poses_[root] = Eigen::Isometry3d::Identity();
    for (bool is_further = true; std::exchange(is_further, false);)
      for (const true_pair& pair : pairs_) {
        auto &source = poses_[pair.source], &target = poses_[pair.target];
        if (source.has_value() == target.has_value()) continue;
        is_further = true;
        if (target)
          source = *target * pair.target_from_source;
        else
          target = *source * pair.target_from_source.inverse();
      }
  }

  std::size_t size() const { return poses_.size(); }
  bool has_pose(std::size_t scan) const { return poses_[scan].has_value(); }
  bool is_of_pairs() const { return !pairs_.empty(); }
  const std::vector<true_pair>& pairs() const { return pairs_; }
  const Eigen::Isometry3d& plot_from_scan(std::size_t scan) const { return poses_[scan].value(); }

  std::vector<std::size_t> without_pose() const {
    std::vector<std::size_t> scans;
    for (std::size_t i = 0; i < poses_.size(); ++i)
      if (!poses_[i]) scans.push_back(i);
    return scans;
  }

  /// As it is written where it is, else by the poses of both.
  Eigen::Isometry3d target_from_source(std::size_t source, std::size_t target) const {
    for (const true_pair& pair : pairs_) {
      if (pair.source == source && pair.target == target) return pair.target_from_source;
      if (pair.source == target && pair.target == source) return pair.target_from_source.inverse();
    }
    return plot_from_scan(target).inverse() * plot_from_scan(source);
  }

  /// The same scans where each matrix, as it is written, is `changed`.
  template <class Change>
  true_transforms with_each(const Change& changed) const {
    if (is_of_pairs()) {
      std::vector<true_pair> pairs = pairs_;
      for (true_pair& pair : pairs) pair.target_from_source = changed(pair.target_from_source);
      return {size(), std::move(pairs), root_};
    }
    std::vector<std::optional<Eigen::Isometry3d>> poses = poses_;
    for (auto& pose : poses)
      if (pose) pose = changed(*pose);
    return true_transforms(std::move(poses));
  }

 private:
  std::vector<std::optional<Eigen::Isometry3d>> poses_;
  std::vector<true_pair> pairs_;
  std::size_t root_ = 0;
};

/// The pair whose own matrix contradicts the chain of the others that gave both scans their poses most.
inline std::optional<std::pair<true_pair, transform_difference>> worst_contradiction(
    const true_transforms& truth) {
  std::optional<std::pair<true_pair, transform_difference>> worst;
  for (const true_pair& pair : truth.pairs()) {
    if (!truth.has_pose(pair.source) || !truth.has_pose(pair.target)) continue;
    const Eigen::Isometry3d by_chain =
        truth.plot_from_scan(pair.target).inverse() * truth.plot_from_scan(pair.source);
    const transform_difference off = difference(pair.target_from_source, by_chain);
    if (off.is_contradiction() && (!worst || off.distance > worst->second.distance)) worst = {pair, off};
  }
  return worst;
}

/// Where two truths differ most: the scans, and by how much; nothing where no pair has both.
inline std::optional<true_pair> worst_difference(const true_transforms& a, const true_transforms& b,
                                                 transform_difference& worst) {
  std::optional<true_pair> where;
  for (std::size_t target = 0; target < a.size(); ++target)
    for (std::size_t source = target + 1; source < a.size(); ++source) {
      if (!a.has_pose(source) || !a.has_pose(target) || !b.has_pose(source) || !b.has_pose(target)) continue;
      const Eigen::Isometry3d by_a = a.target_from_source(source, target);
      const transform_difference off = difference(by_a, b.target_from_source(source, target));
      if (where && off.distance <= worst.distance && off.angle <= worst.angle) continue;
      worst = {std::max(worst.distance, off.distance), std::max(worst.angle, off.angle)};
      where = true_pair{source, target, by_a};
    }
  return where;
}

inline std::string to_text(const transform_difference& d) {
  std::ostringstream text;
  text << std::setprecision(3) << d.distance << " m and " << 1000 * d.angle << " mrad";
  return text.str();
}

/// The scan with the smallest mean distance to the others.
inline std::size_t middle_scan(const true_transforms& truth) {
  std::size_t middle = 0;
  double smallest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < truth.size(); ++i) {
    double sum = 0;
    for (std::size_t j = 0; j < truth.size(); ++j)
      sum += (truth.plot_from_scan(i).translation() - truth.plot_from_scan(j).translation()).norm();
    if (sum < smallest) {
      smallest = sum;
      middle = i;
    }
  }
  return middle;
}

}  // namespace globalmatch::benchmarks
