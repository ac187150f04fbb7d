// Made-up surveys in plan: maps on a grid or a ring, links between them, and the stems that they see.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "globalmatch/detail/survey/link_graph.hpp"
#include "globalmatch/detail/survey/place_maps.hpp"
#include "globalmatch/detail/survey/plan_pose.hpp"
#include "globalmatch/detail/survey/survey_link.hpp"
#include "indices.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::scenes {

constexpr double station_spacing = 22;  // [m]

inline double any_yaw(random_source& random) {
  return uniform(random, -std::numbers::pi, std::numbers::pi);
}

/// Maps on a square grid of `side` by `side`, each with a yaw of its own; the first is the survey's frame.
inline std::vector<plan_pose> grid_of_maps(std::size_t side, random_source& random) {
  std::vector<plan_pose> poses;
  for (std::size_t i = 0; i < side * side; ++i)
    poses.push_back({{station_spacing * double(i % side), station_spacing * double(i / side)},
                     i == 0 ? 0 : any_yaw(random)});
  return poses;
}

/// Maps around a ring; the first is the survey's frame.
inline std::vector<plan_pose> ring_of_maps(std::size_t count, random_source& random) {
  std::vector<plan_pose> poses;
  const double radius = station_spacing * double(count) / (2 * std::numbers::pi);
  for (std::size_t i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * double(i) / double(count);
    poses.push_back(
        {{radius * (std::cos(angle) - 1), radius * std::sin(angle)}, i == 0 ? 0 : any_yaw(random)});
  }
  return poses;
}

/// How well links measure.
struct link_noise {
  double shift = 0, yaw = 0;  ///< [m] [rad] standard deviations
};

/// The link that maps at these poses have; its center is halfway between them.
inline survey_link link_between(std::uint32_t source, std::uint32_t target,
                                const std::vector<plan_pose>& poses, const link_noise& noise,
                                random_source& random) {
  constexpr double min_shift = 0.005, min_yaw = 0.0005;  // [m] [rad] that links without noise claim
  const vec2 middle = 0.5 * (poses[source].shift + poses[target].shift),
             in_source = poses[source].inverse() * middle;
  survey_link link;
  link.source = source;
  link.target = target;
  link.center = poses[target].inverse() * middle;
  link.center += {noise.shift * random.normal(), noise.shift * random.normal()};
  link.target_from_source.yaw = wrapped(poses[source].yaw - poses[target].yaw + noise.yaw * random.normal());
  link.target_from_source.shift = link.center - link.target_from_source.turned(in_source);
  const double shift = std::max(min_shift, noise.shift), yaw = std::max(min_yaw, noise.yaw);
  link.covariance = mat3::diagonal_of({shift * shift, shift * shift, yaw * yaw});
  link.log10_nfa = -20;
  return link;
}

/// Links of all maps that are nearer to each other than `range` [m].
inline std::vector<survey_link> links_within(double range, const std::vector<plan_pose>& poses,
                                             const link_noise& noise, random_source& random) {
  std::vector<survey_link> links;
  for (std::uint32_t s = 0; s < poses.size(); ++s)
    for (std::uint32_t t = s + 1; t < poses.size(); ++t)
      if ((poses[s].shift - poses[t].shift).norm() < range)
        links.push_back(link_between(s, t, poses, noise, random));
  return links;
}

/// Has the link place its source anywhere.
inline void make_wrong(survey_link& link, random_source& random) {
  link.target_from_source = {{uniform(random, -30, 30), uniform(random, -30, 30)}, any_yaw(random)};
}

/// Largest distance [m] of poses from the truth, at the maps and `arm` [m] from them, of those that `takes`.
template <class Takes>
double max_pose_error(const std::vector<plan_pose>& poses, const std::vector<plan_pose>& truth,
                      const Takes& takes) {
  constexpr double arm = 10;  // [m]
  double largest = 0;
  for (std::size_t m = 0; m < poses.size(); ++m)
    for (const vec2& p : {vec2{0, 0}, vec2{arm, 0}, vec2{0, arm}})
      if (takes(m)) largest = std::max(largest, (poses[m] * p - truth[m] * p).norm());
  return largest;
}
inline double max_pose_error(const std::vector<plan_pose>& poses, const std::vector<plan_pose>& truth) {
  return max_pose_error(poses, truth, [](std::size_t) { return true; });
}

