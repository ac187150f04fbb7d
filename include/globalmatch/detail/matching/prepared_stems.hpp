// A stem map that others are matched against: its stems, and what is looked up in them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <utility>

#include "globalmatch/detail/core/position_index.hpp"
#include "globalmatch/detail/matching/background_density.hpp"
#include "globalmatch/detail/matching/triangle_index.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/positions.hpp"

namespace globalmatch::detail {

/// In space maps of so many stems are searched exhaustively (ours) ...
inline constexpr std::size_t exhaustive_max_stems = 100;
/// ... and those of so many when nothing else was found; in plan more triangles of these vote (ours).
inline constexpr std::size_t retry_max_stems = 300;

/// Stems around each that make triangles, where maps are large (ours).
inline constexpr std::size_t target_neighbors = 5;

/// Of a map of so many stems every so manyth one makes triangles (ours).
inline std::size_t triangle_step(std::size_t stems) {
  constexpr std::size_t sufficient = 20000;  // of larger maps, share enough triangles
  return std::max<std::size_t>(1, stems / sufficient);
}

/// Immutable once made; owns its data; may be shared by threads.
struct prepared_stems {
  position_set stems;
  std::shared_ptr<const position_index> index;
  std::shared_ptr<const background_density> background;
  triangle_index triangles;
  bool horizontal_distances = true;  ///< edges of the triangles are horizontal
};

inline prepared_stems without_triangles(position_set stems, bool horizontal_distances,
                                        const execution& exec) {
  prepared_stems map{std::move(stems), nullptr, nullptr, {}, horizontal_distances};
  map.index = std::make_shared<position_index>(map.stems, exec);
  map.background = std::make_shared<background_density>(map.stems, map.index);
  return map;
}

/// `min_queried`: maps that are matched against it have so many stems or more, and find the triangles of only
/// some of its own. `exhaustive`: in space small maps get as many triangles as maps need that share only few
/// stems.
inline prepared_stems prepare_stems(position_set stems, bool horizontal_distances, const execution& exec,
                                    std::size_t min_queried = 0, bool exhaustive = true) {
  prepared_stems map = without_triangles(std::move(stems), horizontal_distances, exec);
  exhaustive = exhaustive && !horizontal_distances && map.stems.size() <= exhaustive_max_stems;
  const std::size_t neighbors = exhaustive ? exhaustive_neighbors : target_neighbors;
  map.triangles = triangle_index(map.stems, *map.index, horizontal_distances, neighbors, exec,
                                 triangle_step(std::min(min_queried, map.stems.size())));
  return map;
}

}  // namespace globalmatch::detail
