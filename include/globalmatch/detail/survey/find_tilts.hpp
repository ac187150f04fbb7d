// Scans that are not level: what the vertical fits of links say of the verticals of maps. In: a solved
// survey. Out: maps turned upright.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/disjoint_sets.hpp"
#include "globalmatch/detail/core/rigid.hpp"
#include "globalmatch/detail/core/robust.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/detail/matching/matching_context.hpp"
#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "globalmatch/detail/matching/vertical_fit.hpp"
#include "globalmatch/detail/survey/adjust_links.hpp"
#include "globalmatch/detail/survey/plan_pose.hpp"
#include "globalmatch/detail/survey/refined_adjustment.hpp"
#include "globalmatch/detail/survey/survey_link.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/survey_options.hpp"

namespace globalmatch::detail {

/// What a link says of the verticals of its maps: by how much the source's leans against the target's, as a
/// rotation vector [rad] along the axes of the survey.
struct relative_tilt {
  bool is_rotated = false;  ///< beyond doubt
  vec2 turn = {0, 0};
  double variance = 0;  ///< [rad^2] about each axis
  double slope = 0;     ///< [rad] of the heights, where these slope but positions say that they are level
};

/// Nothing where the heights of the link do not tell. `target`: the pose of its target.
inline std::optional<relative_tilt> tilt_of_link(std::span<const prepared_stems> maps, const survey_link& l,
                                                 const plan_pose& target) {
  constexpr double level_sigma = 0.01, min_variance = 1e-6;  // [rad, rad^2]
  const prepared_stems &from = maps[l.source], &to = maps[l.target];
  const matching_context context(from.stems, to.stems, from.index, to.index, true, degrees_of_freedom::four);
  local_hypothesis h;
  h.target_from_source = in_space(l.target_from_source, raise_of(maps, l));
  h.inlier_threshold = l.inlier_threshold;
  h.correspondences = l.correspondences;
  const local_vertical_fit found = fit_vertical(h, context, true);
  if (!found.fit.is_known()) return std::nullopt;
  if (found.fit.kind != vertical_kind::rotated)
    return relative_tilt{false, {0, 0}, level_sigma * level_sigma, found.fit.tilt};
  const mat3& r = h.target_from_source.rotation;
  const vec2 in_target = {-r(1, 2), r(0, 2)};  // what turns the target's vertical to the source's
  const auto& covariance = *found.covariance;
  return relative_tilt{true, plan_pose{{0, 0}, target.yaw}.turned(in_target),
                       std::max({min_variance, covariance(3, 3), covariance(4, 4)})};
}

/// What the links that are used say of the verticals of their maps; nothing of others, nor of those by
/// targets.
inline std::vector<std::optional<relative_tilt>> tilts_of_links(std::span<const prepared_stems> maps,
                                                                std::span<const survey_link> links,
                                                                std::span<const plan_pose> poses,
                                                                const execution& exec) {
  std::vector<std::optional<relative_tilt>> of_link(links.size());
  parallel_for(exec, "verticals", links.size(), [&](std::size_t i) {
    if (links[i].used && !links[i].is_of_targets())
      of_link[i] = tilt_of_link(maps, links[i], poses[links[i].target]);
  });
  return of_link;
}

/// Maps whose heights slope against those of most maps that they are linked to, by what matters: they are no
/// heights of the ground, and where they agree with others is a matter of chance.
inline std::vector<std::uint8_t> find_sloping(std::span<const survey_link> links,
                                              std::span<const std::optional<relative_tilt>> of_link,
                                              std::size_t maps) {
  constexpr double max_slope = 0.005;  // [rad] a decimetre at 20 m
  std::vector<std::vector<double>> slopes(maps);
  for (std::size_t i = 0; i < links.size(); ++i)
    if (of_link[i])
      for (const std::uint32_t m : {links[i].source, links[i].target}) slopes[m].push_back(of_link[i]->slope);
  std::vector<std::uint8_t> sloping(maps);
  for (std::size_t m = 0; m < maps; ++m)  // of two neighbors one may be wrong, not the map
    sloping[m] = !slopes[m].empty() && nth_smallest(slopes[m], (slopes[m].size() - 1) / 2) > max_slope;
  return sloping;
}

/// What most of some rotation vectors [rad] are, or their mean where no majority agrees.
inline vec2 typical_turn(std::span<const vec2> turns) {
  constexpr double min_scale = 0.002;  // [rad] of verticals that agree
  constexpr int iterations = 20;
  std::vector<double> x, y, off;
  for (const vec2& t : turns) x.push_back(t.x), y.push_back(t.y);
  vec2 typical = {median(x), median(y)};
  for (const vec2& t : turns) off.push_back((t - typical).norm());
  const double largest = tukey_constant * std::max(min_scale, deviation_of_median * median(off));
  for (int iteration = 0; iteration < iterations; ++iteration) {
    vec2 sum = {0, 0};
    double total = 0;
    for (const vec2& t : turns) {
      const double weight = tukey_weight((t - typical).squared_norm() / (largest * largest));
      sum += weight * t;
      total += weight;
    }
    if (!(total > 0)) break;
    typical = sum / total;
  }
  return typical;
}

/// Turns [rad] of the maps whose verticals are known, as weighted means over what links with verticals
/// connect.
class known_verticals {
 public:
  known_verticals(std::span<const survey_link> links, std::span<const std::optional<relative_tilt>> of_link,
                  std::span<const vec2> turns, std::span<const survey_options::level> levels)
      : connected_(turns.size()), sums_(turns.size(), vec2{0, 0}), weights_(turns.size(), 0) {
    for (std::size_t i = 0; i < links.size(); ++i)
      if (of_link[i]) connected_.join(links[i].source, links[i].target);
    for (const survey_options::level& l : levels) {
      const std::size_t group = connected_.find(point_index(l.scan));
      const double weight = 1 / (l.sigma * l.sigma);
      sums_[group] += weight * turns[l.scan];
      weights_[group] += weight;
    }
  }

