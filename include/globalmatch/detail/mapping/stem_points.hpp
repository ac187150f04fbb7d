// Stem points ([GM] 3.1): what is vertical in the understory, in clusters.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/local_points.hpp"
#include "globalmatch/detail/mapping/cell_columns.hpp"
#include "globalmatch/detail/mapping/cell_sorter.hpp"
#include "globalmatch/detail/mapping/clusters.hpp"
#include "globalmatch/detail/mapping/column_search.hpp"
#include "globalmatch/detail/mapping/understory.hpp"
#include "globalmatch/detail/mapping/verticality.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/mapping_options.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

constexpr double cell_width = 0.05;  // [m] of the understory: 27 cells are nearly [GM]'s ball of 10 cm

/// The understory in cells, the clusters of what is vertical in it, and how cylinders are fitted to them.
struct stem_points {
  cell_columns understory;
  point_clusters clusters;
  decltype(cylinder_fitter::fit) fit = &fit_along_line;
  std::vector<vec3f> normals = {};  ///< of the understory, where the fit takes them

  cylinder_fitter fitter() const { return {fit, normals}; }
};

/// Notes how far points on surfaces are apart: the first and the last decile. Positive ones count.
inline void record_spacing(std::vector<float> spacings, stem_map& map) {
  std::erase_if(spacings, [](float spacing) { return !(spacing > 0); });
  if (spacings.empty()) return;
  const auto at = [&](double share) {
    return spacings.begin() + std::ptrdiff_t(share * double(spacings.size() - 1));
  };
  std::nth_element(spacings.begin(), at(0.9), spacings.end());
  map.spacing_far = *at(0.9);
  std::nth_element(spacings.begin(), at(0.1), at(0.9) + 1);
  map.spacing_near = *at(0.1);
}

/// Stem points by the surfaces through cells. Counts them in the map's funnel.
inline stem_points stem_points_by_cells(parted_points understory, const mapping_options& options,
                                        stem_map& map, const execution& exec) {
  stem_points found{cell_sorter(std::move(understory), map.terrain.frame, cell_width).sorted(exec), {}};
  const auto surfaces = estimate_surfaces(found.understory, options.verticality, exec);
  found.clusters = cluster_cells(found.understory, surfaces, options.verticality,
                                 std::size_t(options.stems.min_points), exec);
  map.funnel.thinned = surfaces.size();
  std::vector<float> spacings;
  spacings.reserve(surfaces.size());
  for (const cell_surface& s : surfaces) {
    map.funnel.stem_points += is_stem_cell(s, options.verticality);
    spacings.push_back(s.spacing);
  }
  record_spacing(std::move(spacings), map);
  return found;
}

}  // namespace globalmatch::detail
