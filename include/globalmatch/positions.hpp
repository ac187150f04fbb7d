// Stem positions in the internal representation: finite, in a levelled local frame, in an order of their own.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <ranges>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/coordinate_steps.hpp"
#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/local_frame.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/points.hpp"

namespace globalmatch {

/// Positions of stems, sorted by (x, y, z) of the caller's frame, so that results do not depend on the
/// caller's order.
struct position_set {
  detail::local_frame frame;         ///< its origin is the first position
  std::vector<detail::vec3> at;      ///< [m] levelled local frame
  std::vector<stem_index> original;  ///< index of each in the caller's range
  std::vector<double> sigma;         ///< [m] standard deviation of each; empty when none is known
  std::vector<double> radius;        ///< [m] of each stem, 0 where unknown; empty when none is known
  std::vector<double> height_sigma;  ///< [m] of each height; empty when none is known
  std::vector<detail::vec3> axis;  ///< unit, levelled local frame, 0 where unknown; empty when none is known
  bool has_heights = true;         ///< false: heights are not known: all are equal, or none are given
  double cell_area = 0;            ///< [m^2] of a cell, where positions are in steps; see `cell_area`
  std::size_t coincident = 0;      ///< positions left out, as they are at the place of another one

  std::size_t size() const { return at.size(); }
};

namespace detail {

/// A position as the caller gave it.
struct given_position {
  double numbers[5];  // x, y, z, sigma, radius
  stem_index original;

