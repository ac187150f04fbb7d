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

/// Maps of so many stems are searched exhaustively (ours) ...
inline constexpr std::size_t exhaustive_max_stems = 100;
/// ... and those of so many when nothing else was found (ours).
inline constexpr std::size_t retry_max_stems = 300;

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
/// some of its own. `exhaustive`: small maps get as many triangles as maps need that share only few stems.
inline prepared_stems prepare_stems(position_set stems, bool horizontal_distances, const execution& exec,
                                    std::size_t min_queried = 0, bool exhaustive = true) {
  constexpr std::size_t target_neighbors = 5;      // stems around each that make triangles (ours)
  constexpr std::size_t sufficient_stems = 20000;  // of larger maps, share enough triangles (ours)
  prepared_stems map = without_triangles(std::move(stems), horizontal_distances, exec);
  const std::size_t neighbors =
      exhaustive && map.stems.size() <= exhaustive_max_stems ? exhaustive_neighbors : target_neighbors;
  const std::size_t step =
      std::max<std::size_t>(1, std::min(min_queried, map.stems.size()) / sufficient_stems);
  map.triangles = triangle_index(map.stems, *map.index, horizontal_distances, neighbors, exec, step);
  return map;
}

}  // namespace globalmatch::detail
