// Stems in clusters ([GM] 3.1): mostly one cylinder a cluster, several where stems stand close or branches
// join them. In: stem points in clusters. Out: cylinders with their supporting points. Parallel
// over clusters.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/local_points.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/mapping/cell_columns.hpp"
#include "globalmatch/detail/mapping/clusters.hpp"
#include "globalmatch/detail/mapping/cylinder.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/mapping_options.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

/// A cylinder that looks like a stem, and what speaks for it.
struct stem_cylinder {
  detail::cylinder cylinder;         ///< local frame
  std::vector<point_index> support;  ///< positions in the understory points that
                                     ///< lie on it, increasing
  double filled_height = 0;          ///< [m] height that the support fills, in steps of 0.1 m
  double rms = 0;                    ///< [m] of the support about the surface
  double surface_share = 1;          ///< of the points in and within 0.1 m of it those on its surface
  double inside_share = 0;           ///< points in it, as a share of those on its surface
  cylinder_covariance_matrix covariance = cylinder_covariance_matrix::Zero();
};

struct stem_cylinders {
  std::vector<stem_cylinder> stems;
  double distance_tolerance = 0;  ///< [m] that was used
};

constexpr double height_bin = 0.1;  // [m]

/// The greatest whole number not above v. (`std::floor` is a call where processors need not have an
/// instruction for it.)
inline std::int32_t whole_number(double v) {
  const auto toward_zero = static_cast<std::int32_t>(v);
  return toward_zero - (v < toward_zero);
}

/// The height bin of z as one of 64 bits. Bins repeat every 6.4 m, which is more than a stem shows in the
/// understory, so that clusters may climb a slope of any height.
inline std::uint64_t height_bit(double z) {
  return std::uint64_t(1) << (whole_number(z / height_bin) & 63);
}

inline Eigen::AlignedBox2d widened(const Eigen::AlignedBox2d& box, double by) {
  return {box.min().array() - by, box.max().array() + by};
}
inline Eigen::AlignedBox2d square_about(double x, double y, double half) {
  return widened(Eigen::AlignedBox2d(Eigen::Vector2d(x, y)), half);
}

/// The points of a cluster in narrow columns, and which of them fill most height.
class column_raster {
 public:
  /// `members` must come column by column, as points in cells do.
  column_raster(const local_points& points, std::span<const point_index> members, double column_width)
      : members_(members), cell_(column_width / (2 * search_radius + 1)) {
    for (std::uint32_t k = 0; k < members.size(); ++k) {
      const point_index i = members[k];
      const auto x = whole_number(points.x[i] / cell_);
      const auto y = whole_number(points.y[i] / cell_);
      if (columns_.empty() || columns_.back().x != x || columns_.back().y != y) columns_.push_back({y, x, k});
      columns_.back().end = k + 1;
      columns_.back().filled |= height_bit(points.z[i]);
    }
    // With other cells than those the points are sorted by a column may come in several parts.
    std::sort(columns_.begin(), columns_.end());
    for (std::size_t c = 0; c < columns_.size(); ++c)
      rows_.resize(std::size_t(columns_[c].y - columns_.front().y) + 1, c);
    rows_.push_back(columns_.size());
    for (column& c : columns_) update(c);
  }

  struct place {
    double x, y;
    int bins;
  };

  /// Middle of the column that fills most height bins, and how many.
  std::optional<place> densest() const {
    const auto best = std::max_element(columns_.begin(), columns_.end(),
                                       [](const column& a, const column& b) { return a.bins < b.bins; });
    if (best == columns_.end() || best->bins == 0) return std::nullopt;
    return place{(best->x + 0.5) * cell_, (best->y + 0.5) * cell_, best->bins};
  }

  /// How many points are left in the columns of a box.
  std::size_t count_in(const Eigen::AlignedBox2d& box) const {
    std::size_t count = 0;
    for_each_column(box, [&](const column& c) {
      if (c.filled != 0) count += c.end - c.begin;
    });
    return count;
  }
  /// Calls `visit(member)` for every so many of them.
  template <class Visit>
  void for_each_in(const Eigen::AlignedBox2d& box, std::size_t step, const Visit& visit) const {
    std::size_t skip = 0;
    for_each_column(box, [&](const column& c) {
      if (c.filled == 0) return;
      std::size_t k = c.begin + skip;
      for (; k < c.end; k += step) visit(members_[k]);
      skip = k - c.end;
    });
  }