  /// Nothing where links connect the map with none of them.
  std::optional<vec2> beside(std::uint32_t map) {
    const std::size_t group = connected_.find(map);
    if (!(weights_[group] > 0)) return std::nullopt;
    return sums_[group] / weights_[group];
  }

 private:
  disjoint_sets connected_;
  std::vector<vec2> sums_;
  std::vector<double> weights_;
};

/// Rotation vectors [rad] along the axes of the survey by which the verticals of maps lean against the known
/// ones, or else against those of most of their component, `part_of` each; zero where no link says beyond
/// doubt that a map leans.
inline std::vector<vec2> find_tilts(std::span<const survey_link> links,
                                    std::span<const std::optional<relative_tilt>> of_link,
                                    std::span<const std::uint32_t> part_of,
                                    std::span<const survey_options::level> levels = {}) {
  constexpr double min_tilt = 0.004, unknown_variance = 1;  // [rad] of what matters, [rad^2]
  const std::size_t maps = part_of.size();
  std::vector<vec2> tilts(maps, vec2{0, 0});
  if (std::none_of(of_link.begin(), of_link.end(), [](const auto& t) { return t && t->is_rotated; }))
    return tilts;
  const auto datum = std::uint32_t(maps);
  std::vector<measured_difference> about_x, about_y;
  const auto add = [&](std::uint32_t source, std::uint32_t target, const vec2& turn, double variance) {
    about_x.push_back({source, target, turn.x, variance});
    about_y.push_back({source, target, turn.y, variance});
  };
  std::vector<std::uint8_t> is_rotated(maps);
  for (std::size_t i = 0; i < links.size(); ++i) {
    if (!of_link[i]) continue;
    add(links[i].source, links[i].target, of_link[i]->turn, of_link[i]->variance);
    for (const std::uint32_t m : {links[i].source, links[i].target})
      is_rotated[m] = is_rotated[m] || of_link[i]->is_rotated;
  }
  for (std::uint32_t m = 0; m < datum; ++m) add(m, datum, {0, 0}, unknown_variance);
  const unknown_poses unknowns(maps + 1, [&](std::size_t m) { return m == datum; });
  std::vector<double> x(maps + 1, 0), y(maps + 1, 0);
  if (adjust_differences(about_x, unknowns, x).empty() || adjust_differences(about_y, unknowns, y).empty())
    return tilts;
  std::vector<vec2> turns;
  std::vector<std::vector<vec2>> of_parts(maps);
  for (std::size_t m = 0; m < maps; ++m) {
    turns.push_back({x[m], y[m]});
    of_parts[part_of[m]].push_back(turns[m]);
  }
  known_verticals known(links, of_link, turns, levels);
  std::vector<vec2> typical(maps, vec2{0, 0});
  for (std::size_t part = 0; part < maps; ++part)
    if (!of_parts[part].empty()) typical[part] = typical_turn(of_parts[part]);
  for (std::uint32_t m = 0; m < maps; ++m) {
    // Maps that all lean alike are linked to each other without a doubt; only a known vertical says so.
    const std::optional<vec2> vertical = known.beside(m);
    if (!is_rotated[m] && !vertical) continue;
    const vec2 tilt = turns[m] - vertical.value_or(typical[part_of[m]]);
    if (tilt.norm() > min_tilt) tilts[m] = tilt;
  }
  return tilts;
}

/// A map turned upright, whose vertical leans by a rotation vector [rad] along the axes of the survey.
inline prepared_stems turned_upright(const prepared_stems& map, const vec2& tilt, double yaw) {
  const vec2 local = plan_pose{{0, 0}, -yaw}.turned(tilt);
  const vec3 axis = {local.x / tilt.norm(), local.y / tilt.norm(), 0};
  const mat3 upright = rotation_about(axis, tilt.norm());
  position_set stems = map.stems;
  for (vec3& p : stems.at) p = upright * p;
  for (vec3& a : stems.axis) a = upright * a;
  stems.frame.rotation = upright * stems.frame.rotation;
  return without_triangles(std::move(stems), true, {});
}

}  // namespace globalmatch::detail
