// Rows on rows: the motion that lays the lattice of one stand on that of another, wherever on it. In: two
// maps of stands in rows. Out: a motion that is right but for shifts and turns of the lattice onto itself.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cstddef>
#include <optional>
#include <span>

#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/detail/matching/planting_lattice.hpp"
#include "globalmatch/matching.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::detail {

/// A stem in the middle of a map.
inline const Eigen::Vector3d& central_stem(const position_set& stems) {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : stems.at) center += p / double(stems.size());
  const auto off = [&](const Eigen::Vector3d& p) { return (p - center).head<2>().squaredNorm(); };
  return *std::min_element(stems.at.begin(), stems.at.end(),
                           [&](const auto& a, const auto& b) { return off(a) < off(b); });
}

/// The source's own lattice laid on that of the target, middle on middle; nothing where it has none, or
/// another one.
inline std::optional<Eigen::Isometry3d> align_centers(const matching_context& context,
                                                      const planting_lattice& lattice) {
  const auto own = find_lattice(*context.source_index);
  if (!own) return std::nullopt;
  const Eigen::Rotation2Dd turn(lattice.direction() - own->direction());
  if (!lattice.is_lattice_shift(turn * own->first) || !lattice.is_lattice_shift(turn * own->second))
    return std::nullopt;
  return Eigen::Translation3d(central_stem(context.target)) *
         Eigen::AngleAxisd(turn.angle(), Eigen::Vector3d::UnitZ()) *
         Eigen::Translation3d(-central_stem(context.source));
}

/// Of the motions of hypotheses, and of the one that lays the source's own lattice on that of the target,
/// `lattice`, the one that lays most stems near others. At least one hypothesis is needed. Cost: linear in
/// the stems, for each.
inline Eigen::Isometry3d align_lattices(const matching_context& context, const planting_lattice& lattice,
                                        std::span<const hypothesis> hypotheses) {
  const auto count_inliers = [&](const Eigen::Isometry3d& transform) {
    return std::count_if(context.source.at.begin(), context.source.at.end(), [&](const Eigen::Vector3d& p) {
      const Eigen::Vector3d transformed = transform * p;
      return context.target_index->any_within(transformed.x(), transformed.y(), lattice.search_radius());
    });
  };
  Eigen::Isometry3d best = hypotheses.front().target_from_source;
  auto maximum = count_inliers(best);
  const auto consider = [&](const Eigen::Isometry3d& transform) {
    const auto near = count_inliers(transform);
    if (near <= maximum) return;
    maximum = near;
    best = transform;
  };
  for (const hypothesis& h : hypotheses.subspan(1)) consider(h.target_from_source);
  if (const auto transform = align_centers(context, lattice)) consider(*transform);
  return best;
}

}  // namespace globalmatch::detail