  /// Takes out the columns of a box whose middle is such that `gone(x, y)`.
  template <class Gone>
  void remove(const Eigen::AlignedBox2d& box, const Gone& gone) {
    for_each_column(box, [&](const column& c) {
      if (gone((c.x + 0.5) * cell_, (c.y + 0.5) * cell_)) const_cast<column&>(c).filled = 0;
    });
    for_each_column(widened(box, search_radius * cell_),
                    [&](const column& c) { update(const_cast<column&>(c)); });
  }

 private:
  static constexpr std::int32_t search_radius = 2;
  struct column {
    std::int32_t y, x;
    std::uint32_t begin, end = 0;
    std::uint64_t filled = 0;  // height bins
    int bins = 0;              // that it and those within reach fill
    bool operator<(const column& o) const { return std::tie(y, x, begin) < std::tie(o.y, o.x, o.begin); }
  };

  template <class Visit>
  void for_each_between(std::int32_t left, std::int32_t right, std::int32_t low, std::int32_t high,
                        const Visit& visit) const {
    if (columns_.empty()) return;
    const std::int32_t first = columns_.front().y;
    for (std::int32_t row = std::max(low, first); row <= std::min(high, columns_.back().y); ++row) {
      const auto begin = columns_.begin() + std::ptrdiff_t(rows_[std::size_t(row - first)]);
      const auto end = columns_.begin() + std::ptrdiff_t(rows_[std::size_t(row - first) + 1]);
      auto c = std::lower_bound(begin, end, left, [](const column& a, std::int32_t x) { return a.x < x; });
      for (; c != end && c->x <= right; ++c) visit(*c);
    }
  }
  template <class Visit>
  void for_each_column(const Eigen::AlignedBox2d& box, const Visit& visit) const {
    const auto number = [&](double v) { return whole_number(v / cell_); };
    for_each_between(number(box.min().x()), number(box.max().x()), number(box.min().y()),
                     number(box.max().y()), visit);
  }
  void update(column& c) {
    std::uint64_t around = 0;
    if (c.filled != 0)
      for_each_between(c.x - search_radius, c.x + search_radius, c.y - search_radius, c.y + search_radius,
                       [&](const column& other) { around |= other.filled; });
    c.bins = std::popcount(around);
  }

  std::span<const point_index> members_;
  double cell_;
  std::vector<column> columns_;    // row by row
  std::vector<std::size_t> rows_;  // where each begins, and the last one ends
};

/// Calls `visit(i, d)` for the understory points within `distance` of the cylinder's surface or inside it,
/// increasing; d is the signed distance from the surface.
template <class Visit>
void for_each_near(const cell_columns& understory, const cylinder& c, double distance, const Visit& visit) {
  constexpr double half_height = 2;  // [m] the understory layer is less than twice as high, on any slope
  const local_points& points = understory.points();
  const double horizontal_extent = half_height * c.axis.head<2>().norm() / c.axis.z();
  const double max_distance = c.radius + distance + half_height * std::abs(c.taper);
  understory.for_each_run_near(
      c.point.x(), c.point.y(), max_distance + horizontal_extent,
      [&](std::uint32_t begin, std::uint32_t end) {
        for (std::uint32_t i = begin; i < end; ++i) {
          const double dx = points.x[i] - c.point.x(), dy = points.y[i] - c.point.y(),
                       dz = points.z[i] - c.point.z();
          const double along = c.axis.x() * dx + c.axis.y() * dy + c.axis.z() * dz;
          if (std::abs(along) > 2 * half_height) continue;
          const double squared = dx * dx + dy * dy + dz * dz - along * along;
          if (squared > max_distance * max_distance) continue;
          const double d = std::sqrt(std::max(squared, 0.0)) - c.radius + c.taper * along;
          if (d < distance) visit(static_cast<point_index>(i), d);
        }
      });
}

inline Eigen::Vector3d position_of(const local_points& points, point_index i) {
  return {points.x[i], points.y[i], points.z[i]};
}

