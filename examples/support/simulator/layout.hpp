// Where trees stand: at random, in clumps, or in rows.
#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace globalmatch::support {

enum class arrangement { random, clumped, rows };

struct layout_options {
  support::arrangement arrangement = support::arrangement::random;
  double stems_per_hectare = 600;  ///< [1/ha] random and clumped; rows have as many as they have
  double min_spacing = 0.8;        ///< [m] between two places, random and clumped
  double clump_size = 6;           ///< mean number of places in a clump
  double clump_radius = 2;         ///< [m] standard deviation around its middle
  double row_spacing = 3;          ///< [m] between rows, which run along x
  double tree_spacing = 3;         ///< [m] along a row
  double row_jitter = 0.1;         ///< [m] standard deviation along x and along y
  double missing = 0.1;            ///< share of places in rows that are empty
};

/// Throws `std::invalid_argument` naming the field when an option makes no sense.
void require_valid(const layout_options& options);

/// Places on a rectangle of that half size [m] around the origin; `share` thins random and clumped layouts.
/// Throws `std::invalid_argument` naming the field when the places cannot be that dense.
std::vector<Eigen::Vector2d> tree_places(const layout_options& options, const Eigen::Vector2d& half_size,
                                         double share, std::uint64_t seed);

}  // namespace globalmatch::support
