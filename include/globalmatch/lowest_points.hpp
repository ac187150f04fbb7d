// The lowest point of every cell of a plan raster: all that the ground model keeps of a scan.
// In: points of a scan, one forward pass. Out: `lowest_raster`. Memory linear in the area that holds points.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
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
    double x = 0, y = 0, z = std::numeric_limits<double>::infinity();
    bool empty() const { return std::isinf(z); }
  };
  using tile = std::vector<lowest>;                   // row by row
  using key = std::pair<std::int64_t, std::int64_t>;  // (row, column) of the tile

  explicit tiled_minima(double resolution) : resolution_(resolution), tile_size_(resolution * tile_cells) {}

  double tile_size() const { return tile_size_; }
  const std::map<key, tile>& tiles() const { return tiles_; }

  static bool within_reach(const Eigen::Vector3d& p) { return p.cwiseAbs().maxCoeff() < beyond_any_plot; }

  void add(const Eigen::Vector3d& p) {
    const key k{std::int64_t(std::floor(p.y() / tile_size_)), std::int64_t(std::floor(p.x() / tile_size_))};
    if (last_ == nullptr || k != last_key_) {
      last_ = &tiles_.try_emplace(k, tile_cells * tile_cells).first->second;
      last_key_ = k;
    }
    const auto cell = [&](double v, std::int64_t t) {
      return std::clamp(static_cast<int>((v - double(t) * tile_size_) / resolution_), 0, tile_cells - 1);
    };
    lowest& kept = (*last_)[std::size_t(cell(p.y(), k.first) * tile_cells + cell(p.x(), k.second))];
    if (p.z() < kept.z) kept = {p.x(), p.y(), p.z()};
  }

  static std::size_t occupied(const tile& cells) {
    return std::size_t(std::count_if(cells.begin(), cells.end(), [](const lowest& c) { return !c.empty(); }));
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
        count += occupied(tiles_.at(group[i]));
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
  double resolution_, tile_size_;
  std::map<key, tile> tiles_;
  tile* last_ = nullptr;
  key last_key_{};
};

}  // namespace detail

/// Gathers the lowest points in one forward pass over the scan, in a frame levelled by `up`; parts of the
/// scan that lie apart (more than a tile of 32 cells from the rest) are left out and counted. An empty raster
/// if no point is finite.
template <point_range R>
lowest_raster gather_lowest_points(const R& scan, double resolution, const Eigen::Vector3d& up,
                                   ground_funnel& funnel, const execution& how = {}) {
  using detail::tiled_minima;
  lowest_raster raster;
  raster.frame.local_from_scan_rotation = levelling_rotation(up);
  raster.resolution = resolution;
  tiled_minima minima(resolution);
  funnel = {};
  bool anchored = false;
  const std::size_t not_finite = for_each_finite(scan, [&](const Eigen::Vector3d& p, point_index i) {
    if (i % (1u << 20) == 0) report_progress(how, "ground", 0);
    ++funnel.points;
    if (!anchored && tiled_minima::within_reach(p)) {
      raster.frame.origin = p;
      anchored = true;
    }
    const Eigen::Vector3d local = raster.frame.to_local(p);
    if (anchored && tiled_minima::within_reach(local))
      minima.add(local);
    else
      ++funnel.not_finite;
  });
  funnel.points += not_finite;
  funnel.not_finite += not_finite;

  const auto group = minima.main_group();
  if (group.empty()) return raster;
  std::vector<double> heights;
  auto [row_low, column_low] = group.front();
  auto [row_high, column_high] = group.front();
  for (const auto& k : group) {
    row_low = std::min(row_low, k.first), row_high = std::max(row_high, k.first);
    column_low = std::min(column_low, k.second), column_high = std::max(column_high, k.second);
    for (const auto& lowest : minima.tiles().at(k))
      if (!lowest.empty()) heights.push_back(lowest.z);
  }
  funnel.cells = heights.size();
  for (const auto& entry : minima.tiles()) funnel.cells_apart += tiled_minima::occupied(entry.second);
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
  for (const auto& k : group) {
    const auto& tile = minima.tiles().at(k);
    for (int i = 0; i < tiled_minima::tile_cells * tiled_minima::tile_cells; ++i) {
      const auto& lowest = tile[std::size_t(i)];
      if (lowest.empty()) continue;
      const int r = int(k.first - row_low) * tiled_minima::tile_cells + i / tiled_minima::tile_cells;
      const int c = int(k.second - column_low) * tiled_minima::tile_cells + i % tiled_minima::tile_cells;
      raster.points[raster.cell(c, r)] =
          (Eigen::Vector3d(lowest.x, lowest.y, lowest.z) - corner).cast<float>();
    }
  }
  return raster;
}

