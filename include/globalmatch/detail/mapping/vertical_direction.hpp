// The direction that the stems of a scan stand in: its vertical, where nobody levelled the scanner.
// In: axes of stems. Out: their robust mean. Ours; [GM] takes scans as levelled. The ground has no say,
// because slopes are no tilt.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

/// Angle [rad] between two unit vectors.
inline double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// The direction that stems stand in, from their axes (unit, pointing up): the mean in which those count less
/// that lean more (Beaton and Tukey 1974, The fitting of power series, Technometrics 16(2)). Nothing from
/// fewer than ten stems. Cost: linear.
inline std::optional<upright_direction> upright_of(std::span<const Eigen::Vector3d> axes) {
  constexpr std::size_t min_stems = 10;
  constexpr int max_iterations = 20;
  constexpr double tukey_constant = 4.685, median_of_rayleigh = 1.1774;  // standard deviations
  constexpr double min_noise = 1e-6;                                     // [rad]
  if (axes.size() < min_stems) return std::nullopt;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& a : axes) first += a;
  upright_direction upright{first.normalized(), 0};
  std::vector<double> tilts(axes.size());
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    for (std::size_t i = 0; i < axes.size(); ++i) tilts[i] = angle_between(axes[i], upright.up);
    const double noise = std::max(median(tilts) / median_of_rayleigh, min_noise);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double weights = 0;
    for (const Eigen::Vector3d& a : axes) {
      const double off = std::pow(angle_between(a, upright.up) / (tukey_constant * noise), 2);
      const double weight = off < 1 ? std::pow(1 - off, 2) : 0;
      sum += weight * a;
      weights += weight;
    }
    upright = {sum.normalized(), noise / std::sqrt(weights)};
  }
  return upright;
}

/// Whether stems stand clearly askew to `up` (unit): by more than they may by chance, and more than stands do
/// that lean with the wind.
inline bool is_tilted(const upright_direction& upright, const Eigen::Vector3d& up) {
  constexpr double deviations = 4, usual = 4 * std::numbers::pi / 180;  // [rad]
  return angle_between(upright.up, up) > std::max(usual, deviations * upright.sigma);
}

}  // namespace globalmatch::detail
