// The simulator's trees: what a stem is, how it looks, and the branches and leaves on it.
#pragma once

#include "support/simulator/surfaces.hpp"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>

namespace globalmatch::detail {
class random_source;
}

namespace globalmatch::support {

struct tree_options {
  double dbh_min = 0.05;      ///< [m] diameters at breast height, 1.3 m: this plus a Weibull variable ...
  double dbh_scale = 0.19;    ///< [m] ... of this scale ...
  double dbh_shape = 2.5;     ///< ... and this shape ...
  double dbh_max = 0.6;       ///< [m] ... but no more than this
  double height = 16;         ///< [m] of a tree of 20 cm; thicker ones are higher
  double lean = 2;            ///< [deg] median from the vertical; no stem leans twice as much
  double common_lean = 0;     ///< [deg] all lean that much one way (wind, snow, a slope that creeps)
  double sweep = 0.1;         ///< [m] standard deviation of the stem's bow, half way up
  double flare = 0.35;        ///< share by which the root flare widens the base
  double bark = 0.003;        ///< [m] standard deviation of the bark's relief
  double pairs = 0.03;        ///< share of trees with another one half a metre away
  double multi_stem = 0.03;   ///< share of trees with two or three stems from one root
  double forked = 0.05;       ///< share of stems that fork above breast height
  double crown_base = 0.45;   ///< share of the height below the crown
  double crown_radius = 1.7;  ///< [m] at the base of the crown
  std::size_t branches = 24;  ///< live ones, in the crown
  std::size_t leaves = 1000;  ///< discs in each crown
  double leaf_radius = 0.05;  ///< [m] a small spray of leaves or needles
  std::size_t dead_branches = 10;  ///< below the crown, from knee height up
};

struct stem {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< [m] where the axis meets the ground
  double dbh = 0.2;                                    ///< [m] diameter at 1.3 m
  double height = 15;                                  ///< [m]
  Eigen::Vector2d lean = Eigen::Vector2d::Zero();      ///< [m/m] the axis' way sideways per metre up
  Eigen::Vector2d sweep = Eigen::Vector2d::Zero();     ///< [m] the axis' bow half way up
  double fork_height = 0;                              ///< [m] 0: it does not fork
  Eigen::Vector2d fork = Eigen::Vector2d::Zero();      ///< [m/m] the second stem's way off the first
  bool inside = true;                                  ///< it stands on the plot, not in the margin
  bool harvested = false;                              ///< it is gone once the plot is harvested

  /// Point of the axis [m] at a height [m] above the position.
  Eigen::Vector3d axis_at(double height_above) const;
};

/// Throws `std::invalid_argument` naming the field when an option makes no sense.
void require_valid(const tree_options& options);

/// A random stem, upright but for its random lean.
stem random_stem(const tree_options& options, const Eigen::Vector3d& position, detail::random_source& random);

/// The stem's skin, forks included, as part of the `index`-th stem.
void add_stem(surfaces& scene, const stem& s, std::uint32_t index, const tree_options& options,
              detail::random_source& random);

/// Live branches with their leaves, and dead branches below.
void add_crown(surfaces& scene, const stem& s, const tree_options& options, detail::random_source& random);

}  // namespace globalmatch::support
