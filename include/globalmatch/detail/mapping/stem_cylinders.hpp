// Stems in clusters ([GM] 3.1). In: stem points in clusters. Out: cylinders with their supporting points.
// Parallel over clusters.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <optional>
#include <span>
#include <stdexcept>
#include <vector>

#include "globalmatch/detail/core/local_points.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "globalmatch/detail/core/sort_by_key.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/mapping/cell_columns.hpp"
#include "globalmatch/detail/mapping/clusters.hpp"
#include "globalmatch/detail/mapping/column_search.hpp"
#include "globalmatch/detail/mapping/cylinder.hpp"
#include "globalmatch/detail/mapping/stem_cylinder.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/mapping_options.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

struct stem_cylinders {
  std::vector<stem_cylinder> stems;
  double distance_tolerance = 0;  ///< [m] that was used
};

/// Numbers of the clusters, those of most points first.
inline std::vector<std::uint32_t> by_decreasing_size(const point_clusters& clusters) {
  std::vector<std::uint64_t> keys(clusters.size());
  for (std::size_t c = 0; c < keys.size(); ++c) keys[c] = ~std::uint64_t(clusters[c].size());
  return order_by(keys);
}

/// Numbers of the cylinders, those of most support first.
inline std::vector<std::uint32_t> by_decreasing_support(const std::vector<stem_cylinder>& stems) {
  std::vector<std::uint64_t> keys(stems.size());
  for (std::size_t i = 0; i < keys.size(); ++i) keys[i] = ~std::uint64_t(stems[i].support.size());
  return order_by(keys);
}

/// Every so many of the members of a cluster, some thousands at most.
inline std::vector<point_index> thinned(std::span<const point_index> members) {
  constexpr std::size_t maximum = 4000;
  const std::size_t step = (members.size() + maximum - 1) / maximum;
  std::vector<point_index> kept;
  for (std::size_t k = 0; k < members.size(); k += step) kept.push_back(members[k]);
  return kept;
}

/// Noise [m] of some points about their cylinder, robust against what does not belong to it: 1.48 times the
/// median distance of those within `band` [m] of the surface.
inline double noise_about(const cylinder& c, const local_points& points, std::span<const point_index> members,
                          double band) {
  std::vector<double> distances;
  for (const point_index i : members)
    if (const double d = std::abs(c.surface_distance(vec3(points[i]))); d < band) distances.push_back(d);
  return distances.empty() ? 0 : 1.48 * upper_median(distances);
}

/// Three times the noise (of the scanner, bark, taper) of the points about the stems of the largest clusters,
/// median over them; the default where there are none.
inline double tolerance_from_noise(const cell_columns& understory, const point_clusters& clusters,
                                   const cylinder_fitter& fitter, stem_cylinder_options options,
                                   const execution& exec) {
  constexpr std::size_t max_clusters = 30;
  constexpr double minimum = 0.01, maximum = 0.04;  // [m]
  constexpr double band = 2 * maximum;
  options.cylinder.distance_tolerance = default_distance_tolerance;
  std::vector<std::uint32_t> order = by_decreasing_size(clusters);
  order.resize(std::min(order.size(), max_clusters));
  std::vector<std::optional<double>> of_cluster(order.size());
  parallel_for(
      exec, "noise", order.size(),
      [&](std::size_t k) {
        random_source random(options.cylinder.seed, order[k] + 1);
        const std::vector<point_index> members = thinned(clusters[order[k]]);
        const auto found = column_search(understory, members, fitter, options).run(random, 1);
        if (!found.empty())
          of_cluster[k] = noise_about(found.front().cylinder, understory.points(), members, band);
      },
      1);
  std::vector<double> noise_levels;
  for (const auto& noise : of_cluster)
    if (noise) noise_levels.push_back(*noise);
  if (noise_levels.empty()) return default_distance_tolerance;
  return std::clamp(3 * upper_median(noise_levels), minimum, maximum);
}

/// Cylinders that look like stems, in the order of the clusters, whose members are positions in the
/// understory points. The tolerance used stands in the result.
inline stem_cylinders find_stem_cylinders(const cell_columns& understory, const point_clusters& clusters,
                                          const cylinder_fitter& fitter = {&fit_along_line},
                                          stem_cylinder_options options = {}, const execution& exec = {}) {
  require_valid(options);
  if (!fitter.normals.empty() && fitter.normals.size() != understory.points().size())
    throw std::invalid_argument("normals must hold one vector for each understory point");
  if (!options.cylinder.distance_tolerance)
    options.cylinder.distance_tolerance = tolerance_from_noise(understory, clusters, fitter, options, exec);
  std::vector<std::vector<stem_cylinder>> of_cluster(clusters.size());
  const auto order = by_decreasing_size(clusters);  // so that no thread is left with a large one at the end
  parallel_for(
      exec, "cylinders", clusters.size(),
      [&](std::size_t k) {
        const std::size_t c = order[k];
        random_source random(options.cylinder.seed, c + 1);
        of_cluster[c] = column_search(understory, clusters[c], fitter, options)
                            .run(random, std::numeric_limits<std::size_t>::max());
      },
      1);
  stem_cylinders result{{}, *options.cylinder.distance_tolerance};
  for (auto& found : of_cluster)
    result.stems.insert(result.stems.end(), std::make_move_iterator(found.begin()),
                        std::make_move_iterator(found.end()));
  return result;
}

/// Notes in a map how many there are, and the tolerance used.
inline void count_cylinders(const point_clusters& clusters, const stem_cylinders& found, stem_map& map) {
  map.funnel.clusters = clusters.size();
  map.funnel.cylinders = found.stems.size();
  map.distance_tolerance = found.distance_tolerance;
}

}  // namespace globalmatch::detail