/// Support and evidence of a cylinder; nothing when it does not look like a stem: an upright surface seen
/// over some height, nothing inside it, little close around it, and its place certain.
inline std::optional<stem_cylinder> score_stem(const cylinder& c, const cell_columns& understory,
                                               const stem_cylinder_options& options) {
  constexpr double surroundings = 0.10;     // [m]
  constexpr std::size_t max_points = 1000;  // that the uncertainty is computed from
  const double tolerance = options.cylinder.distance_tolerance.value();
  const double rough = 1.5 * tolerance;  // bark and taper
  const local_points& points = understory.points();
  stem_cylinder found;
  found.cylinder = c;
  struct near_point {
    float z, distance;
  };
  std::vector<near_point> near;
  double lowest = std::numeric_limits<double>::infinity(), highest = -lowest, squares = 0;
  std::uint64_t filled = 0;
  for_each_near(understory, c, surroundings, [&](point_index i, double d) {
    const double z = points.z[i];
    near.push_back({float(z), float(d)});
    if (std::abs(d) >= tolerance) return;
    found.support.push_back(i);
    lowest = std::min(lowest, z);
    highest = std::max(highest, z);
    squares += d * d;
    filled |= height_bit(z);
  });
  if (found.support.size() < std::size_t(options.min_points)) return std::nullopt;
  found.filled_height = std::popcount(filled) * height_bin;
  if (found.filled_height < options.min_height ||
      found.filled_height < options.min_filled * (highest - lowest))
    return std::nullopt;

  std::size_t inside = 0, on_surface = 0, around = 0;
  for (const near_point& p : near)
    if (p.z >= lowest && p.z <= highest)
      ++(p.distance < -rough ? inside : p.distance < rough ? on_surface : around);
  if (on_surface == 0) return std::nullopt;
  found.surface_share = double(on_surface) / double(inside + on_surface + around);
  found.inside_share = double(inside) / double(on_surface);
  if (found.surface_share < options.min_share || found.inside_share > options.max_inside) return std::nullopt;

  std::vector<Eigen::Vector3d> support;
  const std::size_t step = (found.support.size() + max_points - 1) / max_points;
  for (std::size_t k = 0; k < found.support.size(); k += step)
    support.push_back(position_of(points, found.support[k]));
  found.rms = std::sqrt(squares / double(found.support.size()));
  found.covariance = cylinder_covariance(c, support, std::max(found.rms, tolerance / 4), options.cylinder);
  if (axis_uncertainty(found.covariance) > options.max_sigma) return std::nullopt;
  return found;
}

/// A line that rises with z: (x, y) = at + slope (z - z0).
struct vertical_line {
  Eigen::Vector2d at = Eigen::Vector2d::Zero(), slope = Eigen::Vector2d::Zero();
  double z0 = 0;
  Eigen::Vector2d at_height(double z) const { return at + slope * (z - z0); }
  /// What it passes in plan, over more than the understory layer.
  Eigen::AlignedBox2d seen_from_above() const {
    constexpr double half_height = 2;  // [m]
    return Eigen::AlignedBox2d(at_height(z0 - half_height)).extend(at_height(z0 + half_height));
  }
};

