// Noise below the ground that is scattered over the scan: where points are dense each cell's lowest one is
// noise, and only how many lie where shows it. In: a sample of the scan and a terrain. Out: a floor.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/local_frame.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/detail/mapping/lowest_raster.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

/// What one thread sampled of a scan, without what is not finite, in groups of points that lie near each
/// other, so that floats tell where in each.
class sampled_points {
 public:
  /// Groups end with their chunk: what is rounded depends on no other chunk.
  void begin_chunk() { begins_ = true; }
  void push_back(const vec3& p) {
    constexpr double max_distance = 1000;  // [m] floats tell 0.1 mm
    if (!is_finite(p)) return;
    if (std::exchange(begins_, false) ||
        !((p - groups_.back().first).squared_norm() < max_distance * max_distance))
      groups_.push_back({p, offsets_.size()});
    offsets_.push_back(vec3f(p - groups_.back().first));
  }
  /// Calls `visit(p)` for each, in the frame of the scan.
  template <class Visit>
  void for_each(const Visit& visit) const {
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      const std::size_t end = g + 1 < groups_.size() ? groups_[g + 1].begin : offsets_.size();
      for (std::size_t i = groups_[g].begin; i < end; ++i) visit(groups_[g].first + vec3(offsets_[i]));
    }
  }

 private:
  struct group {
    vec3 first;
    std::size_t begin;  // of its offsets
  };
  std::vector<group> groups_;
  std::vector<vec3f> offsets_;
  bool begins_ = true;
};

/// One in so many points of a scan.
struct scan_sample {
  point_index one_in = 16;  ///< a power of two
  std::vector<sampled_points> of_thread = {};
};

/// Heights [m] of a square metre below which points are noise; -infinity where that is not known.
struct noise_floor {
  local_frame frame;
  int columns = 0, rows = 0;
  std::vector<float> heights;  ///< row by row, local frame
  std::size_t found = 0;       ///< square metres with a floor
  std::size_t decided = 0;     ///< square metres with points enough to know

  /// Whether a point of the scan is noise: the floor lies above it.
  bool holds_above(const vec3& p) const {
    const vec3 local = frame.to_local(p);
    if (!(local.x >= 0 && local.y >= 0 && local.x < columns && local.y < rows)) return false;
    return local.z < heights[std::size_t(local.y) * std::size_t(columns) + std::size_t(local.x)];
  }
};

/// How many points lie how high above the terrain, of a square metre.
struct height_histogram {
  static constexpr double bin = 0.1, lowest = -0.5, highest = 3;  // [m]
  static constexpr std::size_t bins = 35;
  static constexpr std::uint32_t min_count = 40;
  std::array<std::uint32_t, bins> counts = {};

  std::uint32_t count() const { return std::accumulate(counts.begin(), counts.end(), 0u); }

  void add(double height) {
    if (height >= lowest && height < highest) ++counts[std::size_t((height - lowest) / bin)];
  }

  /// The height [m] above the terrain at which a thin layer begins that holds most points, when hardly any
  /// lie below it and it is not the terrain; NaN when there is none.
  double layer_above_terrain() const {
    constexpr double min_share = 0.5, max_below = 0.03, min_height = 0.15;  // [m]
    const std::uint32_t all = count();
    if (all < min_count) return std::numeric_limits<double>::quiet_NaN();
    std::size_t fullest = 0;
    for (std::size_t i = 1; i + 1 < bins; ++i)
      if (counts[i] + counts[i + 1] > counts[fullest] + counts[fullest + 1]) fullest = i;
    const std::uint32_t below = std::accumulate(counts.begin(), counts.begin() + std::ptrdiff_t(fullest), 0u);
    const double height = lowest + double(fullest) * bin;
    const bool is_layer =
        counts[fullest] + counts[fullest + 1] >= min_share * all && below <= max_below * all;
    return is_layer && height > min_height ? height : std::numeric_limits<double>::quiet_NaN();
  }
};

