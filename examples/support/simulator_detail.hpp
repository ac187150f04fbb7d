// Internal to the simulator: what its parts share.
#pragma once

#include <Eigen/Core>

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace globalmatch::support::simulator_detail {

constexpr double pi = std::numbers::pi;

inline double radians(double degrees) {
  return degrees * pi / 180;
}

inline Eigen::Vector2d unit_vector(double azimuth) {
  return {std::cos(azimuth), std::sin(azimuth)};
}

inline void require(bool holds, const char* complaint) {
  if (!holds) throw std::invalid_argument(complaint);
}

}  // namespace globalmatch::support::simulator_detail
