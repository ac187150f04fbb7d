// Lattice: the shifts at which a stand planted in rows repeats itself, and what does not repeat. In: a stem
// map in rows. Out: its lattice, and the gaps in it, which tell one of its places from another.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <vector>

#include "globalmatch/detail/core/matrices.hpp"
#include "globalmatch/detail/core/neighbor.hpp"
#include "globalmatch/detail/core/position_index.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::detail {

/// The two shortest shifts [m] at which stems repeat; see `planting_lattice`.
struct lattice_shifts {
  vec2 first, second;

  /// [rad] of the rows, 0 to pi counter-clockwise from x
  double direction() const { return std::atan2(first.y, first.x); }
  /// [rad] between both shifts
  double angle() const { return std::atan2(first.x * second.y - first.y * second.x, first.dot(second)); }
  /// [m] stems this near a place of the lattice belong to it: nearer to it than to any other, with a margin
  double search_radius() const { return 0.3 * std::min(first.norm(), (second - first).norm()); }
  /// Both shifts as columns.
  mat2 basis() const { return {{first, second}}; }
  /// Turns [rad] that map it to itself: 0 and pi, and those of squares or of equilateral triangles.
  std::vector<double> turns() const {
    std::vector<double> found;
    for (const int twelfths : {0, 4, 6, 8, 12, 16, 18, 20}) {
      const double turn = twelfths * std::numbers::pi / 12;
      const mat2 rotation = rotation_in_2d(turn);
      if (is_lattice_shift(rotation * first) && is_lattice_shift(rotation * second)) found.push_back(turn);
    }
    return found;
  }
  /// Whether a shift [m] maps the lattice to itself.
  bool is_lattice_shift(const vec2& shift) const {
    const vec2 steps = basis().inverse() * shift;
    return (basis() * vec2{std::round(steps.x), std::round(steps.y)} - shift).norm() < search_radius();
  }
};

/// Shifts [m] from some stems to those around, as positions in plan.
inline position_set shifts_to_neighbors(const position_index& stems) {
  constexpr std::size_t neighbors = 12, max_visited = 24;
  const std::size_t step = (stems.size() + max_visited - 1) / max_visited;
  position_set shifts;
  std::vector<neighbor<double>> nearest;
  for (std::size_t i = 0; i < stems.size(); i += step) {
    stems.nearest(i, neighbors, nearest);
    for (const auto& n : nearest) {
      const vec2 d = stems.at(n.index) - stems.at(static_cast<stem_index>(i));
      for (const double sign : {1.0, -1.0}) shifts.at.push_back({sign * d.x, sign * d.y, 0});
    }
  }
  return shifts;
}

/// Shifts and how many are near each.
class repeated_shifts {
 public:
  repeated_shifts(const position_index& stems, double search_radius)
      : shifts_(shifts_to_neighbors(stems)), search_radius_(search_radius) {
    for (stem_index i = 0; i < shifts_.size(); ++i) counts_.push_back(count_near(shifts_.at(i)));
    for (const std::size_t count : counts_) max_ = std::max(max_, count);
  }

  /// The shortest of those that at least half as many are near as are near any, farther than `search_radius`
  /// off the line along `aside_of`, or 0; as the mean of those near it.
  std::optional<vec2> shortest(const vec2& aside_of = vec2{}) const {
    std::optional<vec2> found;
    for (stem_index i = 0; i < shifts_.size(); ++i) {
      const vec2& s = shifts_.at(i);
      const double off = std::abs(s.x * aside_of.y - s.y * aside_of.x);
      if (2 * counts_[i] < max_ || off < min_sine * s.norm() * aside_of.norm()) continue;
      if (!found || s.squared_norm() < found->squared_norm()) found = s;
    }
    for (int iteration = 0; found && iteration < 10; ++iteration) found = mean_near(*found);
    return found;
  }

 private:
  static constexpr double min_sine = 0.4;  // of the angle between the shifts of a lattice: some 24 degrees

  std::size_t count_near(const vec2& shift) const {
    std::size_t count = 0;
    shifts_.for_each_within(shift.x, shift.y, search_radius_, [&](stem_index, double) { ++count; });
    return count;
  }

  vec2 mean_near(const vec2& shift) const {
    vec2 sum = vec2{};
    shifts_.for_each_within(shift.x, shift.y, search_radius_,
                            [&](stem_index i, double) { sum += shifts_.at(i); });
    return sum / double(std::max<std::size_t>(1, count_near(shift)));
  }

  position_index shifts_;
  double search_radius_;             // [m]
  std::vector<std::size_t> counts_;  // of shifts near each
  std::size_t max_ = 0;
};

/// The lattice of a stand that is known to stand in rows. Nothing where there is none: shifts from stem to
/// stem then repeat in one direction at most. Cost: looks at some of the stems.
inline std::optional<lattice_shifts> find_lattice(const position_index& stems) {
  constexpr double search_radius = 0.15;  // of the spacing of the stems
  constexpr double min_ratio = 0.5;       // of the second shift to the first, which is the shortest
  if (stems.size() < 4) return std::nullopt;
  const double near = search_radius * stems.spacing();
  const repeated_shifts shifts(stems, near);
  const auto first = shifts.shortest();
  if (!first || first->norm() <= near) return std::nullopt;
  const auto second = shifts.shortest(*first);
  // Where some stems stand closer than `near` the mean of shifts to both sides is none.
  if (!second || second->norm() <= std::max(near, min_ratio * first->norm())) return std::nullopt;
  lattice_shifts found{*first, *second};
  if (found.first.y < 0 || (found.first.y == 0 && found.first.x < 0)) found.first = -found.first;
  if (found.angle() < 0) found.second = -found.second;
  if (found.angle() <= 0 || found.search_radius() <= 0) return std::nullopt;
  return found;
}

/// Places [m] in plan, between two stems of the lattice, where one is missing. At least three of the four
/// sides are taken, so that a row that was felled, or the border, leaves none. Cost: linear in the stems.
inline std::vector<vec2> find_gaps(const position_index& stems, const lattice_shifts& lattice) {
  const double search_radius = lattice.search_radius();
  const auto is_taken = [&](const vec2& p) { return stems.any_within(p.x, p.y, search_radius); };
  position_set candidates;
  for (stem_index i = 0; i < stems.size(); ++i)
    for (const vec2& shift : {lattice.first, lattice.second}) {
      const vec2 place = stems.at(i) + shift;
      if (is_taken(place) || !is_taken(place + shift)) continue;
      const auto sides = {lattice.first, -lattice.first, lattice.second, -lattice.second};
      if (std::count_if(sides.begin(), sides.end(), [&](const vec2& s) { return is_taken(place + s); }) >= 3)
        candidates.at.push_back({place.x, place.y, 0});
    }
  // Each gap is found from two stems or more.
  const position_index found(candidates);
  std::vector<vec2> gaps;
  for (stem_index i = 0; i < found.size(); ++i) {
    bool first = true;
    const vec2& p = found.at(i);
    found.for_each_within(p.x, p.y, search_radius, [&](stem_index j, double) { first = first && i <= j; });
    if (first) gaps.push_back(p);
  }
  return gaps;
}

}  // namespace globalmatch::detail
