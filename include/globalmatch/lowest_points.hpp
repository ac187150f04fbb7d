// The lowest point of every cell of a plan raster: all that the ground model keeps of a scan.
// In: points of a scan, one forward pass. Out: `lowest_raster`. Memory linear in the area that holds points.
#pragma once

#include <Eigen/Core>

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
#include <tuple>
#include <utility>
#include <vector>

#include "globalmatch/execution.hpp"
#include "globalmatch/local_points.hpp"
#include "globalmatch/points.hpp"

namespace globalmatch {

/// What became of the points on their way into the terrain.
struct ground_funnel {
  std::size_t points = 0;         ///< points of the scan
  std::size_t not_finite = 0;     ///< of these skipped: NaN, infinite, or further than any plot
  std::size_t cells = 0;          ///< raster cells that hold points
  std::size_t cells_apart = 0;    ///< of these left out: not connected to where most of the scan lies
  std::size_t low_outliers = 0;   ///< of these left out: their lowest point is a multipath return
  std::size_t unreachable = 0;    ///< of these left out: no ground is so steep
  std::size_t ground_points = 0;  ///< cell minima near the cloth
};

/// The lowest point of each cell, NaN where a cell is empty. Coordinates [m] in `frame`, whose origin is the
/// raster's corner.
struct lowest_raster {
  local_frame frame;
  double resolution = 0;  ///< [m]
  int columns = 0, rows = 0;
  std::vector<Eigen::Vector3f> points;  ///< row by row

  std::size_t cell(int c, int r) const { return std::size_t(r) * std::size_t(columns) + std::size_t(c); }
  bool holds(int c, int r) const {
    return c >= 0 && r >= 0 && c < columns && r < rows && !std::isnan(points[cell(c, r)].z());
  }
};

namespace detail {

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
  };
  using key = std::pair<std::int64_t, std::int64_t>;  // (row, column) of the tile

  explicit tiled_minima(double resolution)
      : per_cell_(1 / resolution), tile_size_(resolution * tile_cells), near_(near_tiles * near_tiles) {}

  double tile_size() const { return tile_size_; }
  const std::map<key, std::unique_ptr<tile>>& tiles() const { return tiles_; }

  static bool within_reach(const Eigen::Vector3d& p) { return p.cwiseAbs().maxCoeff() < beyond_any_plot; }

  /// False when the point is of no plot.
  bool add(const Eigen::Vector3d& p) {
    constexpr double middle = near_tiles / 2 * tile_cells, all = near_tiles * tile_cells;
    const double gx = p.x() * per_cell_ + middle, gy = p.y() * per_cell_ + middle;
    if (!(gx >= 0 && gx < all && gy >= 0 && gy < all && std::abs(p.z()) < beyond_any_plot)) return add_far(p);
    const auto c = static_cast<unsigned>(static_cast<int>(gx)),
               r = static_cast<unsigned>(static_cast<int>(gy));
    const unsigned column = c / tile_cells, row = r / tile_cells;
    tile*& found = near_[row * near_tiles + column];
    const key k{std::int64_t(row) - near_tiles / 2, std::int64_t(column) - near_tiles / 2};
    if (found == nullptr) found = &tile_at(k);
    const std::size_t cell = r % tile_cells * tile_cells + c % tile_cells;
    if (float(p.z()) <= found->rounded[cell]) keep(*found, cell, p, k);
    return true;
  }

  /// Takes over what is lower in another raster of the same frame and resolution.
  void merge(const tiled_minima& other) {
    for (const auto& [k, theirs] : other.tiles_) {
      tile& ours = tile_at(k);
      for (std::size_t i = 0; i < cells_a_tile; ++i)
        if (theirs->cells[i] < ours.cells[i]) ours.cells[i] = theirs->cells[i];
    }
  }

  static std::size_t occupied(const tile& t) {
    return std::size_t(
        std::count_if(t.cells.begin(), t.cells.end(), [](const lowest& c) { return !c.empty(); }));
  }

