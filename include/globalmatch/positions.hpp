// Stem positions behind the border: finite, in a levelled local frame, in an order of their own.
#pragma once

#include <algorithm>
#include <cmath>
#include <compare>
#include <cstddef>
#include <iterator>
#include <ranges>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/local_frame.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/points.hpp"

namespace globalmatch {

/// Positions of stems, sorted by (x, y, z) of the caller's frame, so that results do not depend on the
/// caller's order.
struct position_set {
  detail::local_frame frame;         ///< its origin is the first position
  std::vector<detail::vec3> at;   ///< [m] levelled local frame
  std::vector<stem_index> original;  ///< index of each in the caller's range
  std::vector<double> sigma;         ///< [m] standard deviation of each; empty when none is known
  std::vector<double> radius;        ///< [m] of each stem, 0 where unknown; empty when none is known
  bool has_heights = true;           ///< false: positions in plan, all heights are 0

  std::size_t size() const { return at.size(); }
};

namespace detail {

/// Where some standard deviations are 0, which stands for unknown, they become the median of the others;
/// where all are, none is known.
inline void replace_unknown(std::vector<double>& sigma) {
  std::vector<double> known;
  std::copy_if(sigma.begin(), sigma.end(), std::back_inserter(known), [](double s) { return s > 0; });
  if (known.empty()) {
    sigma.clear();
    return;
  }
  std::replace(sigma.begin(), sigma.end(), 0.0, detail::median(known));
}

}  // namespace detail

/// Reads the caller's positions, and how uncertain and how thick they are where their type says so
/// (`point_traits`). `name` ("source", "target") is for messages. A radius that is not positive and finite is
/// unknown. Throws `std::invalid_argument` when a coordinate is not finite or beyond 1e12 m, or a standard
/// deviation negative or not finite, and `operation_cancelled`.
template <position_range R>
position_set import_positions(const R& positions, const Eigen::Vector3d& up, std::string_view name,
                              const execution& exec = {}) {
  constexpr std::size_t poll_interval = 65536;
  constexpr double max_magnitude = 1e12;  // [m]
  position_set set;
  set.has_heights = point_range<R>;
  const detail::mat3 levelling = detail::levelling_rotation(detail::from_eigen(up));
  if (set.has_heights) set.frame.rotation = levelling;  // positions in plan are level already
  struct entry {
    double x, y, z, sigma, radius;
    stem_index original;
    auto operator<=>(const entry&) const = default;
  };
  constexpr bool has_sigma = has_position_sigma<std::ranges::range_value_t<R>>;
  constexpr bool has_radii = has_radius<std::ranges::range_value_t<R>>;
  std::vector<entry> given;
  for (const auto& position : positions) {
    if (given.size() % poll_interval == 0) detail::report_progress(exec, "positions", 0);
    const auto p = detail::vec3::from(xyz(position));
    if (!is_finite(p))
      throw std::invalid_argument(std::string(name) + ": position " + std::to_string(given.size()) +
                                  " is not finite; remove it");
    if (p.max_abs() > max_magnitude)
      throw std::invalid_argument(std::string(name) + ": position " + std::to_string(given.size()) +
                                  " is more than 1e12 m from 0, where millimetres are lost; remove it");
    double sigma = 0;
    if constexpr (has_sigma) {
      sigma = double(point_traits<std::ranges::range_value_t<R>>::position_sigma(position));
      if (!(sigma >= 0 && std::isfinite(sigma)))
        throw std::invalid_argument(std::string(name) + ": position_sigma " + std::to_string(given.size()) +
                                    " is negative or not finite; 0 stands for unknown");
    }
    double radius = 0;
    if constexpr (has_radii) {
      radius = detail::radius_of(position);
      if (!(radius > 0 && std::isfinite(radius))) radius = 0;
    }
    given.push_back({p.x, p.y, p.z, sigma, radius, static_cast<stem_index>(given.size())});
  }
  std::sort(given.begin(), given.end(), [](const entry& a, const entry& b) { return (a <=> b) < 0; });
  if (given.size() > poll_interval) detail::report_progress(exec, "positions", 0.5);
  set.at.reserve(given.size());
  set.original.reserve(given.size());
  if (!given.empty()) set.frame.origin = {given.front().x, given.front().y, given.front().z};
  for (const entry& e : given) {
    set.at.push_back(set.frame.to_local({e.x, e.y, e.z}));
    set.original.push_back(e.original);
    if constexpr (has_sigma) set.sigma.push_back(e.sigma);
    if constexpr (has_radii) set.radius.push_back(e.radius);
  }
  detail::replace_unknown(set.sigma);
  if (std::all_of(set.radius.begin(), set.radius.end(), [](double r) { return r == 0; })) set.radius.clear();
  return set;
}

/// Distance [m] of two positions, in plan where heights do not count.
inline double stem_distance(const detail::vec3& a, const detail::vec3& b, bool horizontal) {
  return horizontal ? (a - b).xy().norm() : (a - b).norm();
}

}  // namespace globalmatch