/// The floors under thin layers that hold most points of a square metre and lie above the terrain: it was
/// fitted to noise below them. Cost: linear in the sample.
inline noise_floor find_noise_floor(const scan_sample& sample, const terrain& ground) {
  constexpr double margin = 0.1;  // [m] below a layer, for slopes within the square metre
  noise_floor floor{ground.frame,
                    int(std::ceil(ground.columns * ground.resolution)),
                    int(std::ceil(ground.rows * ground.resolution)),
                    {}};
  floor.heights.assign(std::size_t(floor.columns) * std::size_t(floor.rows),
                       -std::numeric_limits<float>::infinity());
  std::vector<std::uint32_t> numbers(floor.heights.size(), 0);  // of squares in `histograms`
  std::vector<height_histogram> histograms(1);                  // the first for squares without points
  const auto square = [&](double x, double y) {
    return std::size_t(y) * std::size_t(floor.columns) + std::size_t(x);
  };
  const auto count = [&](const vec3& p) {
    const vec3 local = ground.frame.to_local(p);
    if (!ground.covers(local.x, local.y) || !(local.x < floor.columns && local.y < floor.rows)) return;
    std::uint32_t& number = numbers[square(local.x, local.y)];
    if (number == 0) {
      number = std::uint32_t(histograms.size());
      histograms.emplace_back();
    }
    histograms[number].add(local.z - ground.interpolated_height(local.x, local.y));
  };
  for (const sampled_points& points : sample.of_thread) points.for_each(count);
  for (int r = 0; r < floor.rows; ++r)
    for (int c = 0; c < floor.columns; ++c) {
      const height_histogram& here = histograms[numbers[square(c, r)]];
      if (here.count() < height_histogram::min_count) continue;
      ++floor.decided;
      const double layer = here.layer_above_terrain();
      const double x = std::min(c + 0.5, ground.columns * ground.resolution),
                   y = std::min(r + 0.5, ground.rows * ground.resolution);
      if (std::isnan(layer)) continue;
      ++floor.found;
      floor.heights[square(c, r)] = float(ground.interpolated_height(x, y) + layer - margin);
    }
  return floor;
}

/// Empties the cells whose point lies more than `depth` [m] below the means of nearly all pairs of points
/// that face each other across it, within two cells: on a slope these means are its own height. For noisy
/// scans, as ground between shrubs is lost too. Returns how many. Cost: linear in the cells.
inline std::size_t remove_below_pairs(lowest_raster& raster, double depth) {
  constexpr int half_width = 2, min_pairs = 4;  // of twelve
  constexpr double min_share = 0.8;
  const std::vector<vec3f> before = raster.points;
  const auto height = [&](int c, int r) {
    return c >= 0 && r >= 0 && c < raster.columns && r < raster.rows ? before[raster.cell(c, r)].z
                                                                     : not_known;
  };
  const auto is_low = [&](int c, int r) {
    const float z = height(c, r);
    int pairs = 0, higher = 0;
    for (int dr = 0; dr <= half_width; ++dr)
      for (int dc = dr == 0 ? 1 : -half_width; dc <= half_width; ++dc) {
        const float mean = (height(c + dc, r + dr) + height(c - dc, r - dr)) / 2;
        pairs += !std::isnan(mean);
        higher += mean > z + float(depth);
      }
    return pairs >= min_pairs && higher >= min_share * pairs;
  };
  std::size_t removed = 0;
  for (int r = 0; r < raster.rows; ++r)
    for (int c = 0; c < raster.columns; ++c)
      if (raster.holds(c, r) && is_low(c, r)) {
        raster.points[raster.cell(c, r)].z = not_known;
        ++removed;
      }
  return removed;
}

/// Whether there are so many floors that the scan is noisy, and not some square metres strange.
inline bool is_noisy(const noise_floor& floor) {
  constexpr std::size_t min_found = 10;
  constexpr double min_share = 0.05;
  return floor.found >= min_found && double(floor.found) >= min_share * double(floor.decided);
}

}  // namespace globalmatch::detail
