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

#include "globalmatch/detail/core/rigid.hpp"
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

namespace globalmatch::detail {

/// What a link says of the verticals of its maps: by how much the source's leans against the target's, as a
/// rotation vector [rad] along the axes of the survey.
struct relative_tilt {
  bool is_rotated = false;  ///< beyond doubt
  vec2 turn = {0, 0};
  double variance = 0;  ///< [rad^2] about each axis
};

/// Nothing where the heights of the link do not tell. `target`: the pose of its target.
inline std::optional<relative_tilt> tilt_of_link(std::span<const prepared_stems> maps, const survey_link& l,
                                                 const plan_pose& target) {
  constexpr double level_sigma = 0.01, min_variance = 1e-6;  // [rad, rad^2]
  const prepared_stems &from = maps[l.source], &to = maps[l.target];
  const matching_context context(from.stems, to.stems, from.index, to.index, true, degrees_of_freedom::four);
  std::vector<double> above;
  for (const correspondence& c : l.correspondences)
    above.push_back(to.stems.at[c.target].z - from.stems.at[c.source].z);
  local_hypothesis h;
  h.target_from_source = in_space(l.target_from_source, median(above));
  h.inlier_threshold = l.inlier_threshold;
  h.correspondences = l.correspondences;
  const local_vertical_fit found = fit_vertical(h, context, true);
  if (found.fit.kind == vertical_kind::sloping || !found.fit.is_known()) return std::nullopt;
  if (found.fit.kind == vertical_kind::level) return relative_tilt{false, {0, 0}, level_sigma * level_sigma};
  const mat3& r = h.target_from_source.rotation;
  const vec2 in_target = {-r(1, 2), r(0, 2)};  // what turns the target's vertical to the source's
  const auto& covariance = *found.covariance;
  return relative_tilt{true, plan_pose{{0, 0}, target.yaw}.turned(in_target),
                       std::max({min_variance, covariance(3, 3), covariance(4, 4)})};
}

/// Rotation vectors [rad] along the axes of the survey by which the verticals of maps lean against those of
/// most, from the links that are used; zero where no link says beyond doubt that a map leans.
inline std::vector<vec2> find_tilts(std::span<const prepared_stems> maps, std::span<const survey_link> links,
                                    std::span<const plan_pose> poses, const execution& exec) {
  constexpr double compensator_sigma = 0.01, min_tilt = 0.004;  // [rad] scanners are level; what matters
  std::vector<std::optional<relative_tilt>> of_link(links.size());
  parallel_for(exec, "verticals", links.size(), [&](std::size_t i) {
    if (links[i].used) of_link[i] = tilt_of_link(maps, links[i], poses[links[i].target]);
  });
  std::vector<vec2> tilts(maps.size(), vec2{0, 0});
  if (std::none_of(of_link.begin(), of_link.end(), [](const auto& t) { return t && t->is_rotated; }))
    return tilts;
  const auto vertical = std::uint32_t(maps.size());  // of most maps: the datum
  std::vector<measured_difference> about_x, about_y;
  const auto add = [&](std::uint32_t source, std::uint32_t target, const vec2& turn, double variance) {
    about_x.push_back({source, target, turn.x, variance});
    about_y.push_back({source, target, turn.y, variance});
  };
  for (std::size_t i = 0; i < links.size(); ++i)
    if (of_link[i]) add(links[i].source, links[i].target, of_link[i]->turn, of_link[i]->variance);
  for (std::uint32_t m = 0; m < vertical; ++m)
    add(m, vertical, {0, 0}, compensator_sigma * compensator_sigma);
  const unknown_poses unknowns(maps.size() + 1, [&](std::size_t m) { return m == vertical; });
  std::vector<double> x(maps.size() + 1, 0), y(maps.size() + 1, 0);
  if (adjust_differences(about_x, unknowns, x).empty() || adjust_differences(about_y, unknowns, y).empty())
    return tilts;
  for (std::size_t i = 0; i < links.size(); ++i)
    if (of_link[i] && of_link[i]->is_rotated)
      for (const std::uint32_t m : {links[i].source, links[i].target})
        if (const vec2 tilt = {x[m], y[m]}; tilt.norm() > min_tilt) tilts[m] = tilt;
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
