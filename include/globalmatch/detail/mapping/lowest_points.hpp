// The lowest point of every cell of a plan raster: all that the ground model keeps of a scan.
// In: points of a scan, one forward pass. Out: `lowest_raster`. Memory linear in the area that holds points.
#pragma once


#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/local_frame.hpp"
#include "globalmatch/detail/core/local_points.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

/// In place of a point where there is none.
inline constexpr vec3f no_point(std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::quiet_NaN(),
                                std::numeric_limits<float>::quiet_NaN());

/// Each node of the terrain covers 2 x 2 cells of the lowest points.
constexpr int lowest_cells_a_node = 2;

/// The lowest point of each cell, NaN where a cell is empty. Coordinates [m] in `frame`, whose origin is the
/// raster's corner.
struct lowest_raster {
  local_frame frame;
  double resolution = 0;  ///< [m]
  int columns = 0, rows = 0;
  std::vector<vec3f> points;  ///< row by row

  std::size_t cell(int c, int r) const { return std::size_t(r) * std::size_t(columns) + std::size_t(c); }
  bool holds(int c, int r) const {
    return c >= 0 && r >= 0 && c < columns && r < rows && !std::isnan(points[cell(c, r)].z);
  }
};

/// Plan raster in sparse tiles, since a scan may have outliers a million metres away.
class tiled_minima {
 public:
  static constexpr int tile_cells = 32;
  static constexpr double beyond_any_plot = 1e11;  // [m] from the first point; keeps keys and heights exact
  struct lowest {
    double z = std::numeric_limits<double>::infinity();
    float x = 0, y = 0;  // from the corner of the tile
    bool empty() const { return std::isinf(z); }
    /// Equally low points are told apart by their place, so that the order of points does not matter.
    bool operator<(const lowest& o) const { return std::tie(z, x, y) < std::tie(o.z, o.x, o.y); }
  };
  static constexpr std::size_t cells_a_tile = tile_cells * tile_cells;
  /// Cells row by row.
  struct tile {
    std::array<lowest, cells_a_tile> cells;
    std::array<float, cells_a_tile> rounded;  // their heights: most points are told by these
    tile() { rounded.fill(std::numeric_limits<float>::infinity()); }
    void take_lower(const tile& other) {
      for (std::size_t i = 0; i < cells_a_tile; ++i)
        if (other.cells[i] < cells[i]) cells[i] = other.cells[i];
    }
  };
  using key = std::pair<std::int64_t, std::int64_t>;  // (row, column) of the tile
  using tile_map = std::map<key, std::unique_ptr<tile>>;

  explicit tiled_minima(double resolution)
      : per_cell_(1 / resolution),
        tile_size_(resolution * tile_cells),
        near_(near_tiles * near_tiles + 1, &none_) {}
  tiled_minima(const tiled_minima&) = delete;
  tiled_minima& operator=(const tiled_minima&) = delete;

  const tile_map& tiles() const { return tiles_; }

  /// False also for what is not a number.
  static bool within_range(const vec3& p) {
    return std::abs(p.x) < beyond_any_plot && std::abs(p.y) < beyond_any_plot &&
           std::abs(p.z) < beyond_any_plot;
  }

  static constexpr std::size_t batch_size = 256;
  /// At most a batch of points. Returns how many are of no plot.
  std::size_t add(std::span<const vec3> points) {
    std::array<place, batch_size> places;
    std::array<unsigned, batch_size> candidates;
    for (std::size_t i = 0; i < points.size(); ++i) places[i] = place_of(points[i]);
    std::size_t count = 0, lost = 0;
    // Without branches, which nobody could foretell. What is not a number is no higher than anything.
    for (unsigned i = 0; i < points.size(); ++i) {
      candidates[count] = i;
      count += !(float(points[i].z) > near_[places[i].tile]->rounded[places[i].cell]);
    }
    for (std::size_t k = 0; k < count; ++k)
      if (!keep(points[candidates[k]], places[candidates[k]])) ++lost;
    return lost;
  }

 private:
  static constexpr unsigned near_tiles = 128;  // along and across, around the first point
  static constexpr unsigned elsewhere = near_tiles * near_tiles;
  struct place {
    unsigned tile, cell;
  };

