// Triplets of stems of two maps that are alike: what the tree-oriented baselines search.
#pragma once

#include <globalmatch/detail/core/wrapped_grid.hpp>
#include <globalmatch/triangles.hpp>

#include "baselines/stem_alignment.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace globalmatch::benchmarks {

using namespace detail;

/// Which triplets are alike.
struct likeness {
  double edge_threshold;                 ///< [m] that no two corresponding edges differ by
  double max_relative_difference = 0.3;  ///< of corresponding radii; 2.5 sigma of 1 cm at 12 cm
  double min_width = 0;                  ///< [m] narrower triplets are left out
};

/// Whether two radii may be those of one stem; 0 stands for unknown.
inline bool alike_radii(double a, double b, double max_relative_difference) {
  return a == 0 || b == 0 || std::abs(a - b) <= max_relative_difference * std::max(a, b);
}

/// Of `size` stems all triplets.
inline std::size_t triplet_count(std::size_t size) {
  return size < 3 ? 0 : size * (size - 1) / 2 * (size - 2) / 3;
}

/// All triplets of the target stems, to be found by their edges. Memory: `memory_of` the target stems.
class like_triplets {
 public:
  like_triplets(const stem_alignment& maps, const likeness& alike)
      : maps_(maps),
        alike_(alike),
        by_edges_(
            triplet_count(maps.target.size()), float(cell), 1,
            [&](std::size_t, std::size_t, const auto& visit) {
              for_each_triplet(maps.target, [&](const triangle& t) { visit({edge_point(t), t.vertices}); });
            },
            [](std::size_t, const auto& work) { work(0); }) {}

  /// [bytes]
  static double memory_of(std::size_t target_stems) {
    return double(triplet_count(target_stems)) * (sizeof(triangle_grid::item) + 2 * sizeof(std::uint32_t));
  }

  std::size_t target_triplets() const { return by_edges_.size(); }

  /// Calls `visit(correspondences, sum of differences of edges [m])` for every two triplets that are alike.
  /// Returns the number of source triplets.
  template <class Visit>
  std::size_t for_each(const Visit& visit) const {
    std::size_t triplets = 0;
    for_each_triplet(maps_.source, [&](const triangle& triplet) {
      ++triplets;
      for (const triangle& t : admissible_orders(triplet, alike_.edge_threshold))
        by_edges_.for_each_near(edge_point(t), float(alike_.edge_threshold),
                                [&](const triangle_grid::item& like) {
                                  const auto& v = like.label;
                                  const std::array<correspondence, 3> pairs = {
                                      {{t.vertices[0], v[0]}, {t.vertices[1], v[1]}, {t.vertices[2], v[2]}}};
                                  if (have_like_radii(pairs))
                                    visit(pairs, difference(edge_point(t), like.at));
                                });
    });
    return triplets;
  }

 private:
  static constexpr double cell = 0.1;  // [m]

  template <class Visit>
  void for_each_triplet(const position_set& stems, const Visit& visit) const {
    std::size_t visited = 0;
    for (stem_index i = 0; i < stems.size(); ++i)
      for (stem_index j = i + 1; j < stems.size(); ++j)
        for (stem_index k = j + 1; k < stems.size(); ++k) {
          matching_context::poll_cancelled_at(visited++);
          const triangle t = make_triangle(stems, {i, j, k}, true);
          if (t.horizontal_width >= alike_.min_width) visit(t);
        }
  }

  bool have_like_radii(const std::array<correspondence, 3>& pairs) const {
    const auto &of_source = maps_.source.radius, &of_target = maps_.target.radius;
    if (of_source.empty() || of_target.empty()) return true;
    return std::all_of(pairs.begin(), pairs.end(), [&](const correspondence& c) {
      return alike_radii(of_source[c.source], of_target[c.target], alike_.max_relative_difference);
    });
  }

  static double difference(const triangle_grid::point& a, const triangle_grid::point& b) {
    return std::abs(a[0] - b[0]) + std::abs(a[1] - b[1]) + std::abs(a[2] - b[2]);
  }

  const stem_alignment& maps_;
  likeness alike_;
  triangle_grid by_edges_;
};

/// A matcher that takes the transform which `search(alignment, funnel)` finds among like triplets, refined.
template <class Search>
match_run run_by_triplets(const two_maps& maps, const run_limits& limits, double inlier_threshold,
                          const Search& search) {
  return run_within(limits, like_triplets::memory_of(maps.target.size()), [&](const execution&) {
    const stem_alignment alignment(maps, inlier_threshold);
    match_run run{.funnel = alignment.funnel()};
    run.target_from_source = alignment.refined(search(alignment, run.funnel));
    return run;
  });
}

}  // namespace globalmatch::benchmarks