/// Follows a column up and down: the line through the middles of its slices, each of the points near it,
/// from an upright one at `start`. Returns it with the height bins that points near it fill.
inline std::pair<vertical_line, std::uint64_t> follow_column(std::span<const Eigen::Vector3d> points,
                                                             const Eigen::Vector2d& start, double max_slope) {
  constexpr double slice = 0.2, near = 0.15;  // [m]
  constexpr int max_iterations = 6, slices = 32;
  vertical_line line{start, Eigen::Vector2d::Zero(), 0};
  for (const Eigen::Vector3d& p : points) line.z0 += p.z() / double(points.size());
  const double lowest = line.z0 - slice * slices / 2;
  std::uint64_t filled = 0;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    std::array<Eigen::Vector3d, slices> sums;
    std::array<double, slices> counts{};
    sums.fill(Eigen::Vector3d::Zero());
    filled = 0;
    for (const Eigen::Vector3d& p : points) {
      if ((p.head<2>() - line.at_height(p.z())).squaredNorm() > near * near) continue;
      const int s = static_cast<int>((p.z() - lowest) / slice);
      if (s < 0 || s >= slices) continue;
      sums[std::size_t(s)] += p;
      ++counts[std::size_t(s)];
      filled |= height_bit(p.z());
    }
    double n = 0, z = 0, zz = 0;
    Eigen::Vector2d xy = Eigen::Vector2d::Zero(), xyz = Eigen::Vector2d::Zero();
    for (std::size_t s = 0; s < slices; ++s) {
      if (counts[s] == 0) continue;
      const Eigen::Vector3d m = sums[s] / counts[s] - Eigen::Vector3d(0, 0, line.z0);
      n += 1, z += m.z(), zz += m.z() * m.z();
      xy += m.head<2>();
      xyz += m.head<2>() * m.z();
    }
    if (n < 3) break;
    const double variance_z = zz - z * z / n;
    line.slope = (xyz - xy * z / n) / std::max(variance_z, 1e-6);
    if (line.slope.norm() > max_slope) line.slope *= max_slope / line.slope.norm();
    line.at = (xy - line.slope * z) / n;
  }
  return {line, filled};
}

/// The circle that most points lie on, seen along a line, by RANSAC: draws of three, until it is unlikely
/// that better ones were missed; cost as in `surface_cost`. `x`, `y`: points [m] from the line.
inline std::optional<Eigen::Vector3d> fit_circle(const std::vector<float>& x, const std::vector<float>& y,
                                                 double tolerance, const cylinder_options& options,
                                                 random_source& random) {
  const auto count = static_cast<std::uint32_t>(x.size());
  const auto cut = static_cast<float>(tolerance * tolerance), width = static_cast<float>(tolerance);
  std::optional<Eigen::Vector3d> best;
  float best_cost = std::numeric_limits<float>::infinity();
  int max_iterations = options.max_iterations;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    const std::uint32_t i = random.below(count), j = random.below(count), k = random.below(count);
    if (i == j || j == k || i == k) continue;
    const auto circle = circle_through({x[i], y[i]}, {x[j], y[j]}, {x[k], y[k]});
    if (!circle || circle->z() < options.min_radius || circle->z() > options.max_radius) continue;
    const auto cx = float(circle->x()), cy = float(circle->y()), r = float(circle->z());
    float cost = 0;
    for (std::uint32_t begin = 0; begin < count && cost < best_cost; begin += 64) {
      const Eigen::Index some = std::min(count - begin, 64u);
      const auto from_x = Eigen::Map<const Eigen::ArrayXf>(x.data() + begin, some) - cx;
      const auto from_y = Eigen::Map<const Eigen::ArrayXf>(y.data() + begin, some) - cy;
      const Eigen::Array<float, Eigen::Dynamic, 1, 0, 64, 1> d =
          (from_x.square() + from_y.square()).sqrt() - r;
      const auto is_inside = ((-width - d) * 1e30f).max(0.0f).min(1.0f);  // 1 or 0
      cost += (d.square().min(cut) + cut * is_inside).sum();
    }
    if (!(cost < best_cost)) continue;
    best_cost = cost;
    best = circle;
    // No more draws than it takes to draw three points on the circle almost surely.
    const double off = std::clamp(double(cost) / (double(cut) * count), 0.05, 0.95);
    const double success = std::pow(1 - off, 3);
    max_iterations =
        std::min(max_iterations, iteration + static_cast<int>(std::ceil(-4.6 / std::log1p(-success))));
  }
  return best;
}

