// Stem mapping ([GM] 3.1): a scan -> its stem map. The steps above composed, nothing else.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/local_frame.hpp"
#include "globalmatch/detail/core/local_points.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/mapping/cell_columns.hpp"
#include "globalmatch/detail/mapping/clusters.hpp"
#include "globalmatch/detail/mapping/cylinder.hpp"
#include "globalmatch/detail/mapping/funnel.hpp"
#include "globalmatch/detail/mapping/ground.hpp"
#include "globalmatch/detail/mapping/stem_cylinders.hpp"
#include "globalmatch/detail/mapping/stem_positions.hpp"
#include "globalmatch/detail/mapping/stem_taper.hpp"
#include "globalmatch/detail/mapping/understory.hpp"
#include "globalmatch/detail/mapping/vertical_direction.hpp"
#include "globalmatch/detail/mapping/verticality.hpp"
#include "globalmatch/detail/published/voxel_grid.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/mapping_options.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch {

namespace detail {

constexpr double cell_width =
    0.05;  // [m] of the understory's cells: 27 of them are nearly [GM]'s ball of 10 cm

/// Notes how far the points on surfaces are apart: the first and the last decile.
template <class Surface>
void record_spacing(const std::vector<Surface>& surfaces, stem_map& map) {
  std::vector<float> spacings;
  spacings.reserve(surfaces.size());
  for (const Surface& s : surfaces)
    if (s.spacing > 0) spacings.push_back(s.spacing);
  if (spacings.empty()) return;
  const auto at = [&](double share) {
    return spacings.begin() + std::ptrdiff_t(share * double(spacings.size() - 1));
  };
  std::nth_element(spacings.begin(), at(0.9), spacings.end());
  map.spacing_far = *at(0.9);
  std::nth_element(spacings.begin(), at(0.1), at(0.9) + 1);
  map.spacing_near = *at(0.1);
}

/// Clusters of the vertical points; members are positions in the understory.
inline point_clusters cluster_stem_points(const detail::local_points& understory,
                                          const std::vector<local_surface>& surfaces,
                                          const std::vector<point_index>& vertical,
                                          const mapping_options& options, const execution& exec) {
  constexpr float min_link = 0.05f, spacings = 3;
  std::vector<float> links;
  for (const point_index i : vertical)
    links.push_back(options.link_distance ? static_cast<float>(*options.link_distance)
                                          : std::max(min_link, spacings * surfaces[i].spacing));
  const auto min_points = std::size_t(options.stems.min_points);
  point_clusters clusters = cluster_points(select(understory, vertical), links, min_points, exec);
  for (point_index& i : clusters.members) i = vertical[i];
  return clusters;
}

/// The understory in cells, and the clusters of what is vertical in it.
struct stem_points {
  cell_columns understory;
  point_clusters clusters;
  std::vector<Eigen::Vector3f> normals;  // with `stem_point_rule::points`
};

/// Stem points by the surfaces through cells.
inline stem_points stem_points_by_cells(std::vector<detail::local_points> understory,
                                        const mapping_options& options, stem_map& map,
                                        const execution& exec) {
  const detail::local_frame& frame = map.terrain.frame;
  stem_points found{cell_sorter(std::move(understory), frame, cell_width).sorted(exec), {}, {}};
  const auto surfaces = estimate_surfaces(found.understory, options.verticality, exec);
  found.clusters = cluster_cells(found.understory, surfaces, options.verticality,
                                 std::size_t(options.stems.min_points), exec);
  map.funnel.thinned = surfaces.size();
  map.funnel.stem_points =
      std::size_t(std::count_if(surfaces.begin(), surfaces.end(),
                                [&](const cell_surface& s) { return is_stem_cell(s, options.verticality); }));
  record_spacing(surfaces, map);
  return found;
}

/// Stem points as in [GM]: one point a voxel, a normal for each.
inline stem_points stem_points_by_points(const detail::local_points& understory,
                                         const mapping_options& options, stem_map& map,
                                         const execution& exec) {
  detail::local_points thinned = select(understory, thin_by_voxels(understory, options.voxel_size, exec));
  stem_points found{sort_into_cells(std::move(thinned), cell_width, exec), {}, {}};
  const detail::local_points& points = found.understory.points();
  const auto surfaces = estimate_surfaces(points, options.verticality, exec);
  const auto vertical = select_stem_points(surfaces, options.verticality);
  found.clusters = cluster_stem_points(points, surfaces, vertical, options, exec);
  for (const local_surface& s : surfaces) found.normals.push_back(s.normal);
  map.funnel.thinned = points.size();
  map.funnel.stem_points = vertical.size();
  record_spacing(surfaces, map);
  return found;
}

/// Of points sorted into cells the one nearest to the middle of each cell, in their order. Stems near a
/// scanner, which are dense, would outweigh the others in a fine registration.
inline std::vector<point_index> thin_in_cells(const detail::local_points& sorted,
                                              const std::vector<point_index>& chosen) {
  // Cells are counted from far below, so that cutting the fraction off rounds down.
  constexpr double below = 1 << 24;
  std::vector<point_index> kept;
  Eigen::Array3i cell = Eigen::Array3i::Constant(-1);
  double minimum = 0;
  for (const point_index i : chosen) {
    const Eigen::Array3d at = sorted[i].array().cast<double>() * (1 / cell_width) + below;
    const Eigen::Array3i own = at.cast<int>();
    const double squared = (at - own.cast<double>() - 0.5).square().sum();
    const bool is_same = (own == cell).all();
    if (is_same && squared >= minimum) continue;
    if (!is_same) kept.emplace_back();
    kept.back() = i;
    cell = own;
    minimum = squared;
  }
  return kept;
}

/// Points for a fine registration: on the ground and, thinned, on the stems; frame of the scan.
inline void collect_samples(const std::vector<stem_cylinder>& stems, const detail::local_points& understory,
                            stem_map& map, const execution& exec) {
  const detail::local_frame& frame = map.terrain.frame;
  const auto& ground = map.terrain.ground;
  map.ground_samples.resize(ground.size());
  detail::parallel_for(exec, "samples", ground.size(), [&](std::size_t i) {
    map.ground_samples[i] = frame.to_scan(ground[i].cast<double>());
  });
  const Eigen::Matrix3d scan_from_local = frame.local_from_scan_rotation.transpose();
  std::vector<std::vector<point_index>> kept_of(stems.size());
  detail::parallel_for(
      exec, "samples", stems.size(),
      [&](std::size_t k) { kept_of[k] = thin_in_cells(understory, stems[k].support); }, 4);
  std::vector<std::size_t> first = {0};
  for (const auto& kept : kept_of) first.push_back(first.back() + kept.size());
  map.stem_samples.resize(first.back());
  map.stem_normals.resize(first.back());
  detail::parallel_for(
      exec, "samples", stems.size(),
      [&](std::size_t k) {
        const cylinder& c = stems[k].cylinder;
        std::size_t at = first[k];
        for (const point_index i : kept_of[k]) {
          const Eigen::Vector3d p = understory[i].cast<double>(), from_axis = p - c.point;
          const Eigen::Vector3d outward = from_axis - from_axis.dot(c.axis) * c.axis;
          map.stem_samples[at] = frame.to_scan(p);
          map.stem_normals[at] = scan_from_local * outward.normalized();
          ++at;
        }
      },
      4);
}

inline std::vector<Eigen::Vector3d> axes_of(const std::vector<stem>& stems) {
  std::vector<Eigen::Vector3d> axes;
  for (const stem& s : stems) axes.push_back(s.axis);
  return axes;
}

template <point_range R>
stem_map map_stems(const R& scan, const mapping_options& options, const Eigen::Vector3d& up,
                   const execution& exec) {
  stem_map map;
  map.up = map.given_up = up.normalized();

  // Digital terrain model
  ground_model ground = model_ground(scan, options.ground, up, exec);
  map.funnel.ground = ground.funnel;
  map.terrain = std::move(ground.terrain);

  // Understory layer
  const bool by_cells = options.rule == stem_point_rule::cells;
  auto layer =
      select_understory_parts(scan, map.terrain, options.understory, by_cells ? options.voxel_size : 0, exec);
  map.funnel.understory = layer.in_layer;

  // Stem points, by verticality, in clusters
  const stem_points vertical =
      by_cells
          ? stem_points_by_cells(std::move(layer.parts), options, map, exec)
          : stem_points_by_points(join_parts(std::move(layer.parts), map.terrain.frame, "understory", exec),
                                  options, map, exec);
  const detail::local_points& understory = vertical.understory.points();
  map.funnel.clusters = vertical.clusters.size();

  // Individual stems: cylinders
  auto found =
      find_stem_cylinders(vertical.understory, vertical.clusters, vertical.normals, options.stems, exec);
  map.distance_tolerance = found.distance_tolerance;
  map.funnel.cylinders = found.stems.size();

  // Stem positions: where the axes meet the terrain
  auto stems = merge_fragments(std::move(found), understory, map.terrain, options.stems.cylinder);
  refit_with_common_taper(stems, understory, map.terrain, map.distance_tolerance, options.stems.cylinder,
                          exec);
  map.stems = locate_stems(stems, understory, map.terrain, exec);
  map.funnel.stems = map.stems.size();
  map.upright = upright_of(axes_of(map.stems));
  collect_samples(stems, understory, map, exec);
  return map;
}
}  // namespace detail

