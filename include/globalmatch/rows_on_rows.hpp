// Rows on rows: the motion that lays the lattice of one stand on that of another, wherever on it. In: two
// maps of stands in rows. Out: a motion that is right but for shifts and turns of the lattice onto itself.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cstddef>
#include <optional>
#include <span>

#include "globalmatch/hypothesis.hpp"
#include "globalmatch/lattice.hpp"
#include "globalmatch/plan_index.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/position_set.hpp"

namespace globalmatch {

namespace detail {

/// A stem in the middle of a map.
inline const Eigen::Vector3d& stem_in_the_middle(const position_set& stems) {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : stems.at) center += p / double(stems.size());
  const auto off = [&](const Eigen::Vector3d& p) { return (p - center).head<2>().squaredNorm(); };
  return *std::min_element(stems.at.begin(), stems.at.end(),
                           [&](const auto& a, const auto& b) { return off(a) < off(b); });
}

/// The source's own lattice laid on that of the target, middle on middle; nothing where it has none, or
/// another one.
inline std::optional<Eigen::Isometry3d> middle_on_middle(const map_pair& maps, const lattice& rows) {
  const auto own = find_lattice(*maps.source_plan);
  if (!own) return std::nullopt;
  const Eigen::Rotation2Dd turn(rows.direction() - own->direction());
  if (!rows.is_on_it(turn * own->first) || !rows.is_on_it(turn * own->second)) return std::nullopt;
  return Eigen::Translation3d(stem_in_the_middle(maps.target)) *
         Eigen::AngleAxisd(turn.angle(), Eigen::Vector3d::UnitZ()) *
         Eigen::Translation3d(-stem_in_the_middle(maps.source));
}

}  // namespace detail

/// Of the motions of hypotheses, and of the one that lays the source's own lattice on that of the target,
/// `rows`, the one that lays most stems near others. At least one hypothesis is needed. Cost: linear in the
/// stems, for each.
inline Eigen::Isometry3d lay_rows_on_rows(const map_pair& maps, const lattice& rows,
                                          std::span<const hypothesis> hypotheses) {
  const auto laid_near = [&](const Eigen::Isometry3d& motion) {
    return std::count_if(maps.source.at.begin(), maps.source.at.end(), [&](const Eigen::Vector3d& p) {
      const Eigen::Vector3d laid = motion * p;
      return maps.target_plan->any_within(laid.x(), laid.y(), rows.reach());
    });
  };
  Eigen::Isometry3d best = hypotheses.front().target_from_source;
  auto most = laid_near(best);
  const auto consider = [&](const Eigen::Isometry3d& motion) {
    const auto near = laid_near(motion);
    if (near <= most) return;
    most = near;
    best = motion;
  };
  for (const hypothesis& h : hypotheses.subspan(1)) consider(h.target_from_source);
  if (const auto motion = detail::middle_on_middle(maps, rows)) consider(*motion);
  return best;
}

}  // namespace globalmatch