  /// The group of adjoining tiles that holds most cells: what the scan is of.
  std::vector<key> main_group() const {
    std::map<key, bool> seen;
    std::vector<key> best;
    std::size_t best_count = 0;
    for (const auto& entry : tiles_) {
      if (seen[entry.first]) continue;
      std::vector<key> group{entry.first};
      seen[entry.first] = true;
      std::size_t count = 0;
      for (std::size_t i = 0; i < group.size(); ++i) {
        const auto [row, column] = group[i];
        count += occupied(*tiles_.at(group[i]));
        for (int dr = -1; dr <= 1; ++dr)
          for (int dc = -1; dc <= 1; ++dc) {
            const key next{row + dr, column + dc};
            if (tiles_.contains(next) && !std::exchange(seen[next], true)) group.push_back(next);
          }
      }
      if (count > best_count) {
        best_count = count;
        best = std::move(group);
      }
    }
    return best;
  }

 private:
  static constexpr int near_tiles = 128;  // along and across, around the first point, found without a search

  tile& tile_at(const key& k) {
    std::unique_ptr<tile>& found = tiles_[k];
    if (!found) found = std::make_unique<tile>();
    return *found;
  }
  void keep(tile& t, std::size_t cell, const Eigen::Vector3d& p, const key& k) const {
    const lowest candidate{p.z(), float(p.x() - double(k.second) * tile_size_),
                           float(p.y() - double(k.first) * tile_size_)};
    if (!(candidate < t.cells[cell])) return;
    t.cells[cell] = candidate;
    t.rounded[cell] = float(p.z());
  }
  bool add_far(const Eigen::Vector3d& p) {
    if (!within_reach(p)) return false;
    const key k{std::int64_t(std::floor(p.y() / tile_size_)), std::int64_t(std::floor(p.x() / tile_size_))};
    const auto cell = [&](double v, std::int64_t t) {
      return std::clamp(static_cast<int>((v - double(t) * tile_size_) * per_cell_), 0, tile_cells - 1);
    };
    keep(tile_at(k), std::size_t(cell(p.y(), k.first) * tile_cells + cell(p.x(), k.second)), p, k);
    return true;
  }

  double per_cell_, tile_size_;
  std::map<key, std::unique_ptr<tile>> tiles_;
  std::vector<tile*> near_;
};

/// The first point of a scan that may be of a plot.
template <point_range R>
std::optional<Eigen::Vector3d> first_within_reach(const R& scan) {
  for (const auto& p : scan)
    if (const Eigen::Vector3d v = xyz(p); all_finite(v) && tiled_minima::within_reach(v)) return v;
  return std::nullopt;
}

}  // namespace detail

