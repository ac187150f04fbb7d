// Stems in clusters ([GM] 3.1): mostly one cylinder a cluster, several where stems stand close or branches
// join them. In: stem points with normals, in clusters. Out: cylinders with their supporting points. Parallel
// over clusters.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "globalmatch/clusters.hpp"
#include "globalmatch/cylinder.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/local_points.hpp"
#include "globalmatch/neighbors.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/random.hpp"
#include "globalmatch/verticality.hpp"

namespace globalmatch {

/// [GM] gives no values: all are ours.
struct stem_cylinder_options {
  cylinder_options cylinder = {};
  double column_width = 0.30;  ///< [m] a stem is first looked for in a column of this width
  int least_points = 15;       ///< on the surface of a stem
  double least_height = 1.4;   ///< [m] that these points fill, in steps of 0.1 m: half the understory layer
  double least_filled = 0.6;   ///< share of the height from the lowest to the highest of them that they fill
  double least_share = 0.6;  ///< of the points in and within 0.1 m of a stem, this share lies on its surface
  double most_inside = 0.4;  ///< points in a stem, as a share of those on its surface
  double largest_sigma = 0.01;  ///< [m] uncertainty of the axis in plan: a fifth of the matching tolerance
};

/// Throws `std::invalid_argument` naming the field that makes no sense.
inline void require_valid(const stem_cylinder_options& options) {
  require_valid(options.cylinder);
  if (!(options.column_width > 0)) throw std::invalid_argument("stems.column_width must be positive");
  if (!(options.least_height >= 0)) throw std::invalid_argument("stems.least_height must not be negative");
  for (const double share : {options.least_filled, options.least_share, options.most_inside})
    if (!(share >= 0 && share <= 1))
      throw std::invalid_argument("stems.least_filled, .least_share and .most_inside must lie in [0, 1]");
  if (!(options.largest_sigma > 0)) throw std::invalid_argument("stems.largest_sigma must be positive");
  if (options.least_points < 6) throw std::invalid_argument("stems.least_points must be at least 6");
}

/// A cylinder that looks like a stem, and what speaks for it.
struct stem_cylinder {
  globalmatch::cylinder cylinder;    ///< local frame
  std::vector<point_index> support;  ///< positions in the understory points that lie on it, increasing
  double filled_height = 0;          ///< [m] height that the support fills, in steps of 0.1 m
  double rms = 0;                    ///< [m] of the support about the surface
  double position_sigma = 0;         ///< [m] uncertainty of the axis in plan, in its worst direction
};

struct stem_cylinders {
  std::vector<stem_cylinder> stems;
  double distance_tolerance = 0;  ///< [m] that was used
};

namespace detail {

constexpr double height_bin = 0.1;  // [m]

/// The height bin of z as one of 64 bits. Bins repeat every 6.4 m, which is more than a stem shows in the
/// understory, so that clusters may climb a slope of any height.
inline std::uint64_t height_bit(double z) {
  return std::uint64_t(1) << (static_cast<std::int64_t>(std::floor(z / height_bin)) & 63);
}

/// The points of one cluster that are not yet explained by a stem, over a plan raster of columns.
class column_raster {
 public:
  column_raster(const local_points& points, std::span<const point_index> members, double column_width)
      : points_(points), remaining_(members.begin(), members.end()), cell_(column_width / 3) {}

  const std::vector<point_index>& remaining() const { return remaining_; }

  /// Middle of the column of 3 x 3 cells that fills most height bins, and how many.
  std::pair<Eigen::Vector2d, int> fullest_column() const {
    std::map<std::pair<int, int>, std::uint64_t> filled;
    for (const point_index i : remaining_) {
      const std::uint64_t bit = height_bit(points_.z[i]);
      const auto [c, r] = cell_of(i);
      for (int dr = -1; dr <= 1; ++dr)
        for (int dc = -1; dc <= 1; ++dc) filled[{c + dc, r + dr}] |= bit;
    }
    std::pair<int, int> best{};
    int most = 0;
    for (const auto& [cell, bits] : filled)
      if (std::popcount(bits) > most) {
        most = std::popcount(bits);
        best = cell;
      }
    return {{(best.first + 0.5) * cell_, (best.second + 0.5) * cell_}, most};
  }

  template <class Predicate>
  void remove_if(const Predicate& predicate) {
    std::erase_if(remaining_, predicate);
  }

 private:
  std::pair<int, int> cell_of(point_index i) const {
    return {static_cast<int>(std::floor(points_.x[i] / cell_)),
            static_cast<int>(std::floor(points_.y[i] / cell_))};
  }

