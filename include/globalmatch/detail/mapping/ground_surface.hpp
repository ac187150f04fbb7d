// Whether what a terrain was fitted to is ground: a surface that extends under the scan, or the lowest points
// of things that stand apart. In: terrain with its ground points. Out: the nodes that lie in a surface.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

/// The blocks of a raster that lie in a surface of ground.
struct ground_surface {
  int columns = 0, rows = 0;             ///< blocks
  int nodes_a_block = 1;                 ///< along and across
  std::vector<std::uint8_t> in_surface;  ///< of each block, row by row
  std::size_t blocks = 0;                ///< how many of them are

  std::size_t block(int c, int r) const { return std::size_t(r) * std::size_t(columns) + std::size_t(c); }
  bool holds_node(int c, int r) const {
    return !in_surface.empty() && in_surface[block(c / nodes_a_block, r / nodes_a_block)] != 0;
  }
  /// The node's block, or one next to it: surfaces have a rim.
  bool holds_node_near(int c, int r) const {
    if (in_surface.empty()) return false;
    const int column = c / nodes_a_block, row = r / nodes_a_block;
    for (int y = std::max(row - 1, 0); y <= std::min(row + 1, rows - 1); ++y)
      for (int x = std::max(column - 1, 0); x <= std::min(column + 1, columns - 1); ++x)
        if (in_surface[block(x, y)]) return true;
    return false;
  }
};

/// How many ground points lie in each block of nodes.
inline std::vector<std::uint32_t> count_in_blocks(const terrain& ground, const ground_surface& blocks) {
  std::vector<std::uint32_t> counts(std::size_t(blocks.columns) * std::size_t(blocks.rows));
  for (int r = 0; r < ground.rows; ++r)
    for (int c = 0; c < ground.columns; ++c) {
      const std::size_t node = ground.node(c, r);
      counts[blocks.block(c / blocks.nodes_a_block, r / blocks.nodes_a_block)] +=
          ground.first_ground[node + 1] - ground.first_ground[node];
    }
  return counts;
}

/// Blocks whose nine, they and those around, all hold ground, and enough of it for a surface: half of the
/// cells at nodes of two by two.
inline std::vector<std::uint8_t> supported_blocks(const ground_surface& blocks,
                                                  const std::vector<std::uint32_t>& counts) {
  constexpr std::uint32_t min_points = 18;
  std::vector<std::uint8_t> supported(counts.size());
  for (int r = 1; r + 1 < blocks.rows; ++r)
    for (int c = 1; c + 1 < blocks.columns; ++c) {
      std::uint32_t sum = 0;
      bool all_hold = true;
      for (int dr = -1; dr <= 1; ++dr)
        for (int dc = -1; dc <= 1; ++dc) {
          const std::uint32_t here = counts[blocks.block(c + dc, r + dr)];
          sum += here;
          all_hold = all_hold && here > 0;
        }
      supported[blocks.block(c, r)] = all_hold && sum >= min_points;
    }
  return supported;
}

/// The surfaces that ground points form. Ground has others in all directions, and so have these: what stands
/// on it and was cut off below leaves patches no wider than a crown. Cost: linear in the area.
inline ground_surface find_ground_surface(const terrain& ground, int nodes_a_block = 1) {
  constexpr std::size_t min_blocks = 25;  // 6 m^2 at the usual resolution, inside a rim of one node
  ground_surface found{(ground.columns + nodes_a_block - 1) / nodes_a_block,
                       (ground.rows + nodes_a_block - 1) / nodes_a_block,
                       nodes_a_block,
                       {},
                       0};
  if (ground.first_ground.empty()) return found;
  std::vector<std::uint8_t> left = supported_blocks(found, count_in_blocks(ground, found));
  found.in_surface.assign(left.size(), 0);
  const auto columns = std::size_t(found.columns);
  std::vector<std::size_t> group;
  for (std::size_t first = 0; first < left.size(); ++first) {
    if (!left[first]) continue;
    group.assign(1, first);
    left[first] = 0;
    for (std::size_t i = 0; i < group.size(); ++i)  // supported blocks lie inside: all have neighbours
      for (const std::size_t row : {group[i] - columns, group[i], group[i] + columns})
        for (const std::size_t next : {row - 1, row, row + 1})
          if (left[next]) {
            left[next] = 0;
            group.push_back(next);
          }
    if (group.size() < min_blocks) continue;
    found.blocks += group.size();
    for (const std::size_t i : group) found.in_surface[i] = 1;
  }
  return found;
}

