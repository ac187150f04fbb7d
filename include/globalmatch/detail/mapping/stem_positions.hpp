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
#include "globalmatch/detail/core/sort_by_key.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/mapping/cylinder.hpp"
#include "globalmatch/detail/mapping/cylinder_fit.hpp"
#include "globalmatch/detail/mapping/stem_base.hpp"
#include "globalmatch/detail/mapping/stem_cylinders.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/mapping_options.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

/// A cylinder, and the height of the ground where its axis meets it.
struct stem_fragment {
  stem_cylinder stem;
  double ground_height;
};

/// Fragments, and where their axes meet the ground: most are far from each other, and need no further look.
class stem_fragments {
 public:
  void push_back(stem_fragment&& fragment, const vec3& base) {
    fragments_.push_back(std::move(fragment));
    bases_.push_back(base.xy());
  }

  /// The first one near `base` for which `is_same(fragment)` holds, or null. Cost: linear in the fragments.
  template <class Predicate>
  stem_fragment* find_near(const vec3& base, const Predicate& is_same) {
    // [m] Axes less than 30 degrees off the vertical do not meet beyond.
    constexpr double max_distance = 15;
    for (std::size_t i = 0; i < bases_.size(); ++i)
      if ((bases_[i] - base.xy()).squared_norm() < max_distance * max_distance && is_same(fragments_[i]))
        return &fragments_[i];
    return nullptr;
  }

  std::vector<stem_cylinder> cylinders() && {
    std::vector<stem_cylinder> stems;
    stems.reserve(fragments_.size());
    for (stem_fragment& fragment : fragments_) stems.push_back(std::move(fragment.stem));
    return stems;
  }

 private:
  std::vector<stem_fragment> fragments_;
  std::vector<vec2> bases_;
};

/// Whether the axes of two cylinders come within the larger radius of each other on the ground or at a height
/// where one of them was seen.
inline bool are_of_one_stem(const stem_fragment& a, const stem_fragment& b) {
  const cylinder &ca = a.stem.cylinder, &cb = b.stem.cylinder;
  const auto touch = [&](double z) {
    return (ca.at_height(z) - cb.at_height(z)).norm() < std::max(ca.radius, cb.radius);
  };
  return touch(a.ground_height) || touch(ca.point.z) || touch(cb.point.z);
}

/// Adds the support of one cylinder of a stem to another, which is refined over both.
inline void absorb(stem_cylinder& whole, const stem_cylinder& part, const local_points& understory,
                   double tolerance, const cylinder_options& options) {
  std::vector<point_index> support;
  std::set_union(whole.support.begin(), whole.support.end(), part.support.begin(), part.support.end(),
                 std::back_inserter(support));
  std::vector<vec3> both;
  for (const point_index i : support) both.push_back(vec3(understory[i]));
  if (const auto refined = refine_cylinder(whole.cylinder, both, tolerance, options))
    whole.cylinder = *refined;
  whole.support = std::move(support);
  whole.quality = std::max(whole.quality, part.quality);
}

/// Joins cylinders of one stem (its lower and its upper half, its two sides, the arms of a fork) to the
/// better supported one. Cylinders that do not meet the terrain are left out. Cost: a distance for each two.
inline std::vector<stem_cylinder> merge_fragments(stem_cylinders found, const local_points& understory,
                                                  const terrain& ground, const cylinder_options& options) {
  stem_fragments merged;
  for (const std::uint32_t k : by_decreasing_support(found.stems)) {
    poll_cancelled();
    const auto base = intersect_terrain(found.stems[k].cylinder, ground);
    if (!base) continue;
    stem_fragment fragment{std::move(found.stems[k]), base->z};
    const auto is_same = [&](const stem_fragment& whole) { return are_of_one_stem(whole, fragment); };
    if (stem_fragment* const whole = merged.find_near(*base, is_same))
      absorb(whole->stem, fragment.stem, understory, found.distance_tolerance, options);
    else
      merged.push_back(std::move(fragment), *base);
  }
  return std::move(merged).cylinders();
}

/// Leaves out what is less likely a stem than `min_quality`. Returns how many are left.
inline std::size_t drop_unlikely(stem_cylinders& found, double min_quality) {
  std::erase_if(found.stems, [&](const stem_cylinder& s) { return s.quality < min_quality; });
  return found.stems.size();
}

/// Whether two cylinders cannot both be stems: they are of one, or their surfaces meet at breast height.
inline bool overlap(const stem_fragment& a, const stem_fragment& b) {
  const cylinder &ca = a.stem.cylinder, &cb = b.stem.cylinder;
  const double z = a.ground_height + breast_height;
  return are_of_one_stem(a, b) ||
         (ca.at_height(z) - cb.at_height(z)).norm() < ca.radius_at_height(z) + cb.radius_at_height(z);
}

/// Leaves out cylinders that overlap one of higher quality: fragments that came together when they were
/// refitted, and surfaces beside a stem. Cylinders that do not meet the terrain are left out as well. Cost: a
/// distance for each two.
inline void drop_duplicates(std::vector<stem_cylinder>& stems, const terrain& ground) {
  std::stable_sort(stems.begin(), stems.end(),
                   [](const stem_cylinder& a, const stem_cylinder& b) { return a.quality > b.quality; });
  stem_fragments kept;
  for (stem_cylinder& stem : stems) {
    poll_cancelled();
    const auto base = intersect_terrain(stem.cylinder, ground);
    if (!base) continue;
    stem_fragment next{std::move(stem), base->z};
    if (!kept.find_near(*base, [&](const stem_fragment& better) { return overlap(better, next); }))
      kept.push_back(std::move(next), *base);
  }
  stems = std::move(kept).cylinders();
}

/// The indices in the scan of some points, increasing.
inline std::vector<point_index> in_scan_order(const std::vector<point_index>& chosen,
                                              const local_points& points) {
  std::vector<keyed_place> entries(chosen.size()), spare;
  for (std::size_t i = 0; i < chosen.size(); ++i) entries[i] = {points.index[chosen[i]], 0};
  sort_by_key(entries, spare);
  std::vector<point_index> indices(chosen.size());
  for (std::size_t i = 0; i < chosen.size(); ++i) indices[i] = static_cast<point_index>(entries[i].key);
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
  const auto at = ground_at(ground, position->x, position->y, found.cylinder.radius);
  if (at) position = found.cylinder.at_height(at->height);
  s.ground_points = count_ground_near(ground, position->x, position->y);
  const bool is_false = ground.status == ground_status::none || (ground.cut_off && s.ground_points == 0);
  const bool is_given = ground.status == ground_status::normalised && ground.ground.empty();
  if (is_given)
    s.height_sigma = normalised_height_sigma;
  else
    s.height_sigma = at && !is_false ? height_uncertainty(at->sigma, s.ground_points) : unknown_height_sigma;
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
  s.quality = found.quality;
  s.ground_seen = !is_false && ground.is_known(position->x, position->y);
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
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < located.size(); ++i)
    if (located[i]) order.push_back(i);
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const double *p = located[a]->position.data(), *q = located[b]->position.data();
    return p[0] != q[0] ? p[0] < q[0] : p[1] != q[1] ? p[1] < q[1] : p[2] < q[2];
  });
  std::vector<stem> stems;
  stems.reserve(order.size());
  for (const std::size_t i : order) stems.push_back(std::move(*located[i]));
  return stems;
}

}  // namespace globalmatch::detail
