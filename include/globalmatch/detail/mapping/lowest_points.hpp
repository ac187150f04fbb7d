// The lowest point of every cell of a plan raster: all that the ground model keeps of a scan.
// In: points of a scan, one forward pass. Out: `lowest_raster`. Memory linear in the area that holds points.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/local_frame.hpp"
#include "globalmatch/detail/core/local_points.hpp"
#include "globalmatch/detail/core/per_thread.hpp"
#include "globalmatch/detail/core/sort_by_key.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/detail/mapping/low_noise.hpp"
#include "globalmatch/detail/mapping/lowest_raster.hpp"
#include "globalmatch/detail/mapping/tiled_minima.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

/// What a thread gathers of a scan.
struct lowest_gathering {
  explicit lowest_gathering(double resolution) : minima(resolution) {}

  tiled_minima minima;
  sampled_points sample;
  std::size_t points = 0, out_of_range = 0, low = 0;
};

/// A tile with what all threads found.
struct gathered_tile {
  tiled_minima::tile* minima = nullptr;
  std::size_t occupied = 0;  // cells
  double lowest = 0;

  const tiled_minima::key& key() const { return minima->at; }
};

/// Merges what threads found, into tiles of some of them; sorted by key.
inline std::vector<gathered_tile> merge_tiles(
    const std::vector<std::unique_ptr<lowest_gathering>>& of_threads, const execution& exec) {
  std::vector<tiled_minima::tile*> all;
  for (const auto& own : of_threads)
    all.insert(all.end(), own->minima.tiles().begin(), own->minima.tiles().end());
  std::vector<keyed_place> order(all.size()), spare;
  constexpr auto offset = std::uint64_t(1) << 63;  // negative numbers first
  for (std::size_t i = 0; i < all.size(); ++i)
    order[i] = {std::uint64_t(all[i]->at.column) + offset, static_cast<std::uint32_t>(i)};
  sort_by_key(order, spare);
  for (keyed_place& o : order) o.key = std::uint64_t(all[o.place]->at.row) + offset;
  sort_by_key(order, spare);

  std::vector<std::size_t> first;  // of the tiles with the same key
  for (std::size_t i = 0; i < order.size(); ++i)
    if (i == 0 || !(all[order[i].place]->at == all[order[i - 1].place]->at)) first.push_back(i);
  first.push_back(order.size());
  std::vector<gathered_tile> tiles(first.size() - 1);
  parallel_for(
      exec, "ground", tiles.size(),
      [&](std::size_t t) {
        gathered_tile& gathered = tiles[t];
        gathered.minima = all[order[first[t]].place];
        for (std::size_t k = first[t] + 1; k < first[t + 1]; ++k)
          gathered.minima->take_lower(*all[order[k].place]);
        gathered.lowest = std::numeric_limits<double>::infinity();
        for (std::size_t i = 0; i < tiled_minima::cells_a_tile; ++i) {
          const tiled_minima::lowest cell = (*gathered.minima)[i];
          gathered.occupied += !cell.empty();
          gathered.lowest = std::min(gathered.lowest, cell.z);
        }
      },
      8);
  return tiles;
}

/// The group of adjoining tiles that holds most cells: what the scan is of. `tiles` are sorted by key.
inline std::vector<std::size_t> main_group(const std::vector<gathered_tile>& tiles) {
  const auto find = [&](const tiled_minima::key& k) {
    const auto at = std::lower_bound(tiles.begin(), tiles.end(), k,
                                     [](const gathered_tile& t, const auto& key) { return t.key() < key; });
    return at != tiles.end() && at->key() == k ? std::size_t(at - tiles.begin()) : tiles.size();
  };
  std::vector<std::uint8_t> visited(tiles.size() + 1, 0);
  visited.back() = 1;  // no tile
  std::vector<std::size_t> best;
  std::size_t best_count = 0;
  for (std::size_t first = 0; first < tiles.size(); ++first) {
    if (visited[first]) continue;
    std::vector<std::size_t> group{first};
    visited[first] = 1;
    std::size_t count = 0;
    for (std::size_t i = 0; i < group.size(); ++i) {
      const tiled_minima::key at = tiles[group[i]].key();
      count += tiles[group[i]].occupied;
      for (int neighbor = 0; neighbor < 9; ++neighbor) {
        const std::size_t next = find({at.row + neighbor / 3 - 1, at.column + neighbor % 3 - 1});
        if (std::exchange(visited[next], std::uint8_t(1)) == 0) group.push_back(next);
      }
    }
    if (count > best_count) {
      best_count = count;
      best = std::move(group);
    }
  }
  return best;
}