inline namespace GLOBALMATCH_THREADING {

/// Gathers the lowest points in one forward pass over the scan, in a frame levelled by `up`; parts of the
/// scan that lie apart (more than a tile of 32 cells from the rest) are left out and counted. An empty raster
/// if no point is finite. Cost: linear; parallel where the range gives random access.
template <point_range R>
lowest_raster gather_lowest_points(const R& scan, double resolution, const Eigen::Vector3d& up,
                                   ground_funnel& funnel, const execution& how = {}) {
  using detail::tiled_minima;
  lowest_raster raster;
  raster.frame.local_from_scan_rotation = levelling_rotation(up);
  raster.resolution = resolution;
  funnel = {};
  raster.frame.origin = detail::first_within_reach(scan).value_or(Eigen::Vector3d::Zero());

  // Whoever works on a chunk borrows a raster: there are no more of them than threads.
  std::vector<std::unique_ptr<tiled_minima>> idle;
  std::mutex door;
  read_in_chunks(
      scan, how, "ground", [](std::size_t) {},
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
        std::size_t points = 0, lost = 0;
        const std::size_t not_finite = visit_points([&](const Eigen::Vector3d& p, point_index) {
          ++points;
          if (!minima->add(raster.frame.to_local(p))) ++lost;
        });
        const std::lock_guard lock(door);
        funnel.points += points + not_finite;
        funnel.not_finite += lost + not_finite;
        idle.push_back(std::move(minima));
      });
  tiled_minima minima(resolution);
  for (std::size_t i = 0; i < idle.size(); ++i)
    if (i == 0)
      minima = std::move(*idle[0]);
    else
      minima.merge(*idle[i]);

  const auto group = minima.main_group();
  if (group.empty()) return raster;
  std::vector<double> heights;  // the lowest of each tile
  std::int64_t row_low = group.front().first, row_high = row_low;
  std::int64_t column_low = group.front().second, column_high = column_low;
  for (const auto& k : group) {
    row_low = std::min(row_low, k.first), row_high = std::max(row_high, k.first);
    column_low = std::min(column_low, k.second), column_high = std::max(column_high, k.second);
    const auto& tile = *minima.tiles().at(k);
    funnel.cells += tiled_minima::occupied(tile);
    heights.push_back(std::min_element(tile.cells.begin(), tile.cells.end())->z);
  }
  for (const auto& entry : minima.tiles()) funnel.cells_apart += tiled_minima::occupied(*entry.second);
  funnel.cells_apart -= funnel.cells;
  funnel.cells += funnel.cells_apart;

  // Whole metres above the first point: a shifted scan then gives the same local coordinates, bit for bit.
  const auto middle = heights.begin() + std::ptrdiff_t(heights.size() / 2);
  std::nth_element(heights.begin(), middle, heights.end());
  const Eigen::Vector3d corner(double(column_low) * minima.tile_size(), double(row_low) * minima.tile_size(),
                               std::floor(*middle));
  raster.frame.origin = raster.frame.to_scan(corner);
  raster.columns = int(column_high - column_low + 1) * tiled_minima::tile_cells;
  raster.rows = int(row_high - row_low + 1) * tiled_minima::tile_cells;
  raster.points.assign(std::size_t(raster.columns) * std::size_t(raster.rows),
                       Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  parallel_for(
      how, "ground", group.size(),
      [&](std::size_t g) {
        const tiled_minima::key& k = group[g];
        const auto& tile = *minima.tiles().at(k);
        const Eigen::Vector3d tile_corner(double(k.second - column_low) * minima.tile_size(),
                                          double(k.first - row_low) * minima.tile_size(), -corner.z());
        for (int i = 0; i < tiled_minima::tile_cells * tiled_minima::tile_cells; ++i) {
          const auto& lowest = tile.cells[std::size_t(i)];
          if (lowest.empty()) continue;
          const int r = int(k.first - row_low) * tiled_minima::tile_cells + i / tiled_minima::tile_cells;
          const int c = int(k.second - column_low) * tiled_minima::tile_cells + i % tiled_minima::tile_cells;
          raster.points[raster.cell(c, r)] =
              (tile_corner + Eigen::Vector3d(lowest.x, lowest.y, lowest.z)).cast<float>();
        }
      },
      16);
  return raster;
}

}  // namespace GLOBALMATCH_THREADING

namespace detail {

/// Whether at least `least` points within two cells of a cell, itself not counted, are such that
/// `counts(height)`.
template <class Counts>
bool are_around(const lowest_raster& raster, int column, int row, int least, const Counts& counts) {
  const int left = std::max(column - 2, 0), right = std::min(column + 2, raster.columns - 1);
  const int top = std::min(row + 2, raster.rows - 1);
  for (int r = std::max(row - 2, 0); r <= top; ++r)
    for (int c = left; c <= right; ++c) {
      const float z = raster.points[raster.cell(c, r)].z();
      if ((c != column || r != row) && !std::isnan(z) && counts(z) && --least == 0) return true;
    }
  return false;
}

/// With fewer points around it nobody can tell whether a point is an outlier.
constexpr int least_around = 4;

}  // namespace detail