namespace detail {

/// Points within two cells of a cell, itself not counted, that `counts(height)`.
template <class Counts>
int count_around(const lowest_raster& raster, int column, int row, const Counts& counts) {
  int count = 0;
  for (int r = row - 2; r <= row + 2; ++r)
    for (int c = column - 2; c <= column + 2; ++c)
      if ((c != column || r != row) && raster.holds(c, r) && counts(raster.points[raster.cell(c, r)].z()))
        ++count;
  return count;
}

/// With fewer points around it nobody can tell whether a point is an outlier.
constexpr int least_around = 4;

}  // namespace detail

/// Empties the cells whose point lies more than `depth` [m] below all but one of the points within two cells:
/// multipath returns come singly or in twos, while on a slope some neighbour is always lower. Returns how
/// many.
inline std::size_t remove_low_outliers(lowest_raster& raster, double depth) {
  std::vector<std::size_t> outliers;
  for (int r = 0; r < raster.rows; ++r)
    for (int c = 0; c < raster.columns; ++c) {
      if (!raster.holds(c, r)) continue;
      const double z = raster.points[raster.cell(c, r)].z();
      const auto any = [](float) { return true; };
      const auto near = [&](float other) { return other < z + depth; };
      if (detail::count_around(raster, c, r, any) >= detail::least_around &&
          detail::count_around(raster, c, r, near) <= 1)
        outliers.push_back(raster.cell(c, r));
    }
  for (const std::size_t i : outliers) raster.points[i].z() = std::numeric_limits<float>::quiet_NaN();
  return outliers.size();
}

/// Empties the cells whose point no ground reaches: it stands more than `step` [m] above what rises by
/// `slope` [m/m] from some lower point (slope based filtering, Vosselman 2000, ISPRS Archives 33). Behind
/// shrubs the lowest points are on stems and crowns. A lone point, which may be an outlier, is no proof of
/// ground. Returns how many. Cost: linear in the cells.
inline std::size_t remove_unreachable(lowest_raster& raster, double slope, double step) {
  const float straight = float(slope * raster.resolution), diagonal = float(std::sqrt(2.0)) * straight;
  std::vector<float> reach;  // highest that the ground can be at each cell
  reach.reserve(raster.points.size());
  for (int r = 0; r < raster.rows; ++r)
    for (int c = 0; c < raster.columns; ++c) {
      const bool proves_ground = raster.holds(c, r) && detail::count_around(raster, c, r, [](float) {
                                                         return true;
                                                       }) >= detail::least_around;
      reach.push_back(proves_ground ? raster.points[raster.cell(c, r)].z()
                                    : std::numeric_limits<float>::infinity());
    }
  const auto relax = [&](int c, int r, int forward) {
    float& here = reach[raster.cell(c, r)];
    const auto from = [&](int dc, int dr, float rise) {
      const int column = c + dc, row = r + dr;
      if (column >= 0 && row >= 0 && column < raster.columns && row < raster.rows)
        here = std::min(here, reach[raster.cell(column, row)] + rise);
    };
    from(-forward, 0, straight);
    from(0, -forward, straight);
    from(-forward, -forward, diagonal);
    from(forward, -forward, diagonal);
  };
  for (int r = 0; r < raster.rows; ++r)
    for (int c = 0; c < raster.columns; ++c) relax(c, r, 1);
  for (int r = raster.rows - 1; r >= 0; --r)
    for (int c = raster.columns - 1; c >= 0; --c) relax(c, r, -1);
  std::size_t removed = 0;
  for (std::size_t i = 0; i < raster.points.size(); ++i)
    if (raster.points[i].z() > reach[i] + float(step)) {
      raster.points[i].z() = std::numeric_limits<float>::quiet_NaN();
      ++removed;
    }
  return removed;
}

}  // namespace globalmatch