/// The stems of one cluster, `maximum` of them: again and again the fullest column is followed, until none is
/// high enough. With `normals`, one for each understory point, cylinders are drawn as in [GM], from points
/// and their normals.
inline std::vector<stem_cylinder> stems_of_cluster(const cell_columns& understory,
                                                   std::span<const point_index> members,
                                                   std::span<const Eigen::Vector3f> normals,
                                                   const stem_cylinder_options& options,
                                                   random_source& random, std::size_t maximum) {
  constexpr double search_radius = 0.45;    // [m] from the line: thick stems
  constexpr std::size_t max_points = 500;   // that are fitted
  constexpr double min_filled_share = 0.5;  // height that a column holds of a stem that leans, as a share
  const local_points& points = understory.points();
  const double tolerance = options.cylinder.distance_tolerance.value();
  const double max_slope = std::tan(options.cylinder.max_tilt_deg * std::numbers::pi / 180);
  const double horizontal_extent = 1.5 * max_slope;  // [m] half the understory layer
  std::vector<stem_cylinder> stems;
  column_raster columns(points, members, options.column_width);
  std::vector<point_index> nearby;
  std::vector<Eigen::Vector3d> sample, sample_normals;
  for (auto column = columns.densest(); column && stems.size() < maximum; column = columns.densest()) {
    if (column->bins * height_bin < min_filled_share * options.min_height) break;
    const Eigen::AlignedBox2d around = square_about(column->x, column->y, search_radius + horizontal_extent);
    const auto step_for = [](std::size_t count) { return (count + max_points - 1) / max_points; };
    sample.clear();
    columns.for_each_in(around, step_for(columns.count_in(around)),
                        [&](point_index i) { sample.push_back(position_of(points, i)); });
    const auto [line, filled] = follow_column(sample, {column->x, column->y}, max_slope);
    std::optional<stem_cylinder> stem;
    if (std::popcount(filled) * height_bin >= options.min_height) {
      nearby.clear();
      columns.for_each_in(widened(line.seen_from_above(), search_radius), 1, [&, l = line](point_index i) {
        const Eigen::Vector2d at = l.at_height(points.z[i]);
        const Eigen::Vector2d from_line(points.x[i] - at.x(), points.y[i] - at.y());
        if (from_line.squaredNorm() < search_radius * search_radius) nearby.push_back(i);
      });
      const std::size_t step = step_for(nearby.size());
      sample.clear();
      for (std::size_t k = 0; k < nearby.size(); k += step) sample.push_back(position_of(points, nearby[k]));
      std::optional<cylinder> fit;
      if (normals.empty()) {
        std::vector<float> x, y;
        for (const Eigen::Vector3d& p : sample) {
          const Eigen::Vector2d from_line = p.head<2>() - line.at_height(p.z());
          x.push_back(float(from_line.x()));
          y.push_back(float(from_line.y()));
        }
        const double blurred = tolerance + 0.01;  // [m] the line is not quite the axis
        if (sample.size() >= 6)
          if (const auto circle = fit_circle(x, y, blurred, options.cylinder, random)) {
            const Eigen::Vector2d at = line.at + circle->head<2>();
            const cylinder seen{{at.x(), at.y(), line.z0},
                                Eigen::Vector3d(line.slope.x(), line.slope.y(), 1).normalized(),
                                circle->z(),
                                0};
            fit = refine_cylinder(seen, sample, tolerance, options.cylinder, 2 * blurred);
          }
      } else {
        sample_normals.clear();
        for (std::size_t k = 0; k < nearby.size(); k += step)
          sample_normals.push_back(normals[nearby[k]].cast<double>());
        fit = fit_cylinder(sample, sample_normals, options.cylinder, random);
      }
      if (fit) stem = score_stem(*fit, understory, options);
    }
    if (stem) {
      const cylinder& c = stem->cylinder;
      const Eigen::Vector2d slope = c.axis.head<2>() / c.axis.z();
      columns.remove(widened(around, c.radius), [&](double x, double y) {
        // near the axis at some height that the stem was seen at
        const Eigen::Vector2d from_middle(x - c.point.x(), y - c.point.y());
        const double share =
            std::clamp(from_middle.dot(slope) / std::max(slope.squaredNorm(), 1e-9), -1.5, 1.5);
        return (from_middle - share * slope).norm() < c.radius + 0.05;
      });
      stems.push_back(std::move(*stem));
    }
    columns.remove(square_about(column->x, column->y, options.column_width / 2),
                   [](double, double) { return true; });
  }
  return stems;
}

/// Numbers of the clusters, those of most points first.
inline std::vector<std::size_t> by_decreasing_size(const point_clusters& clusters) {
  std::vector<std::size_t> order(clusters.size());
  for (std::size_t c = 0; c < order.size(); ++c) order[c] = c;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return clusters[a].size() > clusters[b].size(); });
  return order;
}

