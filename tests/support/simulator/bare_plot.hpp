// Scenes simple enough for theory: level ground, upright cylinders, a scanner in the middle.
#pragma once

#include "support/simulator/scanner.hpp"

#include <functional>
#include <numbers>
#include <string>
#include <utility>

namespace globalmatch::support {

using namespace detail;

constexpr double degree = std::numbers::pi / 180;

/// An option with a value that must be refused.
template <class Options>
using wrong_option = std::pair<std::string, std::function<void(Options&)>>;

/// Nothing grows here and nothing is uneven.
inline plot_options bare_options() {
  plot_options o;
  o.margin = 0;
  o.layout.stems_per_hectare = 0;
  o.ground = {.slope = 0, .relief = 0, .hump_height = 0, .roughness = 0};
  o.trees.flare = o.trees.bark = o.trees.lean = o.trees.sweep = 0;
  o.trees.pairs = o.trees.multi_stem = o.trees.forked = 0;
  o.trees.branches = o.trees.leaves = o.trees.dead_branches = 0;
  o.undergrowth.shrubs_per_hectare = o.undergrowth.logs_per_hectare = 0;
  o.undergrowth.stumps_per_hectare = o.undergrowth.poles_per_hectare = 0;
  return o;
}

/// So high that it does not taper where it is looked at.
inline stem cylinder(double x, double y, double diameter) {
  stem s;
  s.position = {x, y, 0};
  s.dbh = diameter;
  s.height = 1000;
  return s;
}

/// 1.6 m above the middle of a plot.
inline station in_the_middle() {
  return {Eigen::Isometry3d(Eigen::Translation3d(0, 0, 1.6))};
}

/// No noise, no mixed pixels, no multipath.
inline scanner_options perfect_scanner(double angular_step) {
  scanner_options o;
  o.angular_step = angular_step;
  o.range_noise = o.mixed_pixels = o.multipath = 0;
  return o;
}

inline simulated_scan scan_of(const plot& scene, const scanner_options& options, const execution& exec = {}) {
  return scan_from(in_the_middle(), scene, ray_caster(surfaces_of(scene), exec), options, exec);
}

}  // namespace globalmatch::support
