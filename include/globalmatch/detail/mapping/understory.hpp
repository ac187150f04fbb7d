// Understory ([GM] 3.1): the points between 0.2 m and 3 m above the terrain, in local coordinates.
// In: points of a scan (one pass) and its terrain. Out: `local_points` in the terrain's frame.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/local_points.hpp"
#include "globalmatch/detail/core/per_thread.hpp"
#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/core/visible_ranges.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/mapping_options.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

/// The heights between which each cell of a terrain raster may hold understory points, and those between
/// which it holds nothing else: most points are decided by these, without interpolation. A border of one cell
/// lies around, for the points beyond.
class layer_limits {
 public:
  struct limits {
    float min_height, max_height, certain_min, certain_max;

    bool may_hold(float z) const { return (z >= min_height) & (z <= max_height); }
    bool holds(float z) const { return (z >= certain_min) & (z <= certain_max); }
  };

  layer_limits(const terrain& ground, const understory_options& options, const execution& exec)
      : per_cell_(float(1 / ground.resolution)),
        last_column_(float(ground.columns + 1)),
        last_row_(float(ground.rows + 1)),
        columns_(ground.columns + 2),
        limits_(std::size_t(columns_) * std::size_t(ground.rows + 2)) {
    parallel_for(
        exec, "understory", std::size_t(ground.rows + 2),
        [&](std::size_t row) {
          fill_row(ground, options, int(row) - 1, limits_.data() + row * std::size_t(columns_));
        },
        16);
  }

  /// Of the cell that (x, y) lies in.
  std::uint32_t cell(float x, float y) const {
    return number(y, last_row_) * std::uint32_t(columns_) + number(x, last_column_);
  }
  const limits& of(std::uint32_t cell) const { return limits_[cell]; }

 private:
  /// Heights in a cell lie between those of the nodes around, but in the outermost cells, where they go on as
  /// the last nodes slope, by half a node each way. The border's are those of the cells next to it.
  void fill_row(const terrain& ground, const understory_options& options, int row, limits* of_row) const {
    constexpr float rounding = 0.001f, max_height = 1e6f;  // [m] so that what is infinite stays out
    constexpr float unbounded = std::numeric_limits<float>::infinity();
    const auto low = float(std::max(options.min_height, -double(max_height)));
    const auto high = float(std::min(options.max_height, double(max_height)));
    std::vector<float> min_heights(std::size_t(columns_), unbounded),
        max_heights(std::size_t(columns_), -unbounded);
    const int inner_row = std::clamp(row, 0, ground.rows - 1);
    for (int r = inner_row - 1; r <= inner_row + 1; ++r) {
      const float* heights = ground.heights.data() + ground.node(0, std::clamp(r, 0, ground.rows - 1));
      for (std::size_t c = 0; c < std::size_t(ground.columns); ++c) {
        min_heights[c + 1] = std::min(min_heights[c + 1], heights[c]);
        max_heights[c + 1] = std::max(max_heights[c + 1], heights[c]);
      }
    }
    const bool row_is_last = row <= 0 || row >= ground.rows - 1;
    for (int c = 0; c < columns_; ++c) {
      const auto here = std::size_t(std::clamp(c, 1, columns_ - 2));
      float min_ground = std::min({min_heights[here - 1], min_heights[here], min_heights[here + 1]});
      float max_ground = std::max({max_heights[here - 1], max_heights[here], max_heights[here + 1]});
      if (row_is_last || c <= 1 || c >= columns_ - 2) {
        const float beyond = 1.5f * (max_ground - min_ground);  // at a corner
        min_ground -= beyond, max_ground += beyond;
      }
      of_row[c] = {min_ground + low - rounding, max_ground + high + rounding, max_ground + low + rounding,
                   min_ground + high - rounding};
      const bool is_border = c == 0 || c + 1 == columns_ || row < 0 || row == ground.rows;
      if (is_border) of_row[c].certain_min = unbounded;
    }
  }
  /// That of the border for what is not a number.
  std::uint32_t number(float v, float last) const {
    return static_cast<std::uint32_t>(static_cast<int>(std::min(std::max(0.0f, v * per_cell_ + 1), last)));
  }

  float per_cell_, last_column_, last_row_;
  int columns_;
  unset_vector<limits> limits_;
};

/// Points on their way through the selection, few enough for the nearest cache.
struct point_batch {
  static constexpr std::size_t capacity = 256;
  std::array<float, capacity> x, y, z;
  std::array<point_index, capacity> index;
  std::size_t count = 0;

  void push_back(const vec3f& p, point_index i) {
    x[count] = p.x, y[count] = p.y, z[count] = p.z;
    index[count++] = i;
  }
  vec3f operator[](std::size_t i) const { return {x[i], y[i], z[i]}; }
};