/// Every so many of the members of a cluster, some thousands at most.
inline std::vector<point_index> thinned(std::span<const point_index> members) {
  constexpr std::size_t maximum = 4000;
  const std::size_t step = (members.size() + maximum - 1) / maximum;
  std::vector<point_index> kept;
  for (std::size_t k = 0; k < members.size(); k += step) kept.push_back(members[k]);
  return kept;
}

/// Scatter [m] of some points about their cylinder, robust against what does not belong to it: 1.48 times the
/// median distance of those within `band` [m] of the surface.
inline double noise_about(const cylinder& c, const local_points& points, std::span<const point_index> members,
                          double band) {
  std::vector<double> distances;
  for (const point_index i : members)
    if (const double d = std::abs(c.surface_distance(position_of(points, i))); d < band)
      distances.push_back(d);
  if (distances.empty()) return 0;
  const auto middle = distances.begin() + std::ptrdiff_t(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  return 1.48 * *middle;
}

/// Three times the scatter (noise, bark, taper) of the points about the stems of the largest clusters, median
/// over them; the default where there are none.
inline double tolerance_from_noise(const cell_columns& understory, const point_clusters& clusters,
                                   std::span<const Eigen::Vector3f> normals, stem_cylinder_options options,
                                   const execution& exec) {
  constexpr std::size_t max_clusters = 30;          // clusters looked at
  constexpr double minimum = 0.01, maximum = 0.04;  // [m]
  constexpr double band = 2 * maximum;
  options.cylinder.distance_tolerance = default_distance_tolerance;
  std::vector<std::size_t> order = by_decreasing_size(clusters);
  order.resize(std::min(order.size(), max_clusters));
  std::vector<std::vector<double>> of_cluster(order.size());
  parallel_for(
      exec, "scatter", order.size(),
      [&](std::size_t k) {
        random_source random(options.cylinder.seed, order[k] + 1);
        const std::vector<point_index> members = thinned(clusters[order[k]]);
        for (const stem_cylinder& stem : stems_of_cluster(understory, members, normals, options, random, 1))
          of_cluster[k].push_back(noise_about(stem.cylinder, understory.points(), members, band));
      },
      1);
  std::vector<double> noise_levels;
  for (const auto& some : of_cluster) noise_levels.insert(noise_levels.end(), some.begin(), some.end());
  if (noise_levels.empty()) return default_distance_tolerance;
  const auto middle = noise_levels.begin() + std::ptrdiff_t(noise_levels.size() / 2);
  std::nth_element(noise_levels.begin(), middle, noise_levels.end());
  return std::clamp(3 * *middle, minimum, maximum);
}

/// Cylinders that look like stems, in the order of the clusters, whose members are positions in the
/// understory points. `normals`: empty, or unit normals of all understory points, of any sign; cylinders are
/// then drawn from points and normals, as in [GM], instead of circles seen along a column. The tolerance used
/// stands in the result.
inline stem_cylinders find_stem_cylinders(const cell_columns& understory, const point_clusters& clusters,
                                          std::span<const Eigen::Vector3f> normals = {},
                                          stem_cylinder_options options = {}, const execution& exec = {}) {
  require_valid(options);
  if (!normals.empty() && normals.size() != understory.points().size())
    throw std::invalid_argument("normals must hold one vector for each understory point");
  if (!options.cylinder.distance_tolerance)
    options.cylinder.distance_tolerance = tolerance_from_noise(understory, clusters, normals, options, exec);
  std::vector<std::vector<stem_cylinder>> of_cluster(clusters.size());
  const auto order = by_decreasing_size(clusters);  // so that no thread is left with a large one at the end
  parallel_for(
      exec, "cylinders", clusters.size(),
      [&](std::size_t k) {
        const std::size_t c = order[k];
        random_source random(options.cylinder.seed, c + 1);
        of_cluster[c] = stems_of_cluster(understory, clusters[c], normals, options, random,
                                         std::numeric_limits<std::size_t>::max());
      },
      1);
  stem_cylinders result{{}, *options.cylinder.distance_tolerance};
  for (auto& found : of_cluster)
    result.stems.insert(result.stems.end(), std::make_move_iterator(found.begin()),
                        std::make_move_iterator(found.end()));
  return result;
}
}  // namespace globalmatch::detail
