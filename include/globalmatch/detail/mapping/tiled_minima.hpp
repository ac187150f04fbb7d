// The lowest point of each cell of a plan raster, in sparse tiles: a scan may have outliers a million metres
// away. In: points, in batches. Out: tiles. Memory linear in the area that holds points.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "globalmatch/detail/core/vectors.hpp"

namespace globalmatch::detail {

class tiled_minima {
 public:
  static constexpr int tile_cells = 32;
  static constexpr double beyond_any_plot = 1e11;  // [m] from the first point; keeps keys and heights exact
  struct lowest {
    double z = std::numeric_limits<double>::infinity();
    float x = 0, y = 0;  // from the corner of the tile
    bool empty() const { return std::isinf(z); }
  };
  static constexpr std::size_t cells_a_tile = tile_cells * tile_cells;
  /// Number of a tile.
  struct key {
    std::int64_t row = 0, column = 0;
    bool operator==(const key& o) const { return row == o.row && column == o.column; }
    bool operator<(const key& o) const { return row != o.row ? row < o.row : column < o.column; }
  };
  /// Cells row by row, in 16 bytes each: those of a large scan are the most that mapping keeps.
  class tile {
   public:
    key at;

    tile() { heights_.fill(std::numeric_limits<float>::infinity()); }
    lowest operator[](std::size_t cell) const {
      const rest_of_lowest& r = rest_[cell];
      return {double(heights_[cell]) + double(r.height), r.x, r.y};
    }
    /// Whether a height is above the one kept, both rounded: most points are decided by this. False for what
    /// is not a number.
    bool is_below(std::size_t cell, double z) const { return float(z) > heights_[cell]; }
    /// Keeps a point in a cell if it is lower; its height to 48 bits.
    void keep(std::size_t cell, const lowest& p) {
      const auto rounded = float(p.z);
      keep(cell, rounded, {float(p.z - double(rounded)), p.x, p.y});
    }
    void take_lower(const tile& other) {
      for (std::size_t i = 0; i < cells_a_tile; ++i) keep(i, other.heights_[i], other.rest_[i]);
    }

   private:
    /// Equally low points are ordered by their place, so that the order of points does not matter.
    struct rest_of_lowest {
      float height = 0;  // what rounding took
      float x = 0, y = 0;
      bool operator<(const rest_of_lowest& o) const {
        return height != o.height ? height < o.height : x != o.x ? x < o.x : y < o.y;
      }
    };
    void keep(std::size_t cell, float height, const rest_of_lowest& rest) {
      if (!(height < heights_[cell] || (height == heights_[cell] && rest < rest_[cell]))) return;
      heights_[cell] = height;
      rest_[cell] = rest;
    }
    std::array<float, cells_a_tile> heights_;  // rounded
    std::array<rest_of_lowest, cells_a_tile> rest_;
  };

  explicit tiled_minima(double resolution)
      : per_cell_(1 / resolution),
        tile_size_(resolution * tile_cells),
        near_(near_tiles * near_tiles + 1, &none_) {}
  tiled_minima(const tiled_minima&) = delete;
  tiled_minima& operator=(const tiled_minima&) = delete;

  const std::vector<tile*>& tiles() const { return tiles_; }

  /// False also for what is not a number.
  static bool is_within_range(const vec3& p) {
    return std::abs(p.x) < beyond_any_plot && std::abs(p.y) < beyond_any_plot &&
           std::abs(p.z) < beyond_any_plot;
  }

  static constexpr std::size_t batch_size = 256;
  /// At most a batch of points. Returns how many are out of range.
  std::size_t add(std::span<const vec3> points) {
    std::array<place, batch_size> places;
    std::array<unsigned, batch_size> candidates;
    for (std::size_t i = 0; i < points.size(); ++i) places[i] = place_of(points[i]);
    std::size_t count = 0, out_of_range = 0;
    // Without branches, which are unpredictable. What is not a number is no higher than anything.
    for (unsigned i = 0; i < points.size(); ++i) {
      candidates[count] = i;
      count += !near_[places[i].tile]->is_below(places[i].cell, points[i].z);
    }
    for (std::size_t k = 0; k < count; ++k)
      if (!keep(points[candidates[k]], places[candidates[k]])) ++out_of_range;
    return out_of_range;
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
    if (near_[at.tile] == &none_)
      near_[at.tile] = &tile_at(
          {int(at.tile / near_tiles) - int(near_tiles / 2), int(at.tile % near_tiles) - int(near_tiles / 2)});
    keep_in(*near_[at.tile], at.cell, p);
    return true;
  }
  bool keep_far(const vec3& p) {
    if (!is_within_range(p)) return false;
    const key k{std::int64_t(std::floor(p.y / tile_size_)), std::int64_t(std::floor(p.x / tile_size_))};
    const auto cell = [&](double v, std::int64_t t) {
      return std::clamp(static_cast<int>((v - double(t) * tile_size_) * per_cell_), 0, tile_cells - 1);
    };
    keep_in(tile_at(k), std::size_t(cell(p.y, k.row) * tile_cells + cell(p.x, k.column)), p);
    return true;
  }
  void keep_in(tile& t, std::size_t cell, const vec3& p) const {
    t.keep(cell,
           {p.z, float(p.x - double(t.at.column) * tile_size_), float(p.y - double(t.at.row) * tile_size_)});
  }
  tile& tile_at(const key& k) {
    std::size_t slot = find(k);
    if (slots_[slot] == 0) {
      if (tiles_.size() * 2 >= slots_.size()) {
        slots_.assign(slots_.size() * 2, 0);
        for (std::size_t i = 0; i < tiles_.size(); ++i)
          slots_[find(tiles_[i]->at)] = static_cast<std::uint32_t>(i + 1);
        slot = find(k);
      }
      tiles_.push_back(&new_tile());
      tiles_.back()->at = k;
      slots_[slot] = static_cast<std::uint32_t>(tiles_.size());
    }
    return *tiles_[slots_[slot] - 1];
  }
  /// In blocks of 33 MB, of which only what is used takes memory: allocators return these at once.
  tile& new_tile() {
    constexpr std::size_t tiles_a_block = 2048;
    if (tiles_.size() % tiles_a_block == 0) blocks_.emplace_back().reserve(tiles_a_block);
    return blocks_.back().emplace_back();
  }
  /// The slot that a tile has, or would take.
  std::size_t find(const key& k) const {
    const std::uint64_t mixed =
        (std::uint64_t(k.row) * 0x9e3779b97f4a7c15u ^ std::uint64_t(k.column)) * 0xbf58476d1ce4e5b9u;
    std::size_t slot = std::size_t(mixed >> 32) & (slots_.size() - 1);
    while (slots_[slot] != 0 && !(tiles_[slots_[slot] - 1]->at == k)) slot = (slot + 1) & (slots_.size() - 1);
    return slot;
  }

  double per_cell_, tile_size_;
  std::vector<std::vector<tile>> blocks_;
  std::vector<tile*> tiles_;
  std::vector<std::uint32_t> slots_ =
      std::vector<std::uint32_t>(256, 0);  // hash table: 1 + place in `tiles_`
  tile none_;                              // where no point was yet, and elsewhere
  std::vector<tile*> near_;                // found without a search
};

}  // namespace globalmatch::detail
