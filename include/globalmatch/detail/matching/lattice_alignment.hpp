// Rows on rows: the motion that lays the lattice of one stand on that of another, wherever on it. In: two
// maps of stands in rows. Out: a motion that is right but for shifts and turns of the lattice onto itself.
#pragma once

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
inline const vec3& central_stem(const position_set& stems) {
  vec3 center = vec3{};
  for (const vec3& p : stems.at) center += p / double(stems.size());
  const auto off = [&](const vec3& p) { return (p - center).xy().squared_norm(); };
  return *std::min_element(stems.at.begin(), stems.at.end(),
                           [&](const auto& a, const auto& b) { return off(a) < off(b); });
}

/// The source's own lattice laid on that of the target, middle on middle; nothing where it has none, or
/// another one.
inline std::optional<rigid> align_centers(const matching_context& context,
                                                      const lattice_shifts& lattice) {
  const auto own = find_lattice(*context.source_index);
  if (!own) return std::nullopt;
  const double angle = lattice.direction() - own->direction();
  const mat2 turn = rotation_in_2d(angle);
  if (!lattice.is_lattice_shift(turn * own->first) || !lattice.is_lattice_shift(turn * own->second))
    return std::nullopt;
  const rigid turned{rotation_about_z(angle), vec3{} + central_stem(context.target)};
  return shifted_before(turned, -central_stem(context.source));
}

/// Of the motions of hypotheses, and of the one that lays the source's own lattice on that of the target,
/// `lattice`, the one that lays most stems near others. At least one hypothesis is needed. Cost: linear in
/// the stems, for each.
inline rigid align_lattices(const matching_context& context, const lattice_shifts& lattice,
                                        std::span<const local_hypothesis> hypotheses) {
  const auto count_inliers = [&](const rigid& transform) {
    return std::count_if(context.source.at.begin(), context.source.at.end(), [&](const vec3& p) {
      const vec3 transformed = transform * p;
      return context.target_index->any_within(transformed.x, transformed.y, lattice.search_radius());
    });
  };
  rigid best = hypotheses.front().target_from_source;
  auto maximum = count_inliers(best);
  const auto consider = [&](const rigid& transform) {
    const auto near = count_inliers(transform);
    if (near <= maximum) return;
    maximum = near;
    best = transform;
  };
  for (const local_hypothesis& h : hypotheses.subspan(1)) consider(h.target_from_source);
  if (const auto transform = align_centers(context, lattice)) consider(*transform);
  return best;
}

}  // namespace globalmatch::detail
