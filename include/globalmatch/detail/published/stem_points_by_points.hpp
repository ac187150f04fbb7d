// Stem points as [GM] 3.1 has them: one point a voxel, a normal for each.
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/local_points.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "globalmatch/detail/mapping/cell_sorter.hpp"
#include "globalmatch/detail/mapping/column_search.hpp"
#include "globalmatch/detail/mapping/stem_points.hpp"
#include "globalmatch/detail/published/cylinder_ransac.hpp"
#include "globalmatch/detail/published/point_clusters.hpp"
#include "globalmatch/detail/published/point_verticality.hpp"
#include "globalmatch/detail/published/voxel_grid.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/mapping_options.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

/// Clusters of the vertical points; members are positions in the understory.
inline point_clusters cluster_stem_points(const local_points& understory,
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

/// RANSAC over the points of a column and their normals.
inline std::optional<cylinder> fit_by_normals(const cylinder_fitter& fitter, const column_sample& column,
                                              const cylinder_options& options, random_source& random) {
  std::vector<vec3> normals;
  for (const point_index i : column.members) normals.push_back(vec3(fitter.normals[i]));
  return fit_cylinder(column.points, normals, options, random);
}

/// Stem points by the surfaces through points. Counts them in the map's funnel.
inline stem_points stem_points_by_points(parted_points parts, const mapping_options& options,
                                         stem_map& map, const execution& exec) {
  const local_points understory = join_parts(std::move(parts), map.terrain.frame, "understory", exec);
  local_points thinned = select(understory, thin_by_voxels(understory, options.voxel_size, exec));
  stem_points found{sort_into_cells(std::move(thinned), cell_width, exec), {}, &fit_by_normals};
  const local_points& points = found.understory.points();
  const auto surfaces = estimate_surfaces(points, options.verticality, exec);
  const auto vertical = select_stem_points(surfaces, options.verticality);
  found.clusters = cluster_stem_points(points, surfaces, vertical, options, exec);
  std::vector<float> spacings;
  for (const local_surface& s : surfaces) {
    found.normals.push_back(s.normal);
    spacings.push_back(s.spacing);
  }
  map.funnel.by_cells = false;
  map.funnel.thinned = points.size();
  map.funnel.stem_points = vertical.size();
  record_spacing(std::move(spacings), map);
  return found;
}

}  // namespace globalmatch::detail