  const local_points& points_;
  std::vector<point_index> remaining_;
  double cell_;
};

/// What the stems of all clusters are judged by.
struct understory_view {
  const local_points& points;
  std::span<const local_surface> surfaces;
  neighbor_tree<float, 2> plan;  // of the points, by x and y
};

/// Calls `visit(i, d)` for the understory points within `distance` of the cylinder's surface or inside it; d
/// is the signed distance from the surface.
template <class Visit>
void for_each_near(const understory_view& understory, const cylinder& c, double distance,
                   const Visit& visit) {
  constexpr double half_height = 2;  // [m] the understory layer is less than twice as high, on any slope
  const double sway = half_height * c.axis.head<2>().norm() / c.axis.z();
  const auto reach = static_cast<float>(c.radius + distance + sway);
  understory.plan.for_each_within({float(c.point.x()), float(c.point.y())}, reach,
                                  [&](std::uint32_t i, float) {
                                    const double d = c.surface_distance(understory.points[i].cast<double>());
                                    if (d < distance) visit(static_cast<point_index>(i), d);
                                  });
}

/// Support and evidence of a cylinder; nothing when it does not look like a stem: an upright surface seen
/// over some height, nothing inside it, little close around it, and its place certain.
inline std::optional<stem_cylinder> judge_stem(const cylinder& c, const understory_view& understory,
                                               const stem_cylinder_options& options) {
  constexpr double surroundings = 0.10;  // [m]
  const double tolerance = options.cylinder.distance_tolerance.value();
  const double rough = 1.5 * tolerance;  // bark and taper
  stem_cylinder found{c, {}, 0, 0, 0};
  for_each_near(understory, c, tolerance, [&](point_index i, double d) {
    if (d > -tolerance) found.support.push_back(i);
  });
  if (found.support.size() < std::size_t(options.least_points)) return std::nullopt;
  std::sort(found.support.begin(), found.support.end());

  std::vector<Eigen::Vector3d> support;
  double lowest = std::numeric_limits<double>::infinity(), highest = -lowest, squares = 0;
  for (const point_index i : found.support) {
    support.push_back(understory.points[i].cast<double>());
    lowest = std::min(lowest, support.back().z());
    highest = std::max(highest, support.back().z());
    squares += std::pow(c.surface_distance(support.back()), 2);
  }
  found.rms = std::sqrt(squares / double(support.size()));
  found.position_sigma = axis_uncertainty(c, support, std::max(found.rms, tolerance / 4));
  std::uint64_t filled = 0;
  for (const Eigen::Vector3d& p : support) filled |= height_bit(p.z());
  found.filled_height = std::popcount(filled) * height_bin;
  if (found.filled_height < options.least_height ||
      found.filled_height < options.least_filled * (highest - lowest) ||
      found.position_sigma > options.largest_sigma)
    return std::nullopt;

  std::size_t inside = 0, on_surface = 0, around = 0;
  for_each_near(understory, c, surroundings, [&](point_index i, double d) {
    const double z = understory.points.z[i];
    if (z >= lowest && z <= highest) ++(d < -rough ? inside : d < rough ? on_surface : around);
  });
  const double all = double(inside + on_surface + around);
  if (double(on_surface) < options.least_share * all ||
      double(inside) > options.most_inside * double(on_surface))
    return std::nullopt;
  return found;
}

/// The stems of one cluster: again and again the fullest column is looked at, until none is high enough.
inline std::vector<stem_cylinder> stems_of_cluster(const understory_view& understory,
                                                   std::span<const point_index> members,
                                                   const stem_cylinder_options& options,
                                                   random_source& random) {
  const local_points& points = understory.points;
  constexpr double reach = 0.45;             // [m] in plan around a column: leaning and thick stems
  constexpr std::size_t most_points = 1000;  // that RANSAC looks at
  std::vector<stem_cylinder> stems;
  column_raster columns(points, members, options.column_width);
  const double stem_shell = 2 * options.cylinder.distance_tolerance.value();
  while (columns.remaining().size() >= std::size_t(options.least_points)) {
    const auto [middle, bins] = columns.fullest_column();
    if (bins * height_bin < options.least_height) break;
    const auto plan_distance = [&, middle = middle](point_index i) {
      return std::max(std::abs(points.x[i] - middle.x()), std::abs(points.y[i] - middle.y()));
    };
    std::vector<point_index> nearby;
    for (const point_index i : columns.remaining())
      if (plan_distance(i) < reach) nearby.push_back(i);

    const std::size_t step = (nearby.size() + most_points - 1) / most_points;
    std::vector<Eigen::Vector3d> sample, normals;
    for (std::size_t k = 0; k < nearby.size(); k += step) {
      sample.push_back(points[nearby[k]].cast<double>());
      normals.push_back(understory.surfaces[nearby[k]].normal.cast<double>());
    }
    std::optional<stem_cylinder> stem;
    if (const auto fit = fit_cylinder(sample, normals, options.cylinder, random))
      stem = judge_stem(*fit, understory, options);
    if (stem) {
      columns.remove_if([&](point_index i) {
        return stem->cylinder.surface_distance(points[i].cast<double>()) < stem_shell;
      });
      stems.push_back(std::move(*stem));
    } else {
      columns.remove_if([&](point_index i) { return plan_distance(i) < options.column_width / 2; });
    }
  }
  return stems;
}

/// Scatter [m] of the points about their cylinder, robust against what does not belong to it: 1.48 times the
/// median distance of those within `band` [m] of the surface.
inline double scatter_about(const cylinder& c, const understory_view& understory, double band) {
  std::vector<double> distances;
  for_each_near(understory, c, band, [&](point_index, double d) {
    if (d > -band) distances.push_back(std::abs(d));
  });
  if (distances.empty()) return 0;
  const auto middle = distances.begin() + std::ptrdiff_t(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  return 1.48 * *middle;
}

inline namespace GLOBALMATCH_THREADING {

/// Three times the scatter (noise, bark, taper) of the points about the stems of the largest clusters, median
/// over them; the default where there are none.
inline double tolerance_from_scatter(const understory_view& understory, const point_clusters& clusters,
                                     stem_cylinder_options options, const execution& how) {
  constexpr std::size_t largest = 30;          // clusters looked at
  constexpr double least = 0.01, most = 0.04;  // [m]
  constexpr double band = 2 * most;
  options.cylinder.distance_tolerance = default_distance_tolerance;
  std::vector<std::size_t> order(clusters.size());
  for (std::size_t c = 0; c < order.size(); ++c) order[c] = c;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return clusters[a].size() > clusters[b].size(); });
  order.resize(std::min(order.size(), largest));
  std::vector<std::vector<double>> of_cluster(order.size());
  parallel_for(
      how, "scatter", order.size(),
      [&](std::size_t k) {
        random_source random(options.cylinder.seed, order[k] + 1);
        for (const stem_cylinder& stem : stems_of_cluster(understory, clusters[order[k]], options, random))
          of_cluster[k].push_back(scatter_about(stem.cylinder, understory, band));
      },
      1);
  std::vector<double> scatters;
  for (const auto& some : of_cluster) scatters.insert(scatters.end(), some.begin(), some.end());
  if (scatters.empty()) return default_distance_tolerance;
  const auto middle = scatters.begin() + std::ptrdiff_t(scatters.size() / 2);
  std::nth_element(scatters.begin(), middle, scatters.end());
  return std::clamp(3 * *middle, least, most);
}

}  // namespace GLOBALMATCH_THREADING
}  // namespace detail

