// Stem positions ([GM] 3.1): where a stem's axis meets the terrain. Fragments of one stem become one.
#pragma once


#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/local_points.hpp"
#include "globalmatch/detail/core/sort_stably.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/mapping/cell_columns.hpp"
#include "globalmatch/detail/mapping/cylinder.hpp"
#include "globalmatch/detail/mapping/cylinder_fit.hpp"
#include "globalmatch/detail/mapping/stem_base.hpp"
#include "globalmatch/detail/mapping/stem_cylinders.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/mapping_options.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

/// Joins cylinders of one stem (its lower and its upper half, its two sides, the arms of a fork): those whose
/// axes come within the larger radius of each other on the ground or at a height where one of them was seen.
/// The better supported one stays, refined over both. Cylinders that do not meet the terrain are left out.
inline std::vector<stem_cylinder> merge_fragments(stem_cylinders found, const local_points& understory,
                                                  const terrain& ground, const cylinder_options& options) {
  struct fragment_with_base {
    stem_cylinder stem;
    double ground_height;
  };
  std::vector<fragment_with_base> fragments, merged;
  for (stem_cylinder& s : found.stems)
    if (const auto base = intersect_terrain(s.cylinder, ground))
      fragments.push_back({std::move(s), base->z});
  sort_stably(fragments, [](const fragment_with_base& a, const fragment_with_base& b) {
    return a.stem.support.size() > b.stem.support.size();
  });
  const auto same_stem = [](const fragment_with_base& a, const fragment_with_base& b) {
    const cylinder &ca = a.stem.cylinder, &cb = b.stem.cylinder;
    const auto touch = [&](double z) {
      return (ca.at_height(z) - cb.at_height(z)).norm() < std::max(ca.radius, cb.radius);
    };
    return touch(a.ground_height) || touch(ca.point.z) || touch(cb.point.z);
  };
  for (fragment_with_base& fragment : fragments) {
    const auto whole = std::find_if(merged.begin(), merged.end(),
                                    [&](const fragment_with_base& r) { return same_stem(r, fragment); });
    if (whole == merged.end()) {
      merged.push_back(std::move(fragment));
      continue;
    }
    std::vector<point_index> support;
    std::set_union(whole->stem.support.begin(), whole->stem.support.end(), fragment.stem.support.begin(),
                   fragment.stem.support.end(), std::back_inserter(support));
    std::vector<vec3> both;
    for (const point_index i : support) both.push_back(vec3(understory[i]));
    if (const auto refined = refine_cylinder(whole->stem.cylinder, both, found.distance_tolerance, options))
      whole->stem.cylinder = *refined;
    whole->stem.support = std::move(support);
  }
  std::vector<stem_cylinder> stems;
  for (fragment_with_base& r : merged) stems.push_back(std::move(r.stem));
  return stems;
}

/// Probability that a cylinder which looks like a stem is one: a logistic regression on the height that its
/// points fill, their share of all points around, and how sure its place is. Ours, fitted to the tuning seeds
/// of simulated scans (docs/deviations.md).
inline double stem_quality(const stem_cylinder& found) {
  constexpr double min_sigma = 1e-4;  // [m]
  const double evidence = 2.37 * found.filled_height + 11.46 * found.surface_share -
                          0.73 * std::log(axis_uncertainty(found.covariance) + min_sigma) - 16.14;
  return 1 / (1 + std::exp(-evidence));
}

/// The indices in the scan of some points, increasing.
inline std::vector<point_index> in_scan_order(const std::vector<point_index>& chosen,
                                              const local_points& points) {
  struct entry {
    point_index key;
  };
  std::vector<entry> entries, spare;
  entries.reserve(chosen.size());
  for (const point_index i : chosen) entries.push_back({points.index[i]});
  radix_sort(entries, spare);
  std::vector<point_index> indices;
  indices.reserve(chosen.size());
  for (const entry& e : entries) indices.push_back(e.key);
  return indices;
}

/// A stem in the frame of the scan, where the axis of a cylinder meets the terrain; nothing when that lies
/// beyond the raster. `points` are those that the support counts in.
inline std::optional<stem> locate_stem(const stem_cylinder& found, const local_points& points,
                                       const terrain& ground) {
  // Points that bark, sweep and bow shift err alike: stems are off by so many times what their points, had
  // they erred alone, would make them (ours, from the tuning seeds of simulated scans; see
  // docs/deviations.md).
  constexpr double calibration = 2.3;
  auto position = intersect_terrain(found.cylinder, ground);
  if (!position) return std::nullopt;
  stem s;
  if (const auto at = ground_at(ground, position->x, position->y, found.cylinder.radius)) {
    position = found.cylinder.at_height(at->height);
    s.height_sigma = at->sigma;
  }
  s.position = ground.frame.to_scan(*position).as<Eigen::Vector3d>();
  s.axis = transpose_times(ground.frame.rotation, found.cylinder.axis).as<Eigen::Vector3d>();
  const double base = found.cylinder.axis.dot(*position - found.cylinder.point);
  const double lean = found.cylinder.axis.xy().norm() / found.cylinder.axis.z;
  s.position_sigma =
      std::hypot(calibration * axis_uncertainty(found.covariance, base), lean * s.height_sigma);
  s.radius = found.cylinder.radius_at_height(position->z + breast_height);
  s.radius_sigma = std::hypot(
      calibration * radius_uncertainty(found.covariance, base + breast_height / found.cylinder.axis.z),
      found.cylinder.taper * s.height_sigma);
  s.taper = found.cylinder.taper;
  s.quality = stem_quality(found);
  s.ground_seen = ground.is_known(position->x, position->y);
  s.support = in_scan_order(found.support, points);
  return s;
}

/// Stems in the frame of the scan, for the cylinders whose axes meet the terrain, ordered by position (x, y,
/// z). `points` are the stem points that the supports count in. Parallel over stems.
inline std::vector<stem> locate_stems(const std::vector<stem_cylinder>& cylinders, const local_points& points,
                                      const terrain& ground, const execution& exec = {}) {
  std::vector<std::optional<stem>> located(cylinders.size());
  parallel_for(
      exec, "stem positions", cylinders.size(),
      [&](std::size_t i) { located[i] = locate_stem(cylinders[i], points, ground); }, 4);
  std::vector<stem> stems;
  for (auto& s : located)
    if (s) stems.push_back(std::move(*s));
  std::sort(stems.begin(), stems.end(), [](const stem& a, const stem& b) {
    const double *p = a.position.data(), *q = b.position.data();
    return std::lexicographical_compare(p, p + 3, q, q + 3);
  });
  return stems;
}
}  // namespace globalmatch::detail