  place place_of(const vec3& p) const {
    constexpr double middle = near_tiles / 2 * tile_cells, all = near_tiles * tile_cells;
    const double gx = p.x * per_cell_ + middle, gy = p.y * per_cell_ + middle;
    const bool near = (gx >= 0) & (gx < all) & (gy >= 0) & (gy < all) & (std::abs(p.z) < beyond_any_plot);
    if (!near) return {elsewhere, 0};
    const auto c = static_cast<unsigned>(static_cast<int>(gx)),
               r = static_cast<unsigned>(static_cast<int>(gy));
    return {r / tile_cells * near_tiles + c / tile_cells, r % tile_cells * tile_cells + c % tile_cells};
  }
  bool keep(const vec3& p, const place& at) {
    if (at.tile == elsewhere) return keep_far(p);
    const key k{int(at.tile / near_tiles) - int(near_tiles / 2),
                int(at.tile % near_tiles) - int(near_tiles / 2)};
    if (near_[at.tile] == &none_) near_[at.tile] = &tile_at(k);
    keep_in(*near_[at.tile], k, at.cell, p);
    return true;
  }
  bool keep_far(const vec3& p) {
    if (!within_range(p)) return false;
    const key k{std::int64_t(std::floor(p.y / tile_size_)), std::int64_t(std::floor(p.x / tile_size_))};
    const auto cell = [&](double v, std::int64_t t) {
      return std::clamp(static_cast<int>((v - double(t) * tile_size_) * per_cell_), 0, tile_cells - 1);
    };
    keep_in(tile_at(k), k, std::size_t(cell(p.y, k.first) * tile_cells + cell(p.x, k.second)), p);
    return true;
  }
  void keep_in(tile& t, const key& k, std::size_t cell, const vec3& p) const {
    const lowest candidate{p.z, float(p.x - double(k.second) * tile_size_),
                           float(p.y - double(k.first) * tile_size_)};
    if (!(candidate < t.cells[cell])) return;
    t.cells[cell] = candidate;
    t.rounded[cell] = float(p.z);
  }
  tile& tile_at(const key& k) {
    std::unique_ptr<tile>& found = tiles_[k];
    if (!found) found = std::make_unique<tile>();
    return *found;
  }

  double per_cell_, tile_size_;
  tile_map tiles_;
  tile none_;                // where no point was yet, and elsewhere
  std::vector<tile*> near_;  // found without a search
};

/// A tile with what all threads found.
struct gathered_tile {
  tiled_minima::key key;
  tiled_minima::tile* minima = nullptr;
  std::size_t occupied = 0;  // cells
  double lowest = 0;
};

/// The group of adjoining tiles that holds most cells: what the scan is of. `tiles` are sorted by key.
inline std::vector<std::size_t> main_group(const std::vector<gathered_tile>& tiles) {
  const auto find = [&](const tiled_minima::key& k) {
    const auto at = std::lower_bound(tiles.begin(), tiles.end(), k,
                                     [](const gathered_tile& t, const auto& key) { return t.key < key; });
    return at != tiles.end() && at->key == k ? std::size_t(at - tiles.begin()) : tiles.size();
  };
  std::vector<bool> visited(tiles.size() + 1, false);
  visited.back() = true;  // no tile
  std::vector<std::size_t> best;
  std::size_t best_count = 0;
  for (std::size_t first = 0; first < tiles.size(); ++first) {
    if (visited[first]) continue;
    std::vector<std::size_t> group{first};
    visited[first] = true;
    std::size_t count = 0;
    for (std::size_t i = 0; i < group.size(); ++i) {
      const auto [row, column] = tiles[group[i]].key;
      count += tiles[group[i]].occupied;
      for (int dr = -1; dr <= 1; ++dr)
        for (int dc = -1; dc <= 1; ++dc)
          if (const std::size_t next = find({row + dr, column + dc}); !visited[next]) {
            visited[next] = true;
            group.push_back(next);
          }
    }
    if (count > best_count) {
      best_count = count;
      best = std::move(group);
    }
  }
  return best;
}

/// The first point of a scan that may be of a plot.
template <point_range R>
std::optional<vec3> first_within_range(const R& scan) {
  for (const auto& p : scan)
    if (const vec3 v = xyz(p); tiled_minima::within_range(v)) return v;
  return std::nullopt;
}

/// Puts together what threads found, in the tiles of one of them; by key.
inline std::vector<gathered_tile> merge_tiles(const std::vector<std::unique_ptr<tiled_minima>>& rasters,
                                              const execution& exec) {
  std::map<tiled_minima::key, std::vector<tiled_minima::tile*>> parts;
  for (const auto& raster : rasters)
    for (const auto& [key, tile] : raster->tiles()) parts[key].push_back(tile.get());
  std::vector<gathered_tile> tiles;
  for (const auto& part : parts) tiles.push_back({part.first, part.second.front()});
  parallel_for(
      exec, "ground", tiles.size(),
      [&](std::size_t i) {
        gathered_tile& gathered = tiles[i];
        const auto& of_threads = parts.at(gathered.key);
        for (std::size_t k = 1; k < of_threads.size(); ++k) gathered.minima->take_lower(*of_threads[k]);
        const auto& cells = gathered.minima->cells;
        gathered.occupied =
            std::size_t(std::count_if(cells.begin(), cells.end(), [](const auto& c) { return !c.empty(); }));
        gathered.lowest = std::min_element(cells.begin(), cells.end())->z;
      },
      8);
  return tiles;
}