inline namespace GLOBALMATCH_THREADING {

/// Cylinders that look like stems, in the order of the clusters. `surfaces` holds the surface around each
/// point of the thinned understory; the clusters' members are positions in it. The tolerance used stands in
/// the result.
inline stem_cylinders find_stem_cylinders(const local_points& understory,
                                          std::span<const local_surface> surfaces,
                                          const point_clusters& clusters, stem_cylinder_options options = {},
                                          const execution& how = {}) {
  require_valid(options);
  if (surfaces.size() != understory.size())
    throw std::invalid_argument("surfaces must hold one surface for each understory point");
  const detail::understory_view view{
      understory, surfaces,
      neighbor_tree<float, 2>(understory.size(), [&](std::size_t i) { return understory[i]; })};
  if (!options.cylinder.distance_tolerance)
    options.cylinder.distance_tolerance = detail::tolerance_from_scatter(view, clusters, options, how);
  std::vector<std::vector<stem_cylinder>> of_cluster(clusters.size());
  parallel_for(
      how, "cylinders", clusters.size(),
      [&](std::size_t c) {
        random_source random(options.cylinder.seed, c + 1);
        of_cluster[c] = detail::stems_of_cluster(view, clusters[c], options, random);
      },
      1);
  stem_cylinders result{{}, *options.cylinder.distance_tolerance};
  for (auto& found : of_cluster)
    result.stems.insert(result.stems.end(), std::make_move_iterator(found.begin()),
                        std::make_move_iterator(found.end()));
  return result;
}

}  // namespace GLOBALMATCH_THREADING
}  // namespace globalmatch
