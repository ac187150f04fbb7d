// What stands and lies between the simulator's trees: shrubs, grass, logs, stumps and poles.
#pragma once

#include "support/simulator/surfaces.hpp"
#include "support/simulator/terrain.hpp"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace globalmatch::detail {
class random_source;
}

namespace globalmatch::support {

struct undergrowth_options {
  double shrubs_per_hectare = 200;
  double shrub_min_height = 0.3;       ///< [m]
  double shrub_max_height = 1.2;       ///< [m]
  std::size_t shrub_leaves = 250;      ///< discs on a shrub of 1 m; they grow with the square of its height
  double shrub_leaf_radius = 0.025;    ///< [m]
  double blades_per_square_metre = 0;  ///< of grass, in tufts
  double grass_height = 0.35;          ///< [m] of the highest
  double logs_per_hectare = 20;        ///< fallen, 5 cm to 30 cm thick
  double stumps_per_hectare = 20;
  double poles_per_hectare = 3;  ///< posts and stakes, 1 m to 2.5 m high
};

struct shrub {
  Eigen::Vector3d position;  ///< [m] on the ground
  double height = 1;         ///< [m]
  double radius = 0.5;       ///< [m]
};

/// Throws `std::invalid_argument` naming the field when an option makes no sense.
void require_valid(const undergrowth_options& options);

/// Shrubs at random on a rectangle of that half size [m].
std::vector<shrub> plant_shrubs(const undergrowth_options& options, const terrain& ground,
                                const Eigen::Vector2d& half_size, std::uint64_t seed);

void add_shrub(surfaces& scene, const shrub& s, const undergrowth_options& options,
               detail::random_source& random);

/// Grass all over a rectangle of that half size [m].
void add_grass(surfaces& scene, const undergrowth_options& options, const terrain& ground,
               const Eigen::Vector2d& half_size, std::uint64_t seed);

/// Logs, stumps and poles at random places that `is_free`; that of a log is its thick end.
void add_debris(surfaces& scene, const undergrowth_options& options, const terrain& ground,
                const Eigen::Vector2d& half_size, const std::function<bool(const Eigen::Vector2d&)>& is_free,
                std::uint64_t seed);

/// What a harvested stem leaves: a stump, and a heap of slash beside it.
void add_remains(surfaces& scene, const Eigen::Vector3d& position, double dbh, const terrain& ground,
                 detail::random_source& random);

}  // namespace globalmatch::support
