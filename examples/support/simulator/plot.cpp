#include "support/simulator/plot.hpp"

#include "support/simulator/detail.hpp"

#include <algorithm>

namespace globalmatch::support {
namespace {

using namespace simulator_detail;
using Eigen::Vector2d;
using Eigen::Vector3d;

void require_valid(const plot_options& o) {
  require(o.width > 0 && o.width <= 1000, "plot_options.width must be in (0, 1000] m");
  require(o.depth > 0 && o.depth <= 1000, "plot_options.depth must be in (0, 1000] m");
  require(o.margin >= 0 && o.margin <= 100, "plot_options.margin must be in [0, 100] m");
  require(o.harvest >= 0 && o.harvest <= 1, "plot_options.harvest must be in [0, 1]");
  support::require_valid(o.trees);
  support::require_valid(o.undergrowth);
}

/// Stems of one tree: one, or a pair half a metre apart, or a few from one root that lean away from it.
std::vector<stem> random_tree(const tree_options& o, const Vector2d& place, const Vector2d& common_lean,
                              const terrain& ground, detail::random_source& random) {
  std::vector<stem> stems = {random_stem(o, ground.at(place), random)};
  const double kind = random.uniform();
  const auto add_beside = [&](const Vector2d& offset, double lean_out) {
    stems.push_back(random_stem(o, ground.at(place + offset), random));
    stems.back().lean += lean_out * offset.normalized();
  };
  if (kind < o.pairs) {
    add_beside(0.5 * random_direction(random), 0);
  } else if (kind < o.pairs + o.multi_stem) {
    const Vector2d direction = random_direction(random);
    const Vector2d first = between(0.3, 0.45, random) * direction;
    add_beside(first, between(0.05, 0.15, random));
    if (random.uniform() < 0.5) add_beside({-first.y(), first.x()}, between(0.05, 0.15, random));
  }
  for (stem& s : stems) s.lean += common_lean;
  return stems;
}

std::vector<stem> plant_stems(const plot_options& o, const terrain& ground) {
  const double stems_per_tree = 1 + o.trees.pairs + 1.5 * o.trees.multi_stem;
  detail::random_source random = random_for(o.seed, stream::stems);
  const Vector2d common_lean = std::tan(radians(o.trees.common_lean)) * random_direction(random);
  std::vector<stem> stems;
  for (const Vector2d& place : tree_places(o.layout, o.half_size(), 1 / stems_per_tree, o.seed))
    for (const stem& s : random_tree(o.trees, place, common_lean, ground, random)) stems.push_back(s);
  detail::random_source felling = random_for(o.seed, stream::harvest);
  for (stem& s : stems) {
    s.inside = std::abs(s.position.x()) <= 0.5 * o.width && std::abs(s.position.y()) <= 0.5 * o.depth;
    s.harvested = felling.uniform() < o.harvest;
  }
  return stems;
}

}  // namespace

plot grow_plot(const plot_options& options) {
  require_valid(options);
  constexpr double surroundings = 30;  // [m] of bare ground beyond the last tree
  const Vector2d extent = options.half_size() + Vector2d::Constant(surroundings);
  plot scene = {options, make_terrain(options.ground, extent, options.seed)};
  scene.stems = plant_stems(options, scene.ground);
  scene.shrubs = plant_shrubs(options.undergrowth, scene.ground, options.half_size(), options.seed);
  return scene;
}

surfaces surfaces_of(const plot& scene, std::span<const Vector2d> clearings, bool harvested) {
  constexpr double clearing_radius = 0.8;  // [m]
  const plot_options& o = scene.options;
  const auto is_free = [&](const Vector2d& place, double radius) {
    return std::none_of(clearings.begin(), clearings.end(), [&](const Vector2d& clearing) {
      return (clearing - place).norm() < clearing_radius + radius;
    });
  };

  surfaces all;
  all.ground = scene.ground.mesh();
  for (std::uint32_t i = 0; i < scene.stems.size(); ++i) {
    const stem& s = scene.stems[i];
    detail::random_source skin = random_for(o.seed, stream::tubes, i),
                          crown = random_for(o.seed, stream::crowns, i);
    if (harvested && s.harvested) {
      add_remains(all, s.position, s.dbh, scene.ground, skin);
    } else {
      add_stem(all, s, i, o.trees, skin);
      add_crown(all, s, o.trees, crown);
    }
  }
  for (std::size_t i = 0; i < scene.shrubs.size(); ++i) {
    const shrub& s = scene.shrubs[i];
    detail::random_source random = random_for(o.seed, stream::shrubs, i + 1);
    if (is_free(s.position.head<2>(), s.radius)) add_shrub(all, s, o.undergrowth, random);
  }
  add_grass(all, o.undergrowth, scene.ground, o.half_size(), o.seed);
  add_debris(
      all, o.undergrowth, scene.ground, o.half_size(),
      [&](const Vector2d& place) { return is_free(place, 0); }, o.seed);
  return all;
}

}  // namespace globalmatch::support
