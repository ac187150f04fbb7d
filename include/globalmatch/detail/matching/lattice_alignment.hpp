// Lattice alignment: the transform that aligns the lattices of two plantations, wherever on each other. In:
// two maps of regular plantations. Out: a transform that is right but for shifts and turns of the lattice
// onto itself.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "globalmatch/detail/core/rigid.hpp"
#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/detail/matching/matching_context.hpp"
#include "globalmatch/detail/matching/planting_lattice.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::detail {

/// A stem in the middle of a map.
inline const vec3& central_stem(const position_set& stems) {
  vec3 center;
  for (const vec3& p : stems.at) center += p / double(stems.size());
  const vec3* best = &stems.at.front();
  for (const vec3& p : stems.at)
    if ((p - center).xy().squared_norm() < (*best - center).xy().squared_norm()) best = &p;
  return *best;
}

/// The transform of the source's own lattice onto that of the target, middle onto middle; nothing where it
/// has none, or another one.
inline std::optional<rigid> align_centers(const matching_context& context,
                                          const std::optional<lattice_shifts>& own,
                                          const lattice_shifts& lattice) {
  if (!own) return std::nullopt;
  const double angle = lattice.direction() - own->direction();
  const mat2 turn = rotation_in_2d(angle);
  if (!lattice.is_lattice_shift(turn * own->first) || !lattice.is_lattice_shift(turn * own->second))
    return std::nullopt;
  const rigid turned{rotation_about_z(angle), vec3{} + central_stem(context.target)};
  return shifted_before(turned, -central_stem(context.source));
}

/// Source stems that a transform places near target stems. Cost: linear in the stems.
inline std::size_t count_on_lattice(const matching_context& context, const lattice_shifts& lattice,
                                    const rigid& target_from_source) {
  const double search_radius = lattice.search_radius();
  std::size_t count = 0;
  for (stem_index s = 0; s < context.source.size(); ++s) {
    matching_context::poll_cancelled_at(s);
    const vec3 transformed = target_from_source * context.source.at[s];
    count += context.target_index->any_within(transformed.x, transformed.y, search_radius);
  }
  return count;
}

/// Of the transforms of hypotheses, and of the one that aligns the source's own lattice with that of the
/// target, the one that places most stems near others. At least one hypothesis is needed. Cost:
/// linear in the stems, for each.
inline rigid align_lattices(const matching_context& context, const std::optional<lattice_shifts>& own,
                            const lattice_shifts& lattice, std::span<const local_hypothesis> hypotheses) {
  const rigid* best = nullptr;
  std::size_t maximum = 0;
  const auto consider = [&](const rigid& transform) {
    const std::size_t count = count_on_lattice(context, lattice, transform);
    if (best && count <= maximum) return;
    maximum = count;
    best = &transform;
  };
  for (const local_hypothesis& h : hypotheses) consider(h.target_from_source);
  const auto centers = align_centers(context, own, lattice);
  if (centers) consider(*centers);
  return *best;
}

}  // namespace globalmatch::detail