  bool operator<(const given_position& other) const {
    for (int i = 0; i < 5; ++i)
      if (numbers[i] != other.numbers[i]) return numbers[i] < other.numbers[i];
    return original < other.original;
  }
};

/// What further is known of each, in the caller's order; empty where the type does not say.
struct given_heights {
  std::vector<double> sigma;
  std::vector<vec3> axis;
};

/// Adds a position, after looking at its numbers. `name` is for messages.
inline void add_given(const vec3& p, double sigma, double radius, std::string_view name,
                      std::vector<given_position>& given) {
  constexpr double max_magnitude = 1e12;  // [m]
  const char* wrong = nullptr;
  const char* what = ": position ";
  if (!is_finite(p))
    wrong = " is not finite; remove it";
  else if (p.max_abs() > max_magnitude)
    wrong = " is more than 1e12 m from 0, where millimetres are lost; remove it";
  else if (!(sigma >= 0 && std::isfinite(sigma)))
    wrong = " is negative or not finite; 0 stands for unknown", what = ": position_sigma ";
  if (wrong) throw std::invalid_argument(std::string(name) + what + std::to_string(given.size()) + wrong);
  if (!(radius > 0 && std::isfinite(radius))) radius = 0;
  given.push_back({{p.x, p.y, p.z, sigma, radius}, static_cast<stem_index>(given.size())});
}

template <has_radius P>
double given_radius(const P& position) {
  return radius_of(position);
}

/// A standard deviation, or 0 where it is not known.
inline double known_sigma(double sigma) {
  return sigma > 0 && std::isfinite(sigma) ? sigma : 0;
}

/// A unit vector, or zero where it is not known.
inline vec3 known_axis(const vec3& axis) {
  return is_finite(axis) && axis.norm() > 0 ? axis.normalized() : vec3{};
}

/// Where some standard deviations are 0, which stands for unknown, they become the median of the others;
/// where all are, none is known.
inline void replace_unknown(std::vector<double>& sigma) {
  std::vector<double> known;
  for (const double s : sigma)
    if (s > 0) known.push_back(s);
  if (known.empty()) return sigma.clear();
  const double usual = median(known);
  for (double& s : sigma)
    if (s == 0) s = usual;
}

/// Takes over what is known of heights and axes, once the positions are in their order.
inline void fill_heights(position_set& set, const given_heights& given) {
  for (const stem_index original : set.original) {
    if (!given.sigma.empty()) set.height_sigma.push_back(given.sigma[original]);
    if (!given.axis.empty()) set.axis.push_back(set.frame.rotation * given.axis[original]);
  }
  replace_unknown(set.height_sigma);
}

/// Whether heights are measured ones: most lie further apart than rounding. A column of equal heights was
/// filled in for want of others.
inline bool heights_differ(const std::vector<vec3>& at) {
  constexpr double min_range = 1e-3;  // [m] of nine in ten
  if (at.size() < 2) return true;
  std::vector<double> heights;
  for (const vec3& p : at) heights.push_back(p.z);
  sort_numbers(heights);
  const std::size_t tenth = heights.size() / 20;
  return heights[heights.size() - 1 - tenth] - heights[tenth] > min_range;
}

/// Positions to the area of a unit of the coordinates, where the middle of them lies: outliers do not count.
/// `margin` is added to both sides, so that positions in a line have an area.
inline double density_of(std::vector<double> x, std::vector<double> y, double margin) {
  constexpr double of_middle = 0.8 * 0.8;
  const std::size_t tenth = x.size() / 10, last = x.size() - 1 - tenth;
  const auto side = [&](std::vector<double>& of) { return nth_smallest(of, last) - nth_smallest(of, tenth); };
  return of_middle * double(x.size()) / ((side(x) + margin) * (side(y) + margin));
}

/// Throws `std::invalid_argument` for points of a scan that are given as stems: the search for stems with a
/// like neighbourhood would take hours. The densest stands, of bamboo, have three stems on a square metre.
inline void require_stems(const std::vector<vec3>& at, std::string_view name) {
  constexpr std::size_t max_quick = 10000;       // positions: so many are matched in a second if dense
  constexpr double max_density = 5, margin = 1;  // [1/m^2], [m]
  if (at.size() <= max_quick) return;
  std::vector<double> x, y;
  for (const vec3& p : at) x.push_back(p.x), y.push_back(p.y);
  const double density = density_of(std::move(x), std::move(y), margin);
  if (density <= max_density) return;
  throw std::invalid_argument(std::string(name) + ": " + std::to_string(at.size()) + " positions, " +
                              std::to_string(std::llround(density)) +
                              " on a square metre, are points of a scan, not stems, or not in metres; "
                              "map_stems finds the stems of a scan, register_scans registers two scans");
}

/// Leaves out sorted positions that are at the place of one before, and returns how many: a stem that is
/// listed twice, one of several that share a root, rows without coordinates. The distance [m] follows from
/// how densely the others stand, as coordinates may be of any unit; z has no say where x and y are
/// `horizontal`.
inline std::size_t drop_coincident(std::vector<given_position>& given, bool horizontal) {
  constexpr double max_distance = 0.15, share_of_spacing = 0.07;
  constexpr std::size_t between_polls = 4096;
  if (given.size() < 2) return 0;
  std::vector<double> all_x, all_y;
  for (const given_position& g : given) all_x.push_back(g.numbers[0]), all_y.push_back(g.numbers[1]);
  const double density = density_of(std::move(all_x), std::move(all_y), 0),
               distance = std::min(max_distance, share_of_spacing / std::sqrt(density));
  std::size_t kept = 0, first = 0;  // of those that may be near
  for (std::size_t i = 0; i < given.size(); ++i) {
    if (i % between_polls == 0) poll_cancelled();
    const double x = given[i].numbers[0], y = given[i].numbers[1];
    while (first < kept && x - given[first].numbers[0] > distance) ++first;
    // Equal ones follow each other; where only these coincide no others need be looked at.
    std::size_t k = distance > 0 || kept == 0 ? first : kept - 1;
    for (; k < kept; ++k) {
      const double dx = x - given[k].numbers[0], dy = y - given[k].numbers[1],
                   dz = horizontal ? 0 : given[i].numbers[2] - given[k].numbers[2];
      if (dx * dx + dy * dy + dz * dz <= distance * distance) break;
    }
    if (k == kept)
      given[kept++] = given[i];
    else if (given[k].numbers[4] == 0)  // the radius, which the other one may know
      given[k].numbers[4] = given[i].numbers[4];
  }
  const std::size_t dropped = given.size() - kept;
  given.erase(given.begin() + std::ptrdiff_t(kept), given.end());
  return dropped;
}

/// Sorts the positions and fills the set with them.
inline void fill(position_set& set, std::vector<given_position>&& given, std::string_view name) {
  const auto place = [](const given_position& g) { return vec3{g.numbers[0], g.numbers[1], g.numbers[2]}; };
  std::sort(given.data(), given.data() + given.size());
  set.coincident = drop_coincident(given, set.frame.rotation(2, 2) == 1);
  set.at.reserve(given.size());
  set.original.reserve(given.size());
  for (const given_position& g : given) set.at.push_back(set.frame.rotation * place(g));
  require_stems(set.at, name);
  set.cell_area = cell_area(set.at);
  if (!given.empty()) set.frame.origin = place(given.front());
  bool has_radii = false;
  for (std::size_t i = 0; i < given.size(); ++i) {
    set.at[i] = set.frame.to_local(place(given[i]));
    set.original.push_back(given[i].original);
    set.sigma.push_back(given[i].numbers[3]);
    set.radius.push_back(given[i].numbers[4]);
    has_radii = has_radii || given[i].numbers[4] > 0;
  }
  replace_unknown(set.sigma);
  if (!has_radii) set.radius.clear();
  set.has_heights = set.has_heights && heights_differ(set.at);
}

}  // namespace detail

/// Reads the caller's positions, and how uncertain and how thick they are where their type says so
/// (`point_traits`). `name` ("source", "target") is for messages. A radius that is not positive and finite is
/// unknown, and so are heights that are all equal. Throws `std::invalid_argument` when a coordinate is not
/// finite or beyond 1e12 m, a standard deviation negative or not finite, or where more than 10,000 positions
/// lie as densely as points of a scan, and `operation_cancelled`.
template <position_range R>
position_set import_positions(const R& positions, const Eigen::Vector3d& up, std::string_view name,
                              const execution& exec = {}) {
  using element = std::ranges::range_value_t<R>;
  constexpr std::size_t poll_interval = 65536;
  position_set set;
  set.has_heights = point_range<R>;
  const detail::mat3 levelling = detail::levelling_rotation(detail::from_eigen(up));
  if (set.has_heights) set.frame.rotation = levelling;  // horizontal positions are level already
  std::vector<detail::given_position> given;
  detail::given_heights heights;
  for (const auto& position : positions) {
    if (given.size() % poll_interval == 0) detail::report_progress(exec, "positions", 0);
    double sigma = 0, radius = 0;
    if constexpr (has_position_sigma<element>)
      sigma = double(point_traits<element>::position_sigma(position));
    if constexpr (has_radius<element>) radius = detail::given_radius(position);
    if constexpr (detail::has_height_sigma<element>)
      heights.sigma.push_back(detail::known_sigma(point_traits<element>::height_sigma(position)));
    if constexpr (detail::has_axis<element>)
      heights.axis.push_back(detail::known_axis(detail::vec3::from(point_traits<element>::axis(position))));
    detail::add_given(detail::vec3::from(xyz(position)), sigma, radius, name, given);
  }
  if (given.size() > poll_interval) detail::report_progress(exec, "positions", 0.5);
  detail::fill(set, std::move(given), name);
  detail::fill_heights(set, heights);
  return set;
}

namespace detail {
/// Distance [m] of two positions, horizontal where heights do not count.
inline double stem_distance(const vec3& a, const vec3& b, bool horizontal) {
  return horizontal ? (a - b).xy().norm() : (a - b).norm();
}
}  // namespace detail

}  // namespace globalmatch