/// Maps of a forest at such poses, in the order of its trees; stem i of a map is tree `trees[map][i]`.
struct maps_in_plan {
  std::vector<prepared_stems> maps;
  std::vector<std::vector<std::size_t>> trees;
  std::vector<double> heights;  ///< [m] of each map's frame
};

/// `noise` [m] of each coordinate. Trees are seen up to `range` [m].
inline maps_in_plan see_from(const std::vector<plan_pose>& poses, const positions& forest, double range,
                             double noise, random_source& random) {
  maps_in_plan seen;
  for (const plan_pose& pose : poses) {
    positions stems;
    seen.trees.emplace_back();
    seen.heights.push_back(seen.heights.empty() ? 0 : uniform(random, -3, 3));
    for (std::size_t i = 0; i < forest.size(); ++i) {
      const vec2 at = {forest[i].x(), forest[i].y()};
      if ((at - pose.shift).norm() > range) continue;
      const vec2 stem = pose.inverse() * at;
      stems.push_back({stem.x, stem.y, forest[i].z() - seen.heights.back()});
      seen.trees.back().push_back(i);
    }
    prepared_stems map;
    map.stems = set_in_order(noisy(stems, noise, random));
    seen.maps.push_back(std::move(map));
  }
  return seen;
}

/// Trees at least a metre apart, around maps on a grid of `side` by `side`.
inline positions forest_around_grid(std::size_t side, std::size_t count, random_source& random) {
  const double width = station_spacing * double(side);
  positions forest;
  while (forest.size() < count) {
    const Eigen::Vector3d p(uniform(random, -10, width), uniform(random, -10, width), uniform(random, 0, 4));
    bool is_apart = true;
    for (const Eigen::Vector3d& q : forest) is_apart = is_apart && (p - q).head<2>().norm() > 1;
    if (is_apart) forest.push_back(p);
  }
  return forest;
}

/// Gives links the stems that are one tree.
inline void pair_stems(std::vector<survey_link>& links, const maps_in_plan& seen) {
  for (survey_link& l : links)
    for (std::uint32_t i = 0; i < seen.trees[l.source].size(); ++i)
      for (std::uint32_t k = 0; k < seen.trees[l.target].size(); ++k)
        if (seen.trees[l.source][i] == seen.trees[l.target][k]) l.correspondences.push_back({i, k});
}

constexpr double tree_radius = 0.3;  // [m] within which stems are one tree
inline std::vector<double> tree_radii(std::size_t maps) {
  return std::vector<double>(maps, tree_radius);
}

/// Nine maps of a forest, their poses, and links of those that are neighbors.
struct nine_maps {
  std::vector<plan_pose> truth;
  maps_in_plan seen;
  std::vector<survey_link> links;

  nine_maps(double noise, random_source& random) : truth(grid_of_maps(3, random)) {
    const positions forest = forest_around_grid(3, 250, random);
    seen = see_from(truth, forest, 20, noise, random);
    links = links_within(25, truth, {0.01, 0.001}, random);
    for (survey_link& l : links) l.rms = 2 * std::max(noise, 0.01);
    pair_stems(links, seen);
  }

  std::vector<plan_pose> disturbed(double shift, random_source& random) const {
    auto poses = truth;
    for (std::size_t m = 1; m < poses.size(); ++m) {
      poses[m].shift += {uniform(random, -shift, shift), uniform(random, -shift, shift)};
      poses[m].yaw += uniform(random, -shift, shift) / 20;
    }
    return poses;
  }

  placed_maps placed_at(const std::vector<plan_pose>& poses) const {
    placed_maps placed;
    placed.poses = poses;
    placed.parts.of.assign(poses.size(), 0);
    placed.parts.reference = {0};
    return placed;
  }
};

/// Maps of a forest, prepared, in frames of their own, and where they are.
struct surveyed_grid {
  std::vector<plan_pose> truth;
  maps_in_plan seen;
  std::vector<prepared_stems> maps;

  surveyed_grid(std::size_t side, double noise, random_source& random) : truth(grid_of_maps(side, random)) {
    seen = see_from(truth, forest_around_grid(side, 50 * side * side, random), 20, noise, random);
    for (const prepared_stems& m : seen.maps)
      maps.push_back(without_triangles(set_in_order(positions_of(m.stems)), true, {}));
  }
};

}  // namespace globalmatch::scenes
