// What of a survey depends on the poses of its scans follows them: trees, residuals of links.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/keyed_sort.hpp"
#include "globalmatch/detail/survey/pose_uncertainty.hpp"
#include "globalmatch/survey_options.hpp"

namespace globalmatch::detail {

/// Trees follow the scans that saw them. `before`: the survey as it was.
inline void follow_scans(std::vector<survey::tree>& trees, const survey& before, const survey& s,
                         std::span<const Eigen::Isometry3d> changes) {
  for (survey::tree& t : trees) {
    Eigen::Vector3d shift = Eigen::Vector3d::Zero();
    double raise = 0, known = 0, horizontal = 0, height = 0;
    Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
    for (const survey::observation& o : t.seen) {
      const transform_uncertainty &u_before = *before.scans[o.scan].uncertainty,
                                  &u = *s.scans[o.scan].uncertainty;
      up = u.up;
      const Eigen::Vector3d moved = changes[o.scan] * t.position - t.position;
      const place_variance old_variance(u_before, t.position), new_variance(u, t.position);
      shift += (moved - moved.dot(up) * up) / double(t.seen.size());
      horizontal += (new_variance.horizontal - old_variance.horizontal) / double(t.seen.size());
      if (!before.scans[o.scan].is_height_known || !s.scans[o.scan].is_height_known) continue;
      raise += moved.dot(up);
      height += new_variance.height - old_variance.height;
      ++known;
    }
    if (known > 0) shift += raise / known * up;
    t.position += shift;
    t.sigma = std::sqrt(std::max(0.0, t.sigma * t.sigma + horizontal));
    if (known > 0)
      t.height_sigma = std::sqrt(std::max(0.0, t.height_sigma * t.height_sigma + height / known));
  }
}

/// How far a link places what is at a place of the source in plan from where the poses have it, `place` [m].
inline Eigen::Vector3d link_offset(const survey& s, const survey::link& l, const Eigen::Vector3d& in_source,
                                   const Eigen::Vector3d& place) {
  const Eigen::Vector3d up = s.scans[l.target].uncertainty->up,
                        off = s.scans[l.target].survey_from_scan * (l.target_from_source * in_source) - place;
  return off - off.dot(up) * up;
}

/// The residual of a link by targets, at the centroid of those that both scans show.
inline void update_residual_of_targets(const survey& s, survey::link& link) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double count = 0;
  for (const survey::target& t : s.targets) {
    const auto of = [&](std::size_t scan) {
      return std::find_if(t.seen.begin(), t.seen.end(), [&](const auto& o) { return o.scan == scan; });
    };
    if (of(link.source) == t.seen.end() || of(link.target) == t.seen.end()) continue;
    const Eigen::Vector3d& in_source = of(link.source)->position;
    sum += link_offset(s, link, in_source, s.scans[link.source].survey_from_scan * in_source);
    ++count;
  }
  if (count > 0) link.residual = sum.norm() / count;
}

/// Residuals of links from the poses, at the trees that both scans see, or at targets; where they see none it
/// stays.
inline void update_residuals(survey& s) {
  std::vector<std::pair<std::uint64_t, std::size_t>> link_of;
  const auto key = [](std::size_t a, std::size_t b) {
    return key_of(std::uint32_t(std::min(a, b)), std::uint32_t(std::max(a, b)));
  };
  for (std::size_t l = 0; l < s.links.size(); ++l)
    if (s.links[l].targets == 0) link_of.emplace_back(key(s.links[l].source, s.links[l].target), l);
  std::sort(link_of.begin(), link_of.end());
  std::vector<double> squares(s.links.size(), 0), count(s.links.size(), 0);
  for (const survey::tree& t : s.trees)
    for (std::size_t i = 0; i < t.seen.size(); ++i)
      for (std::size_t k = 0; k < i; ++k) {
        const auto found = std::lower_bound(link_of.begin(), link_of.end(),
                                            std::pair(key(t.seen[i].scan, t.seen[k].scan), std::size_t(0)));
        if (found == link_of.end() || found->first != key(t.seen[i].scan, t.seen[k].scan)) continue;
        const survey::link& l = s.links[found->second];
        const Eigen::Vector3d in_source = s.scans[l.source].survey_from_scan.inverse() * t.position;
        squares[found->second] += link_offset(s, l, in_source, t.position).squaredNorm();
        ++count[found->second];
      }
  for (std::size_t l = 0; l < s.links.size(); ++l)
    if (count[l] > 0) s.links[l].residual = std::sqrt(squares[l] / count[l]);
  for (survey::link& l : s.links)
    if (l.targets > 0 && l.used) update_residual_of_targets(s, l);
}

}  // namespace globalmatch::detail