/// Whether the scan was clearly not level: its stems stand askew to the `up` that the caller gave.
inline bool is_tilted(const stem_map& map) {
  return map.upright && detail::is_tilted(*map.upright, map.given_up);
}

/// What of it, for people, and the remedy: "stand 8.1 degrees off the vertical ...".
inline std::string describe_tilt(const stem_map& map) {
  const int tenths =
      int(std::lround(detail::angle_between(map.upright->up, map.given_up) * 1800 / std::numbers::pi));
  return "stand " + std::to_string(tenths / 10) + "." + std::to_string(tenths % 10) +
         " degrees off the vertical" + (map.up_by_stems ? ", which is taken from them instead" : "") +
         "; a scan that was not level should turn freely (dof 6)";
}

namespace detail {
/// Takes the vertical from the stems. Where that is so far off the given one that stems were lost, the scan
/// is mapped once more.
template <point_range R>
void take_vertical_from_stems(const R& scan, const mapping_options& options, stem_map& map,
                              const execution& exec) {
  constexpr double all_found = 15 * std::numbers::pi / 180;  // [rad] half of what stems may lean
  if (angle_between(map.upright->up, map.up) > all_found) {
    const Eigen::Vector3d given = map.given_up, first = map.upright->up;
    map = detail::map_stems(scan, options, first, exec);
    map.given_up = given;
  }
  if (map.upright) map.up = map.upright->up;
  map.up_by_stems = true;
}
}  // namespace detail

/// Maps the stems of a scan. `up` points away from the ground, in the frame of the scan. The caller's points
/// are read in two forward passes, in four where the vertical is taken from the stems and far off. No stems
/// is an answer: the funnel then tells where they were lost. Throws `std::invalid_argument` naming a bad
/// option. Cost: linear in the points, n log n in the understory.
template <point_range R>
stem_map map_stems(const R& scan, const mapping_options& options = {},
                   const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ(), const execution& exec = {}) {
  require_valid(options);
  try {
    stem_map map = detail::map_stems(scan, options, up, exec);
    const bool wanted = options.vertical == vertical_rule::stems ||
                        (options.vertical == vertical_rule::stems_if_tilted && is_tilted(map));
    if (wanted && map.upright) detail::take_vertical_from_stems(scan, options, map, exec);
    return map;
  } catch (const operation_cancelled&) {
    stem_map map;
    map.cancelled = true;
    return map;
  }
}
}  // namespace globalmatch