/// Calls `visit(i)` for the points of a batch in the layer, in their order.
template <class Visit>
void for_each_in_layer(const point_batch& batch, const terrain& ground, const layer_limits& limits,
                       const understory_options& options, const Visit& visit) {
  std::array<std::uint32_t, point_batch::capacity> cells;
  for (std::size_t i = 0; i < batch.count; ++i) cells[i] = limits.cell(batch.x[i], batch.y[i]);
  std::array<unsigned, point_batch::capacity> candidates;
  std::size_t count = 0;
  for (unsigned i = 0; i < batch.count; ++i) {  // without branches, which are unpredictable
    candidates[count] = i;
    count += limits.of(cells[i]).may_hold(batch.z[i]);
  }
  for (std::size_t k = 0; k < count; ++k) {
    const unsigned i = candidates[k];
    const float x = batch.x[i], y = batch.y[i], z = batch.z[i];
    if (!limits.of(cells[i]).holds(z)) {
      if (!ground.covers(x, y)) continue;
      const double height = z - ground.interpolated_height(x, y);
      if (!(height >= options.min_height && height <= options.max_height)) continue;
    }
    visit(i);
  }
}

/// Understory points, in a part for each chunk of the scan.
struct understory_parts {
  parted_points points;
  std::size_t in_layer = 0;  ///< points, with those that were thinned out
  visible_ranges visible;    ///< from where the scanner stood, if that is known
};

/// Of some points of a scan, evenly picked, what each tells of how far the scanner saw.
class return_sampler {
 public:
  /// `scanner` [m], frame of the terrain; empty: nothing is known.
  return_sampler(const std::optional<vec3>& scanner, std::size_t points) : is_used_(scanner) {
    constexpr std::size_t max_samples = 1 << 18;
    if (scanner) scanner_ = vec3f(*scanner);
    step_ = (points / max_samples) | 1;  // odd: scanners of several beams write these in turn
  }

  void add_from(const point_batch& batch, std::vector<ranged_return>& returns) const {
    if (!is_used_ || batch.count == 0) return;
    const std::size_t beyond = batch.index[0] % step_;
    for (std::size_t i = beyond == 0 ? 0 : step_ - beyond; i < batch.count; i += step_)
      if (const auto seen = visible_ranges::return_at(batch[i] - scanner_)) returns.push_back(*seen);
  }

 private:
  bool is_used_;
  vec3f scanner_{0, 0, 0};
  std::size_t step_;
};

/// `select_understory` in parts, and how far the scanner saw from where it stood (frame of the scan), if that
/// is known. A point nearer than `apart` [m] to the one that was kept before it, in the
/// order of the scan, is left out: scanners go along lines, on which points near by are closer than anybody
/// needs.
template <point_range R>
understory_parts select_understory_parts(const R& scan, const terrain& ground,
                                         const understory_options& options, double apart,
                                         const execution& exec,
                                         const std::optional<std::array<double, 3>>& scanner = {}) {
  require_valid(options);
  understory_parts result;
  if (ground.empty()) return result;
  const layer_limits limits(ground, options, exec);
  const auto min_squared = static_cast<float>(apart * apart);
  struct gathering {
    std::unique_ptr<local_points> kept = std::make_unique<local_points>();
    std::size_t in_layer = 0;
    std::vector<ranged_return> returns;
  };
  per_thread<gathering> gathered;
  std::optional<vec3> scanner_at;
  if (scanner) scanner_at = ground.frame.to_local(vec3::from(*scanner));
  std::optional<return_sampler> sampler;
  read_in_chunks(
      scan, exec, "understory",
      [&](std::size_t chunks) {
        result.points.parts.resize(chunks);
        sampler.emplace(scanner_at, chunks * points_a_chunk);
      },
      [&](std::size_t chunk, const auto& visit_points) {
        std::unique_ptr<gathering> own = gathered.take();
        local_points& kept = *own->kept;
        const std::size_t before = kept.size();
        std::size_t in_layer = 0;
        vec3f last(1e9f, 1e9f, 1e9f);
        point_batch batch;
        const auto hand_over = [&] {
          sampler->add_from(batch, own->returns);
          for_each_in_layer(batch, ground, limits, options, [&](std::size_t i) {
            ++in_layer;
            const vec3f p = batch[i];
            if ((p - last).squared_norm() < min_squared) return;
            last = p;
            kept.push_back(p, batch.index[i]);
          });
          batch.count = 0;
        };
        visit_points([&](const vec3& p, point_index i) {
          batch.push_back(vec3f(ground.frame.to_local(p)), i);
          if (batch.count == point_batch::capacity) hand_over();
        });
        hand_over();
        result.points.parts[chunk] = {&kept, before, kept.size()};
        own->in_layer += in_layer;
        gathered.give_back(std::move(own));
      });
  if (scanner_at) result.visible.scanner = *scanner_at;
  for (auto& own : gathered.all()) {
    result.points.gathered.push_back(std::move(own->kept));
    result.in_layer += own->in_layer;
    for (const ranged_return& seen : own->returns) result.visible.add(seen);
  }
  return result;
}

/// Points of the scan in the understory layer, in its order; none where the terrain does not reach. One
/// forward pass; parallel where the range gives random access.
template <point_range R>
local_points select_understory(const R& scan, const terrain& ground, const understory_options& options = {},
                               const execution& exec = {}) {
  auto layer = select_understory_parts(scan, ground, options, 0, exec);
  return join_parts(std::move(layer.points), ground.frame, "understory", exec);
}
}  // namespace globalmatch::detail
