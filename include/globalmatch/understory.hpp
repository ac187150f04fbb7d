// Understory ([GM] 3.1): the points between 0.2 m and 3 m above the terrain, in local coordinates.
// In: points of a scan (one pass) and its terrain. Out: `local_points` in the terrain's frame.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "globalmatch/execution.hpp"
#include "globalmatch/local_points.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/terrain.hpp"

namespace globalmatch {

struct understory_options {
  double lowest = 0.2;   ///< [m] above the terrain ([GM] 3.1: 0.2)
  double highest = 3.0;  ///< [m] above the terrain ([GM] 3.1: 3)
};

/// Throws `std::invalid_argument` when the layer is empty by its limits.
inline void require_valid(const understory_options& options) {
  if (!(options.lowest < options.highest))
    throw std::invalid_argument("understory.lowest must be less than understory.highest");
}

namespace detail {

/// The heights between which each cell of a terrain raster may hold understory points: most points are told
/// by these, without interpolation. A border of one cell lies around, for the points beyond.
class layer_limits {
 public:
  layer_limits(const terrain& ground, const understory_options& options)
      : per_cell_(1 / ground.resolution), last_column_(ground.columns + 1), last_row_(ground.rows + 1) {
    limits_.reserve(std::size_t(last_column_ + 1) * std::size_t(last_row_ + 1));
    for (int r = -1; r <= ground.rows; ++r)
      for (int c = -1; c <= ground.columns; ++c) {
        limits l{std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity()};
        for (int dr = -1; dr <= 1; ++dr)  // heights in a cell lie between those of the nodes around
          for (int dc = -1; dc <= 1; ++dc) {
            const std::size_t node = ground.node(std::clamp(c + dc, 0, ground.columns - 1),
                                                 std::clamp(r + dr, 0, ground.rows - 1));
            l.lowest = std::min(l.lowest, ground.heights[node]);
            l.highest = std::max(l.highest, ground.heights[node]);
          }
        constexpr float rounding = 0.001f;  // [m]
        limits_.push_back(
            {l.lowest + float(options.lowest) - rounding, l.highest + float(options.highest) + rounding});
      }
  }

  /// False where (x, y, z) is certainly not between the limits.
  bool may_hold(double x, double y, float z) const {
    const int c = number(x, last_column_), r = number(y, last_row_);
    const limits& l = limits_[std::size_t(r) * std::size_t(last_column_ + 1) + std::size_t(c)];
    return (z >= l.lowest) & (z <= l.highest);
  }

 private:
  struct limits {
    float lowest, highest;
  };
  int number(double v, double last) const {
    return static_cast<int>(std::min(std::max(v * per_cell_ + 1, 0.0), last));
  }

  double per_cell_;
  int last_column_, last_row_;
  std::vector<limits> limits_;
};

/// Points that are kept as they come, in memory for as many as there may be. Whether one is kept is told
/// after it is written: nothing is branched on.
class kept_points {
 public:
  explicit kept_points(std::size_t most) : x_(most), y_(most), z_(most), index_(most) {}

  void add(const Eigen::Vector3f& p, point_index i, bool keep) {
    x_[count_] = p.x(), y_[count_] = p.y(), z_[count_] = p.z();
    index_[count_] = i;
    count_ += keep;
  }
  std::size_t size() const { return count_; }
  /// Of these again those such that `keep(x, y, z)`, which is asked in their order.
  template <class Keep>
  void filter(Keep keep) {
    const std::size_t all = std::exchange(count_, 0);
    for (std::size_t k = 0; k < all; ++k) add({x_[k], y_[k], z_[k]}, index_[k], keep(x_[k], y_[k], z_[k]));
  }
  void copy_to(local_points& points) const {
    const auto count = static_cast<std::ptrdiff_t>(count_);
    points.x.assign(x_.begin(), x_.begin() + count);
    points.y.assign(y_.begin(), y_.begin() + count);
    points.z.assign(z_.begin(), z_.begin() + count);
    points.index.assign(index_.begin(), index_.begin() + count);
  }

 private:
  unset_vector<float> x_, y_, z_;
  unset_vector<point_index> index_;
  std::size_t count_ = 0;
};

/// Understory points, in a part for each chunk of the scan.
struct understory_parts {
  std::vector<local_points> parts;
  std::size_t in_layer = 0;  ///< points, with those that were thinned out
};

inline namespace GLOBALMATCH_THREADING {

/// `select_understory` in parts. A point nearer than `apart` [m] to the one that was kept before it, in the
/// order of the scan, is left out: scanners go along lines, on which points near by are closer than anybody
/// needs.
template <point_range R>
understory_parts select_understory_parts(const R& scan, const terrain& ground,
                                         const understory_options& options, double apart,
                                         const execution& how) {
  require_valid(options);
  understory_parts result;
  if (ground.empty()) return result;
  const layer_limits limits(ground, options);
  const auto least_squared = static_cast<float>(apart * apart);
  std::vector<std::size_t> in_layer;
  read_in_chunks(
      scan, how, "understory",
      [&](std::size_t chunks) {
        result.parts.resize(chunks);
        in_layer.resize(chunks);
      },
      [&](std::size_t chunk, const auto& visit_points) {
        kept_points kept(points_a_chunk);
        visit_points([&](const Eigen::Vector3d& p, point_index i) {
          const Eigen::Vector3d local = ground.frame.to_local(p);
          const Eigen::Vector3f rounded = local.cast<float>();
          kept.add(rounded, i, limits.may_hold(local.x(), local.y(), rounded.z()));
        });
        kept.filter([&](float x, float y, float z) {
          if (!ground.covers(x, y)) return false;
          const double height = z - ground.interpolated_height(x, y);
          return height >= options.lowest && height <= options.highest;
        });
        in_layer[chunk] = kept.size();
        if (apart > 0)
          kept.filter([&, last = Eigen::Vector3f(Eigen::Vector3f::Constant(1e9f))](float x, float y,
                                                                                   float z) mutable {
            const Eigen::Vector3f here(x, y, z);
            const bool is_apart = (here - last).squaredNorm() >= least_squared;
            if (is_apart) last = here;
            return is_apart;
          });
        kept.copy_to(result.parts[chunk]);
      });
  for (const std::size_t count : in_layer) result.in_layer += count;
  return result;
}

}  // namespace GLOBALMATCH_THREADING
}  // namespace detail

inline namespace GLOBALMATCH_THREADING {

/// Points of the scan in the understory layer, in its order; none where the terrain does not reach. One
/// forward pass; parallel where the range gives random access.
template <point_range R>
local_points select_understory(const R& scan, const terrain& ground, const understory_options& options = {},
                               const execution& how = {}) {
  auto layer = detail::select_understory_parts(scan, ground, options, 0, how);
  return detail::join_parts(std::move(layer.parts), ground.frame, "understory", how);
}

}  // namespace GLOBALMATCH_THREADING
}  // namespace globalmatch