/// The raster of the main group of tiles. `frame` is that of the tiles; counts cells.
inline lowest_raster make_raster(const std::vector<gathered_tile>& tiles, const local_frame& frame,
                                 double resolution, ground_funnel& funnel, const execution& exec) {
  constexpr int tile_cells = tiled_minima::tile_cells;
  lowest_raster raster{frame, resolution, 0, 0, {}};
  const auto group = main_group(tiles);
  for (const gathered_tile& t : tiles) funnel.cells += t.occupied;
  funnel.cells_apart = funnel.cells;
  if (group.empty()) return raster;
  tiled_minima::key low = tiles[group.front()].key(), high = low;
  std::vector<double> heights;  // the lowest of each tile
  for (const std::size_t i : group) {
    const tiled_minima::key& at = tiles[i].key();
    low = {std::min(low.row, at.row), std::min(low.column, at.column)};
    high = {std::max(high.row, at.row), std::max(high.column, at.column)};
    funnel.cells_apart -= tiles[i].occupied;
    heights.push_back(tiles[i].lowest);
  }

  // Whole metres above the first point: a shifted scan then gives the same local coordinates, bit for bit.
  const double tile_size = resolution * tile_cells, bottom = std::floor(upper_median(heights));
  raster.frame.origin = frame.to_scan({double(low.column) * tile_size, double(low.row) * tile_size, bottom});
  raster.columns = int(high.column - low.column + 1) * tile_cells;
  raster.rows = int(high.row - low.row + 1) * tile_cells;
  raster.points.assign(std::size_t(raster.columns) * std::size_t(raster.rows), no_point);
  parallel_for(
      exec, "ground", group.size(),
      [&](std::size_t g) {
        const tiled_minima::tile& tile = *tiles[group[g]].minima;
        const int column = int(tile.at.column - low.column), row = int(tile.at.row - low.row);
        const vec3 corner{column * tile_size, row * tile_size, -bottom};
        for (int i = 0; i < tile_cells * tile_cells; ++i) {
          const tiled_minima::lowest lowest = tile[std::size_t(i)];
          if (lowest.empty()) continue;
          raster
              .points[raster.cell(column * tile_cells + i % tile_cells, row * tile_cells + i / tile_cells)] =
              vec3f(corner + vec3{lowest.x, lowest.y, lowest.z});
        }
      },
      16);
  return raster;
}

/// Keeps all points of a scan.
struct keep_all {
  bool operator()(const vec3&) const { return true; }
};

/// Gathers the lowest points in one forward pass over the scan, in a frame levelled by `up`; parts of the
/// scan that lie apart (more than a tile of 32 cells from the rest) are left out and counted. An empty raster
/// if no point is finite. Points that `keep` does not hold for are left out and counted;
/// `sample` takes some points of each chunk. Cost: linear; parallel where the range gives random access.
template <point_range R, class Keep = keep_all>
lowest_raster gather_lowest_points(const R& scan, double resolution, const vec3& up, ground_funnel& funnel,
                                   const execution& exec = {}, const Keep& keep = {},
                                   scan_sample* sample = nullptr) {
  local_frame frame{{}, levelling_rotation(up)};
  funnel = {};
  for (const auto& p : scan)
    if (const vec3 v = xyz(p); tiled_minima::is_within_range(v)) {
      frame.origin = v;  // the first one
      break;
    }
  per_thread<lowest_gathering> gathered;
  const point_index index_bits = sample ? sample->one_in - 1 : 0;  // all 0 where sampled
  read_in_chunks(
      scan, exec, "ground", [](std::size_t) {},
      [&](std::size_t, const auto& visit_points) {
        std::unique_ptr<lowest_gathering> own = gathered.take(resolution);
        std::array<vec3, tiled_minima::batch_size> batch;
        std::size_t in_batch = 0, points = 0, low = 0;
        own->sample.begin_chunk();
        visit_points([&](const vec3& p, point_index i) {
          ++points;
          if (!keep(p)) {
            ++low;
            return;
          }
          if (sample && (i & index_bits) == 0) own->sample.push_back(p);
          batch[in_batch++] = frame.to_local(p);
          if (in_batch == batch.size())
            own->out_of_range += own->minima.add({batch.data(), std::exchange(in_batch, 0)});
        });
        own->out_of_range += own->minima.add({batch.data(), in_batch});
        own->points += points;
        own->low += low;
        gathered.give_back(std::move(own));
      });
  for (auto& own : gathered.all()) {
    funnel.points += own->points;
    funnel.low_points += own->low;
    funnel.not_finite += own->out_of_range;
    if (sample) sample->of_thread.push_back(std::move(own->sample));
  }
  return make_raster(merge_tiles(gathered.all(), exec), frame, resolution, funnel, exec);
}

}  // namespace globalmatch::detail