/// Gathers the lowest points in one forward pass over the scan, in a frame levelled by `up`; parts of the
/// scan that lie apart (more than a tile of 32 cells from the rest) are left out and counted. An empty raster
/// if no point is finite. Cost: linear; parallel where the range gives random access.
template <point_range R>
lowest_raster gather_lowest_points(const R& scan, double resolution, const vec3& up,
                                   ground_funnel& funnel, const execution& exec = {}) {
  lowest_raster raster;
  raster.frame.rotation = levelling_rotation(up);
  raster.resolution = resolution;
  funnel = {};
  raster.frame.origin = first_within_range(scan).value_or(vec3{});

  // Whoever works on a chunk borrows a raster: there are no more of them than threads.
  std::vector<std::unique_ptr<tiled_minima>> idle;
  std::mutex door;
  read_in_chunks(
      scan, exec, "ground", [](std::size_t) {},
      [&](std::size_t, const auto& visit_points) {
        std::unique_ptr<tiled_minima> minima;
        {
          const std::lock_guard lock(door);
          if (!idle.empty()) {
            minima = std::move(idle.back());
            idle.pop_back();
          }
        }
        if (!minima) minima = std::make_unique<tiled_minima>(resolution);
        std::array<vec3, tiled_minima::batch_size> batch;
        std::size_t in_batch = 0, points = 0, lost = 0;
        const auto hand_over = [&] {
          lost += minima->add({batch.data(), in_batch});
          points += std::exchange(in_batch, 0);
        };
        visit_points([&](const vec3& p, point_index) {
          batch[in_batch++] = raster.frame.to_local(p);
          if (in_batch == batch.size()) hand_over();
        });
        hand_over();
        const std::lock_guard lock(door);
        funnel.points += points;
        funnel.not_finite += lost;
        idle.push_back(std::move(minima));
      });

  const auto tiles = merge_tiles(idle, exec);
  const auto group = main_group(tiles);
  for (const auto& t : tiles) funnel.cells += t.occupied;
  funnel.cells_apart = funnel.cells;
  if (group.empty()) return raster;
  tiled_minima::key low = tiles[group.front()].key, high = low;  // (row, column)
  std::vector<double> heights;                                   // the lowest of each tile
  for (const std::size_t i : group) {
    const auto [row, column] = tiles[i].key;
    low = {std::min(low.first, row), std::min(low.second, column)};
    high = {std::max(high.first, row), std::max(high.second, column)};
    funnel.cells_apart -= tiles[i].occupied;
    heights.push_back(tiles[i].lowest);
  }

  // Whole metres above the first point: a shifted scan then gives the same local coordinates, bit for bit.
  const double tile_size = resolution * tiled_minima::tile_cells;
  const vec3 corner{double(low.second) * tile_size, double(low.first) * tile_size,
                    std::floor(upper_median(heights))};
  raster.frame.origin = raster.frame.to_scan(corner);
  raster.columns = int(high.second - low.second + 1) * tiled_minima::tile_cells;
  raster.rows = int(high.first - low.first + 1) * tiled_minima::tile_cells;
  raster.points.resize(std::size_t(raster.columns) * std::size_t(raster.rows));
  parallel_for(
      exec, "ground", raster.points.size(),
      [&](std::size_t i) { raster.points[i] = no_point; }, 1 << 14);
  parallel_for(
      exec, "ground", group.size(),
      [&](std::size_t g) {
        const auto& [k, tile] = std::tie(tiles[group[g]].key, *tiles[group[g]].minima);
        const vec3 tile_corner{double(k.second - low.second) * tile_size,
                               double(k.first - low.first) * tile_size, -corner.z};
        for (int i = 0; i < tiled_minima::tile_cells * tiled_minima::tile_cells; ++i) {
          const auto& lowest = tile.cells[std::size_t(i)];
          if (lowest.empty()) continue;
          const int r = int(k.first - low.first) * tiled_minima::tile_cells + i / tiled_minima::tile_cells;
          const int c = int(k.second - low.second) * tiled_minima::tile_cells + i % tiled_minima::tile_cells;
          raster.points[raster.cell(c, r)] =
              vec3f(tile_corner + vec3{lowest.x, lowest.y, lowest.z});
        }
      },
      16);
  return raster;
}

}  // namespace globalmatch::detail
