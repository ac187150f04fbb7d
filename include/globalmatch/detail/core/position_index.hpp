// Which stems are near a horizontal place, for maps of any size and shape.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "globalmatch/detail/core/neighbor.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/detail/core/wrapped_grid.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::detail {

/// Share of the stems that `middle_extent` looks at.
inline constexpr double middle_share = 0.8;

/// Extent [m] of the middle 80 % of the stems along an axis, 0 (x) or 1 (y): outliers do not count. 0 without
/// stems.
inline double middle_extent(const position_set& stems, int axis) {
  if (stems.size() == 0) return 0;
  std::vector<double> values;
  values.reserve(stems.size());
  for (const vec3& p : stems.at) values.push_back(p[axis]);
  const std::size_t tenth = values.size() / 10;
  const double lowest = nth_smallest(values, tenth);
  return nth_smallest(values, values.size() - 1 - tenth) - lowest;
}

/// Immutable index over the horizontal positions of a map. Built in O(n), for plots of any shape; queries
/// look at all stems of a pile within centimetres, and poll for cancelling there.
class position_index {
 public:
  position_index() = default;

  /// Throws `operation_cancelled` when the progress callback of `exec` says so.
  explicit position_index(const position_set& stems, const execution& exec = {}) {
    constexpr double max_occupancy = 8, min_area = 0.1;  // [m]
    // Where stems stand in corridors, or on plots far apart, the map's extent says nothing of their spacing.
    for (spacing_ = typical_spacing(stems);; spacing_ = std::max(min_area, spacing_ / 2)) {
      report_progress(exec, "position index", 0.5);
      grid_ = grid(stems.size(), spacing_, [&](std::size_t i) {
        return grid::item{{stems.at[i].x, stems.at[i].y}, static_cast<stem_index>(i)};
      });
      if (spacing_ <= min_area || grid_.mean_occupancy() < max_occupancy) break;
    }
    report_progress(exec, "position index", 1);
    at_.reserve(stems.size());
    for (const vec3& p : stems.at) at_.push_back(p.xy());
  }

  std::size_t size() const { return at_.size(); }
  /// [m] horizontal
  const vec2& at(stem_index i) const { return at_[i]; }
  /// Distance [m] of stems on a square grid of equal density.
  double spacing() const { return spacing_; }

  /// Calls `visit(stem, squared_distance)` for the stems nearer to (x, y) than `radius`.
  template <class Visit>
  void for_each_within(double x, double y, double radius, const Visit& visit) const {
    visit_within(x, y, radius, std::addressof(visit), [](const void* erased, stem_index i, double squared) {
      (*static_cast<const Visit*>(erased))(i, squared);
      return false;
    });
  }

  /// Whether a stem is nearer to (x, y) than `radius`.
  bool any_within(double x, double y, double radius) const {
    return visit_within(x, y, radius, nullptr, [](const void*, stem_index, double) { return true; });
  }

  /// The `k` stems nearest to stem `i`, but not itself, ordered by (distance, index); fewer when there are
  /// fewer. `found` is reused memory.
  void nearest(std::size_t i, std::size_t k, std::vector<neighbor<double>>& found) const {
    k = std::min(k, at_.size() - 1);
    for (double radius = 1.5 * spacing_;; radius *= 2) {
      found.clear();
      std::size_t visited = 0;
      grid_.for_each_near({at_[i].x, at_[i].y}, radius, [&](const auto& item) {
        if (++visited % between_polls == 0) poll_cancelled();
        const double squared = (at_[item.label] - at_[i]).squared_norm();
        if (item.label != i && squared < radius * radius) found.push_back({item.label, squared});
      });
      if (found.size() >= k || visited == at_.size()) break;
    }
    if (found.size() < k) all_others(i, found);  // the corners of the last box
    std::partial_sort(found.data(), found.data() + k, found.data() + found.size());
    found.resize(k);
  }

 private:
  using grid = wrapped_grid<double, 2, stem_index>;
  static constexpr std::size_t between_polls = 4096;  // stems
  using visitor = bool (*)(const void* visit, stem_index i, double squared_distance);

  /// Calls `call(visit, stem, squared_distance)` for the stems nearer than `radius`, until it returns true,
  /// and returns that. Not a template: it is called in many places.
  bool visit_within(double x, double y, double radius, const void* visit, visitor call) const {
    std::size_t visited = 0;
    return grid_.any_near({x, y}, radius, [&](const grid::item& item) {
      if (++visited % between_polls == 0) poll_cancelled();
      const double dx = item.at[0] - x, dy = item.at[1] - y, squared = dx * dx + dy * dy;
      return squared < radius * radius && call(visit, item.label, squared);
    });
  }

  static double typical_spacing(const position_set& stems) {
    constexpr double min_area = 0.1;  // [m]
    if (stems.size() < 2) return 1;
    const double area =
        std::max(min_area, middle_extent(stems, 0)) * std::max(min_area, middle_extent(stems, 1));
    return std::max(min_area, std::sqrt(area / (middle_share * middle_share * double(stems.size()))));
  }

  void all_others(std::size_t i, std::vector<neighbor<double>>& found) const {
    found.clear();
    for (std::uint32_t j = 0; j < at_.size(); ++j)
      if (j != i) found.push_back({j, (at_[j] - at_[i]).squared_norm()});
  }

  double spacing_ = 1;
  std::vector<vec2> at_;
  grid grid_;
};

}  // namespace globalmatch::detail