inline namespace GLOBALMATCH_THREADING {

/// Empties the cells whose point lies more than `depth` [m] below all but one of the points within two cells:
/// multipath returns come singly or in twos, while on a slope some neighbour is always lower. Returns how
/// many.
inline std::size_t remove_low_outliers(lowest_raster& raster, double depth, const execution& how = {}) {
  std::vector<std::vector<std::size_t>> outliers(static_cast<std::size_t>(raster.rows));
  parallel_for(
      how, "ground", outliers.size(),
      [&](std::size_t row) {
        const int r = int(row);
        for (int c = 0; c < raster.columns; ++c) {
          if (!raster.holds(c, r)) continue;
          const double z = raster.points[raster.cell(c, r)].z();
          const auto any = [](float) { return true; };
          const auto near = [&](float other) { return other < z + depth; };
          if (!detail::are_around(raster, c, r, 2, near) &&
              detail::are_around(raster, c, r, detail::least_around, any))
            outliers[row].push_back(raster.cell(c, r));
        }
      },
      16);
  std::size_t removed = 0;
  for (const auto& of_row : outliers)
    for (const std::size_t i : of_row) {
      raster.points[i].z() = std::numeric_limits<float>::quiet_NaN();
      ++removed;
    }
  return removed;
}

}  // namespace GLOBALMATCH_THREADING

namespace detail {
inline namespace GLOBALMATCH_THREADING {

/// The highest that ground which rises by `slope` [m/m] from any lower point can be at each cell; unbounded
/// where no point proves ground. A border of one cell lies around.
class ground_reach {
 public:
  ground_reach(const lowest_raster& raster, double slope, const execution& how)
      : columns_(raster.columns),
        straight_(float(slope * raster.resolution)),
        heights_(std::size_t(raster.columns + 2) * std::size_t(raster.rows + 2), unbounded) {
    const auto any = [](float) { return true; };
    parallel_for(
        how, "ground", std::size_t(raster.rows),
        [&](std::size_t of) {
          const int r = int(of);
          for (int c = 0; c < columns_; ++c)
            if (raster.holds(c, r) && are_around(raster, c, r, least_around, any))
              row(r)[c] = raster.points[raster.cell(c, r)].z();
        },
        16);
    for (int r = 0; r < raster.rows; ++r) {
      float* here = row(r);
      rise_from(row(r - 1), here);
      for (int c = 0; c < columns_; ++c) here[c] = std::min(here[c], here[c - 1] + straight_);
    }
    for (int r = raster.rows - 1; r >= 0; --r) {
      float* here = row(r);
      rise_from(row(r + 1), here);
      for (int c = columns_ - 1; c >= 0; --c) here[c] = std::min(here[c], here[c + 1] + straight_);
    }
  }

  /// By column.
  const float* row(int r) const {
    return heights_.data() + std::size_t(r + 1) * std::size_t(columns_ + 2) + 1;
  }

 private:
  static constexpr float unbounded = std::numeric_limits<float>::infinity();

  float* row(int r) { return heights_.data() + std::size_t(r + 1) * std::size_t(columns_ + 2) + 1; }
  void rise_from(const float* next, float* here) const {
    const float diagonal = float(std::sqrt(2.0)) * straight_;
    for (int c = 0; c < columns_; ++c)
      here[c] =
          std::min(here[c], std::min(next[c] + straight_, std::min(next[c - 1], next[c + 1]) + diagonal));
  }

  int columns_;
  float straight_;  // [m] rise from one cell to the next
  std::vector<float> heights_;
};

}  // namespace GLOBALMATCH_THREADING
}  // namespace detail

inline namespace GLOBALMATCH_THREADING {

/// Empties the cells whose point no ground reaches: it stands more than `step` [m] above what rises by
/// `slope` [m/m] from some lower point (slope based filtering, Vosselman 2000, ISPRS Archives 33). Behind
/// shrubs the lowest points are on stems and crowns. A lone point, which may be an outlier, is no proof of
/// ground. Returns how many. Cost: linear in the cells.
inline std::size_t remove_unreachable(lowest_raster& raster, double slope, double step,
                                      const execution& how = {}) {
  const detail::ground_reach reach(raster, slope, how);
  std::size_t removed = 0;
  for (int r = 0; r < raster.rows; ++r)
    for (int c = 0; c < raster.columns; ++c)
      if (float& z = raster.points[raster.cell(c, r)].z(); z > reach.row(r)[c] + float(step)) {
        z = std::numeric_limits<float>::quiet_NaN();
        ++removed;
      }
  return removed;
}

}  // namespace GLOBALMATCH_THREADING
}  // namespace globalmatch
