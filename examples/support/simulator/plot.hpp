// The simulator's forest: a random plot, and all its surfaces.
#pragma once

#include "support/simulator/layout.hpp"
#include "support/simulator/surfaces.hpp"
#include "support/simulator/terrain.hpp"
#include "support/simulator/trees.hpp"
#include "support/simulator/undergrowth.hpp"

#include <Eigen/Core>

#include <cstdint>
#include <span>
#include <vector>

namespace globalmatch::support {

/// What a plot is like. The origin of its frame is its middle, z is up.
struct plot_options {
  double width = 50;   ///< [m] along x
  double depth = 50;   ///< [m] along y
  double margin = 10;  ///< [m] of the same forest all around: a scanner sees out of a plot
  ground_options ground = {};
  layout_options layout = {};
  tree_options trees = {};
  undergrowth_options undergrowth = {};
  double harvest = 0;  ///< share of the stems that are gone once the plot is harvested
  std::uint64_t seed = 1;

  /// Half the size [m] of all that is planted, margin included.
  Eigen::Vector2d half_size() const { return {0.5 * width + margin, 0.5 * depth + margin}; }
};

/// A forest plot. It may as well be put together by hand.
struct plot {
  plot_options options;
  terrain ground;
  std::vector<stem> stems = {};  ///< those in the margin included
  std::vector<shrub> shrubs = {};
};

/// A random plot. Throws `std::invalid_argument` naming the field when an option makes no sense, or when the
/// stems cannot stand that densely.
plot grow_plot(const plot_options& options = {});

/// All that rays can hit. Shrubs, and the stumps and poles among them, keep 0.8 m away from `clearings`:
/// nobody puts a scanner in a shrub. Grass grows there all the same, and logs, branches and slash may reach
/// in. `harvested`: the harvested stems are stumps, with their slash beside them.
surfaces surfaces_of(const plot& scene, std::span<const Eigen::Vector2d> clearings = {},
                     bool harvested = false);

}  // namespace globalmatch::support
