// Internal to the simulator: angles, random values and checks that its parts share.
#pragma once

#include "globalmatch/detail/core/random.hpp"

#include <Eigen/Core>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <stdexcept>

namespace globalmatch::support::simulator_detail {

constexpr double pi = std::numbers::pi;
constexpr double breast_height = 1.3;  // [m]

/// What random numbers are for. Each use has streams of its own, so that one option changes one thing.
enum class stream : std::uint64_t {
  ground = 1,
  places,
  stems,
  shrubs,
  debris,
  grass,
  stations,
  harvest,
  tubes,
  crowns,
  rays,
  paths
};

/// The random numbers of the `index`-th thing of one kind.
inline detail::random_source random_for(std::uint64_t seed, stream use, std::uint64_t index = 0) {
  return detail::random_source(seed, (static_cast<std::uint64_t>(use) << 48) + index);
}

inline double radians(double degrees) {
  return degrees * pi / 180;
}

inline Eigen::Vector2d unit_vector(double azimuth) {
  return {std::cos(azimuth), std::sin(azimuth)};
}

// Compilers choose the order of operands and of arguments: for scenes to be the same everywhere no expression
// may use the generator twice.

inline double between(double low, double high, detail::random_source& random) {
  return low + (high - low) * random.uniform();
}

inline Eigen::Vector2d random_direction(detail::random_source& random) {
  return unit_vector(between(-pi, pi, random));
}

/// Uniform in the rectangle of that half size around the origin.
inline Eigen::Vector2d random_place(const Eigen::Vector2d& half_size, detail::random_source& random) {
  const double x = between(-half_size.x(), half_size.x(), random);
  return {x, between(-half_size.y(), half_size.y(), random)};
}

inline Eigen::Vector3d normal_vector(detail::random_source& random) {
  const double x = random.normal(), y = random.normal();
  return {x, y, random.normal()};
}

/// How many things of that density stand on a rectangle of that half size [m].
inline std::size_t count_on(double per_hectare, const Eigen::Vector2d& half_size) {
  constexpr double square_metres = 10000;  // in a hectare
  return static_cast<std::size_t>(std::llround(per_hectare * 4 * half_size.prod() / square_metres));
}

inline void require(bool holds, const char* complaint) {
  if (!holds) throw std::invalid_argument(complaint);
}

}  // namespace globalmatch::support::simulator_detail