/// The lowest ground point of each square metre that holds some, and whether it lies in or at a surface.
struct lowest_of_metre {
  float z = std::numeric_limits<float>::infinity();
  bool in_surface = false;
};

inline std::vector<lowest_of_metre> lowest_of_metres(const terrain& ground, const ground_surface& surface) {
  const int nodes = std::max(1, int(std::lround(1 / ground.resolution)));  // a metre
  const int columns = (ground.columns + nodes - 1) / nodes, rows = (ground.rows + nodes - 1) / nodes;
  std::vector<lowest_of_metre> metres(std::size_t(columns) * std::size_t(rows));
  for (int r = 0; r < ground.rows; ++r)
    for (int c = 0; c < ground.columns; ++c) {
      lowest_of_metre& metre = metres[std::size_t(r / nodes) * std::size_t(columns) + std::size_t(c / nodes)];
      const std::size_t node = ground.node(c, r);
      for (std::uint32_t i = ground.first_ground[node]; i < ground.first_ground[node + 1]; ++i)
        if (ground.ground[i].z < metre.z) metre = {ground.ground[i].z, surface.holds_node_near(c, r)};
    }
  std::erase_if(metres, [](const lowest_of_metre& m) { return std::isinf(m.z); });
  return metres;
}

/// Whether all below some height was cut off. What stands there then ends at that height all over the scan,
/// and none of it is a surface: scans with all their ground have at most 0.2 % of such metres, cut ones 6 %
/// and more.
inline bool is_cut_off(const terrain& ground, const ground_surface& surface) {
  constexpr float layer = 0.03f;  // [m]
  constexpr double min_share = 0.02;
  constexpr std::size_t min_metres = 10;
  const std::vector<lowest_of_metre> metres = lowest_of_metres(ground, surface);
  if (metres.size() < min_metres) return false;
  std::vector<float> heights;
  for (const lowest_of_metre& m : metres) heights.push_back(m.z);
  constexpr std::ptrdiff_t outliers = 2;
  std::nth_element(heights.begin(), heights.begin() + outliers, heights.end());
  const float lowest = heights[outliers];
  const auto ends_there = std::count_if(metres.begin(), metres.end(), [&](const lowest_of_metre& m) {
    return !m.in_surface && m.z < lowest + layer;
  });
  return std::size_t(ends_there) >= min_metres && double(ends_there) >= min_share * double(metres.size());
}

/// Whether the ground lies at height 0 of the scan everywhere: its heights are those above the ground.
inline bool is_normalised(const terrain& ground, const ground_surface& surface) {
  constexpr double band = 0.05, share = 0.95;  // [m]; no forest floor is so flat
  const double zero = -(ground.frame.rotation * ground.frame.origin).z;
  std::size_t nodes = 0, at_zero = 0;
  for (int r = 0; r < ground.rows; ++r)
    for (int c = 0; c < ground.columns; ++c)
      if (surface.holds_node(c, r)) {
        ++nodes;
        at_zero += std::abs(ground.heights[ground.node(c, r)] - zero) < band;
      }
  return nodes > 0 && double(at_zero) >= share * double(nodes);
}

/// Decides what the heights of a terrain rest on. `cells_a_node`: how many of its four cells hold points, on
/// the mean over those that hold any: surfaces of sparse scans are looked for in blocks of a metre.
inline void determine_status(terrain& ground, double cells_a_node) {
  if (ground.empty()) {
    ground.status = ground_status::none;
    return;
  }
  constexpr double dense = 2;
  const ground_surface surface = find_ground_surface(ground, cells_a_node >= dense ? 1 : 2);
  ground.in_surface.resize(ground.heights.size());
  for (int r = 0; r < ground.rows; ++r)
    for (int c = 0; c < ground.columns; ++c)
      ground.in_surface[ground.node(c, r)] = surface.holds_node(c, r) ? 1 : 0;
  ground.cut_off = is_cut_off(ground, surface);
  ground.status = surface.blocks == 0              ? ground_status::none
                  : is_normalised(ground, surface) ? ground_status::normalised
                                                   : ground_status::seen;
}

}  // namespace globalmatch::detail
