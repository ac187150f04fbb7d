// Ground ([GM] 3.1): lowest points -> cloth -> ground points near the cloth -> terrain by local planes.
// In: points of a scan, one pass. Out: `terrain` and its funnel. Cost: linear in points and in area.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/mapping/lowest_points.hpp"
#include "globalmatch/detail/published/cloth.hpp"
#include "globalmatch/execution.hpp"
#include "globalmatch/mapping_options.hpp"
#include "globalmatch/points.hpp"
#include "globalmatch/stem_map.hpp"

namespace globalmatch::detail {

struct ground_model {
  globalmatch::terrain terrain;
  ground_funnel funnel;
};

/// Each cell of the cloth covers 2 x 2 cells of the lowest points.
constexpr int lowest_per_cloth_cell = 2;

inline std::vector<float> cloth_cell_minima(const lowest_raster& lowest, int columns, int rows) {
  std::vector<float> minima(std::size_t(columns) * std::size_t(rows),
                            std::numeric_limits<float>::quiet_NaN());
  for (int r = 0; r < lowest.rows; ++r)
    for (int c = 0; c < lowest.columns; ++c) {
      if (!lowest.holds(c, r)) continue;
      float& minimum = minima[std::size_t(r / lowest_per_cloth_cell) * std::size_t(columns) +
                              std::size_t(c / lowest_per_cloth_cell)];
      const float z = lowest.points[lowest.cell(c, r)].z();
      if (!(minimum <= z)) minimum = z;
    }
  return minima;
}

/// A plane z = height + slope . ((x, y) - (x0, y0)) about some place (x0, y0).
struct local_plane {
  float height = std::numeric_limits<float>::quiet_NaN();
  float slope_x = 0, slope_y = 0;
  bool known() const { return !std::isnan(height); }
  float at(float dx, float dy) const { return height + slope_x * dx + slope_y * dy; }
};

/// Sums over points that fix a plane through them. Doubles of local coordinates: no digits are lost.
struct plane_moments {
  double n = 0, x = 0, y = 0, z = 0, xx = 0, xy = 0, yy = 0, xz = 0, yz = 0;

  void add(const Eigen::Vector3f& p) {
    const double px = p.x(), py = p.y(), pz = p.z();
    n += 1, x += px, y += py, z += pz;
    xx += px * px, xy += px * py, yy += py * py, xz += px * pz, yz += py * pz;
  }
  plane_moments& operator+=(const plane_moments& o) {
    n += o.n, x += o.x, y += o.y, z += o.z;
    xx += o.xx, xy += o.xy, yy += o.yy, xz += o.xz, yz += o.yz;
    return *this;
  }
  plane_moments& operator-=(const plane_moments& o) {
    n -= o.n, x -= o.x, y -= o.y, z -= o.z;
    xx -= o.xx, xy -= o.xy, yy -= o.yy, xz -= o.xz, yz -= o.yz;
    return *this;
  }

  /// The least squares plane about (x0, y0); not known from fewer than `min_points` points.
  local_plane fit(double x0, double y0, double min_points) const {
    constexpr double ridge = 3e-4;  // [m^2] holds the slope down where points do not spread
    if (n < min_points) return {};
    const double share = 1 / n, mx = x * share, my = y * share, mz = z * share;
    const double cxx = xx * share - mx * mx + ridge, cyy = yy * share - my * my + ridge;
    const double cxy = xy * share - mx * my, cxz = xz * share - mx * mz, cyz = yz * share - my * mz;
    const double scale = 1 / (cxx * cyy - cxy * cxy);
    const double sx = (cxz * cyy - cyz * cxy) * scale, sy = (cyz * cxx - cxz * cxy) * scale;
    return {float(mz + sx * (x0 - mx) + sy * (y0 - my)), float(sx), float(sy)};
  }
};

/// Raster of moments, of square blocks.
struct moment_raster {
  double width = 0;  ///< [m] of a block
  int columns = 0, rows = 0;
  std::vector<plane_moments> blocks;  ///< row by row

  const plane_moments* row(int r) const { return blocks.data() + std::size_t(r) * std::size_t(columns); }
  plane_moments* row(int r) { return blocks.data() + std::size_t(r) * std::size_t(columns); }
};

/// Planes through the points of the blocks around each block; where these are too few, of ever larger ones.
class plane_pyramid {
 public:
  /// A plane for each of `columns` x `rows` blocks `width` [m] wide, not known when there are no points at
  /// all. `add_row(r, moments)` adds the points of row r to the moments of its blocks; it is called for some
  /// rows twice, in parallel. Takes the blocks within `half_width` around each. Refers to the pyramid.
  template <class AddRow>
  const std::vector<local_plane>& fit(double width, int columns, int rows, int half_width, double min_points,
                                      const AddRow& add_row, const execution& exec) {
    std::size_t top = 0;  // the scale of a single block
    for (int blocks = std::max(columns, rows); blocks > 1; blocks = (blocks + 1) / 2) ++top;
    scales_.resize(std::max(scales_.size(), top + 1));
    scales_[0].raster = {width, columns, rows, {}};  // the finest moments are used as they come
    fit_scale(0, top, half_width, min_points, add_row, exec);
    for (std::size_t s = 1; s <= top; ++s) {
      const moment_raster& raster = scales_[s].raster;
      fit_scale(
          s, top, half_width, min_points,
          [&](int r, plane_moments* moments) { std::copy_n(raster.row(r), raster.columns, moments); }, exec);
    }
    for (; top > 0; --top) take_over(scales_[top], scales_[top - 1], exec);
    return scales_.front().planes;
  }

 private:
  struct scale {
    moment_raster raster;
    std::vector<local_plane> planes;
  };
  static constexpr std::size_t rows_a_part = 16;  // even: two rows make one of the next scale

  /// Fits the planes of a scale, and sums its moments for the next one, of blocks of twice the width.
  template <class AddRow>
  void fit_scale(std::size_t number, std::size_t top, int half_width, double min_points,
                 const AddRow& add_row, const execution& exec) {
    scale& here = scales_[number];
    const int columns = here.raster.columns, rows = here.raster.rows, near = number < top ? half_width : 0;
    moment_raster* half = number < top ? &scales_[number + 1].raster : nullptr;
    if (half) {
      half->width = 2 * here.raster.width, half->columns = (columns + 1) / 2, half->rows = (rows + 1) / 2;
      half->blocks.assign(std::size_t(half->columns) * std::size_t(half->rows), {});
    }
    here.planes.resize(std::size_t(columns) * std::size_t(rows));
    parallel_chunks(exec, "ground", std::size_t(rows), rows_a_part, [&](std::size_t begin, std::size_t end) {
      // Sums over a square of blocks are kept: what comes in is added, what goes out is taken away.
      moment_raster window{here.raster.width, columns, 2 * near + 1, {}};
      window.blocks.resize(std::size_t(window.columns) * std::size_t(window.rows));
      std::vector<plane_moments> of_column(static_cast<std::size_t>(columns));
      const auto enter = [&](int r) {
        if (r >= rows) return;
        plane_moments* row = window.row(r % window.rows);
        std::fill_n(row, columns, plane_moments{});
        add_row(r, row);
        for (int c = 0; c < columns; ++c) of_column[std::size_t(c)] += row[c];
        if (!half || r < int(begin) || r >= int(end)) return;
        plane_moments* sums = half->row(r / 2);
        for (int c = 0; c < columns; ++c) sums[c / 2] += row[c];
      };
      const auto leave = [&](int r) {
        if (r < 0) return;
        const plane_moments* row = window.row(r % window.rows);
        for (int c = 0; c < columns; ++c) of_column[std::size_t(c)] -= row[c];
      };
      for (int r = std::max(int(begin) - near, 0); r < int(begin) + near; ++r) enter(r);
      for (int r = int(begin); r < int(end); ++r) {
        enter(r + near);
        fit_row(here, r, of_column, near, number < top ? min_points : 1);
        leave(r - near);
      }
    });
  }

  /// `of_column`: sums over the rows near.
  static void fit_row(scale& here, int r, const std::vector<plane_moments>& of_column, int near,
                      double min_points) {
    const moment_raster& raster = here.raster;
    plane_moments around;
    for (int c = 0; c < std::min(near, raster.columns); ++c) around += of_column[std::size_t(c)];
    for (int c = 0; c < raster.columns; ++c) {
      if (c + near < raster.columns) around += of_column[std::size_t(c + near)];
      here.planes[std::size_t(r) * std::size_t(raster.columns) + std::size_t(c)] =
          around.fit((c + 0.5) * raster.width, (r + 0.5) * raster.width, min_points);
      if (c >= near) around -= of_column[std::size_t(c - near)];
    }
  }

  /// Blocks without a plane take that of the wider block around them.
  static void take_over(const scale& wide, scale& here, const execution& exec) {
    const double width = here.raster.width, twice = wide.raster.width;
    parallel_for(
        exec, "ground", std::size_t(here.raster.rows),
        [&](std::size_t row) {
          const int r = int(row);
          local_plane* planes = here.planes.data() + row * std::size_t(here.raster.columns);
          for (int c = 0; c < here.raster.columns; ++c) {
            if (planes[c].known()) continue;
            local_plane& plane = planes[c];
            plane = wide.planes[std::size_t(r / 2) * std::size_t(wide.raster.columns) + std::size_t(c / 2)];
            plane.height = plane.at(float((c + 0.5) * width - (c / 2 + 0.5) * twice),
                                    float((r + 0.5) * width - (r / 2 + 0.5) * twice));
          }
        },
        16);
  }

  std::vector<scale> scales_;  // from fine to coarse; those of an earlier, larger raster may follow
};

/// Height at (x, y) of a plane through points that vegetation may lie above: least squares, repeated without
/// what stands out upwards. Not known from fewer than three points.
inline local_plane plane_under(std::vector<Eigen::Vector3f>& points, float x, float y) {
  constexpr int max_iterations = 4;
  constexpr double min_step = 0.03;  // [m] roughness that every forest floor has
  local_plane plane;
  for (int iteration = 0; iteration < max_iterations && points.size() >= 3; ++iteration) {
    plane_moments moments;
    for (const Eigen::Vector3f& p : points) moments.add(p);
    plane = moments.fit(x, y, 3);
    const auto residual = [&](const Eigen::Vector3f& p) { return p.z() - plane.at(p.x() - x, p.y() - y); };
    double squares = 0;
    for (const Eigen::Vector3f& p : points) squares += double(residual(p)) * residual(p);
    const double limit = std::max(min_step, std::sqrt(squares / double(points.size())));
    if (std::erase_if(points, [&](const Eigen::Vector3f& p) { return residual(p) > limit; }) == 0) break;
  }
  return plane;
}

/// Ground at height 0 of the scan, wherever the scan has points.
inline terrain flat_terrain(const lowest_raster& lowest, double resolution) {
  terrain flat;
  flat.frame = lowest.frame;
  flat.resolution = resolution;
  flat.columns = lowest.columns / lowest_per_cloth_cell;
  flat.rows = lowest.rows / lowest_per_cloth_cell;
  const double zero = -(lowest.frame.local_from_scan_rotation * lowest.frame.origin).z();
  flat.heights.assign(std::size_t(flat.columns) * std::size_t(flat.rows), static_cast<float>(zero));
  flat.has_data.assign(flat.heights.size(), 1);
  return flat;
}

/// Heights [m] at the nodes of a raster of `columns` x `rows`, as wide as two cells of the lowest points,
/// under what grows on the ground: planes under the lowest points of blocks, each through those of 5 x 5
/// blocks without what stands out upwards.
inline std::vector<float> planes_under_vegetation(const lowest_raster& lowest, int columns, int rows,
                                                  const execution& exec = {}) {
  constexpr int cells_a_block = 4, half_width = 2;  // blocks of 1 m
  const double width = cells_a_block * lowest.resolution;
  const int across = (lowest.columns + cells_a_block - 1) / cells_a_block;
  const int along = (lowest.rows + cells_a_block - 1) / cells_a_block;
  const auto block = [&](int c, int r) { return std::size_t(r) * std::size_t(across) + std::size_t(c); };
  std::vector<Eigen::Vector3f> lowest_of(std::size_t(across) * std::size_t(along),
                                         Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  parallel_for(
      exec, "ground", std::size_t(along),
      [&](std::size_t row) {
        const int begin = int(row) * cells_a_block, end = std::min(begin + cells_a_block, lowest.rows);
        for (int r = begin; r < end; ++r)
          for (int c = 0; c < lowest.columns; ++c) {
            const Eigen::Vector3f& p = lowest.points[lowest.cell(c, r)];
            Eigen::Vector3f& kept = lowest_of[block(c / cells_a_block, int(row))];
            if (!std::isnan(p.z()) && !(kept.z() <= p.z())) kept = p;
          }
      },
      16);

  // A block without a plane of its own takes that of larger blocks.
  std::vector<local_plane> planes(lowest_of.size());
  parallel_for(
      exec, "ground", std::size_t(along),
      [&](std::size_t row) {
        std::vector<Eigen::Vector3f> nearby;
        const int r = int(row);
        for (int c = 0; c < across; ++c) {
          nearby.clear();
          for (int br = std::max(r - half_width, 0); br <= std::min(r + half_width, along - 1); ++br)
            for (int bc = std::max(c - half_width, 0); bc <= std::min(c + half_width, across - 1); ++bc)
              if (const Eigen::Vector3f& p = lowest_of[block(bc, br)]; !std::isnan(p.z()))
                nearby.push_back(p);
          if (nearby.size() >= 6)
            planes[block(c, r)] = plane_under(nearby, float((c + 0.5) * width), float((r + 0.5) * width));
        }
      },
      8);
  plane_pyramid pyramid;
  const auto& wider = pyramid.fit(
      width, across, along, half_width, 6,
      [&](int r, plane_moments* moments) {
        for (int c = 0; c < across; ++c)
          if (const Eigen::Vector3f& p = lowest_of[block(c, r)]; !std::isnan(p.z())) moments[c].add(p);
      },
      exec);
  for (std::size_t i = 0; i < planes.size(); ++i)
    if (!planes[i].known()) planes[i] = wider[i];

  std::vector<float> heights(std::size_t(columns) * std::size_t(rows));
  constexpr int nodes_a_block = cells_a_block / lowest_per_cloth_cell;
  parallel_for(
      exec, "ground", std::size_t(rows),
      [&](std::size_t row) {
        const int r = int(row);
        for (int c = 0; c < columns; ++c) {
          const int bc = c / nodes_a_block, br = r / nodes_a_block;
          const double x = (c + 0.5) * 2 * lowest.resolution, y = (r + 0.5) * 2 * lowest.resolution;
          heights[std::size_t(r) * std::size_t(columns) + std::size_t(c)] =
              planes[block(bc, br)].at(float(x - (bc + 0.5) * width), float(y - (br + 0.5) * width));
        }
      },
      16);
  return heights;
}

/// `terrain::interpolated_height` for points of the cells in one row, which are known to lie half a node from
/// each other.
class heights_along_cells {
 public:
  heights_along_cells(const terrain& ground, int row)
      : per_node_(float(1 / ground.resolution)), last_(ground.columns - 1) {
    row_ = between(row, ground.rows - 1);
    lower_ = ground.heights.data() + ground.node(0, row_);
    upper_ = ground.heights.data() + ground.node(0, std::min(row_ + 1, ground.rows - 1));
  }
  float at(int column, float x, float y) const {
    const int left = between(column, last_), right = std::min(left + 1, last_);
    const float u = x * per_node_ - (float(left) + 0.5f), v = y * per_node_ - (float(row_) + 0.5f);
    return (1 - v) * ((1 - u) * lower_[left] + u * lower_[right]) +
           v * ((1 - u) * upper_[left] + u * upper_[right]);
  }

 private:
  /// The node before a cell; of the outermost cells the nodes next to them.
  static int between(int cell, int last) {
    static_assert(lowest_per_cloth_cell == 2);
    return std::clamp((cell + 1) / 2 - 1, 0, std::max(last - 1, 0));
  }

  float per_node_;
  int last_, row_;
  const float *lower_, *upper_;
};

/// Which of the lowest points are ground, and how many of them lie at each node.
struct ground_marks {
  std::vector<std::uint8_t> is_ground;  // by cell
  std::vector<std::uint8_t> of_node;
};

/// Hands the ground points to the terrain, node by node. False when there are none.
inline bool collect_ground(const lowest_raster& lowest, const ground_marks& marks, terrain& result,
                           const execution& exec) {
  result.first_ground.reserve(marks.of_node.size() + 1);
  result.first_ground.push_back(0);
  for (const std::uint8_t count : marks.of_node)
    result.first_ground.push_back(result.first_ground.back() + count);
  result.ground.resize(result.first_ground.back());
  parallel_for(
      exec, "ground", std::size_t(result.rows),
      [&](std::size_t row) {
        for (int c = 0; c < result.columns; ++c) {
          std::uint32_t next = result.first_ground[result.node(c, int(row))];
          for (int dr = 0; dr < lowest_per_cloth_cell; ++dr)
            for (int dc = 0; dc < lowest_per_cloth_cell; ++dc) {
              const std::size_t i =
                  lowest.cell(c * lowest_per_cloth_cell + dc, int(row) * lowest_per_cloth_cell + dr);
              if (marks.is_ground[i]) result.ground[next++] = lowest.points[i];
            }
        }
      },
      16);
  return !result.ground.empty();
}

/// Marks the nodes of a terrain that ground lies near, within `hole` nodes.
inline void mark_data(const std::vector<std::uint8_t>& of_node, int hole, terrain& result,
                      const execution& exec) {
  const auto is_near = [&](int column, int row) {
    if (of_node[result.node(column, row)] > 0) return true;
    for (int r = std::max(row - hole, 0); r <= std::min(row + hole, result.rows - 1); ++r)
      for (int c = std::max(column - hole, 0); c <= std::min(column + hole, result.columns - 1); ++c)
        if (of_node[result.node(c, r)] > 0 &&
            (r - row) * (r - row) + (c - column) * (c - column) <= hole * hole)
          return true;
    return false;
  };
  result.has_data.resize(of_node.size());
  parallel_for(
      exec, "ground", std::size_t(result.rows),
      [&](std::size_t row) {
        for (int c = 0; c < result.columns; ++c)
          result.has_data[result.node(c, int(row))] = is_near(c, int(row)) ? 1 : 0;
      },
      16);
}

/// Fits the terrain to the lowest points near a surface under the vegetation, `heights` at its nodes: planes
/// through what lies around each node, once more without what stands out upwards; where too little lies
/// there, through what lies in ever larger blocks.
inline terrain fit_terrain(const lowest_raster& lowest, std::vector<float> heights, int columns, int rows,
                           const ground_options& options, const execution& exec = {}) {
  constexpr double min_points = 5, roughness = 0.08;  // [m] above planes that span 1.5 m
  terrain result;
  result.frame = lowest.frame;
  result.resolution = options.cloth.resolution;
  result.columns = columns;
  result.rows = rows;
  result.heights = std::move(heights);

  // Calls `visit(i, c, p)` for the cells of a row of nodes whose point lies near the heights so far.
  const auto for_each_near = [&](int row, double above, const auto& visit) {
    constexpr int cells = lowest_per_cloth_cell;  // a node
    const auto band_below = float(-options.ground_band), band_above = float(above);
    for (int r = row * cells; r < (row + 1) * cells; ++r) {
      const heights_along_cells ground(result, r);
      for (int c = 0; c < lowest.columns; ++c) {
        const std::size_t i = lowest.cell(c, r);
        const Eigen::Vector3f& p = lowest.points[i];
        if (std::isnan(p.z())) continue;
        const float height = p.z() - ground.at(c, p.x(), p.y());
        if (height > band_below && height < band_above) visit(i, c / cells, p);
      }
    }
  };
  plane_pyramid pyramid;
  for (const auto& [above, half_width] :
       {std::pair(options.ground_band, 2), {2.5 * roughness, 2}, {roughness, 1}, {roughness, 1}}) {
    const auto& planes = pyramid.fit(
        result.resolution, columns, rows, half_width, min_points,
        [&, limit = above](int row, plane_moments* moments) {
          for_each_near(row, limit, [&](std::size_t, int c, const Eigen::Vector3f& p) { moments[c].add(p); });
        },
        exec);
    parallel_for(exec, "ground", planes.size(), [&](std::size_t i) {
      if (planes[i].known()) result.heights[i] = planes[i].height;
    });
  }
  ground_marks marks{std::vector<std::uint8_t>(lowest.points.size()),
                     std::vector<std::uint8_t>(result.heights.size())};
  parallel_for(
      exec, "ground", std::size_t(rows),
      [&](std::size_t row) {
        for_each_near(int(row), roughness, [&](std::size_t i, int c, const Eigen::Vector3f&) {
          marks.is_ground[i] = 1;
          ++marks.of_node[result.node(c, int(row))];
        });
      },
      16);
  if (!collect_ground(lowest, marks, result, exec)) return {};
  mark_data(marks.of_node, int(options.hole_radius / result.resolution), result, exec);
  return result;
}

/// The ground under a scan. `up` points away from it, in the frame of the scan. The terrain is empty when no
/// point is finite. Throws `std::invalid_argument` naming a bad option, `operation_cancelled` on request.
template <point_range R>
ground_model model_ground(const R& scan, const ground_options& options = {},
                          const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ(), const execution& exec = {}) {
  require_valid(options);
  ground_model model;
  const double resolution = options.cloth.resolution / lowest_per_cloth_cell;
  lowest_raster lowest = gather_lowest_points(scan, resolution, up, model.funnel, exec);
  if (lowest.points.empty()) return model;
  if (options.filter == ground_filter::normalized) {
    model.terrain = flat_terrain(lowest, options.cloth.resolution);
    model.funnel.ground_points = model.funnel.cells;  // no ground is looked for
    return model;
  }
  model.funnel.low_outliers = remove_low_outliers(lowest, options.low_point_depth, exec);
  model.funnel.unreachable = remove_unreachable(lowest, options.max_slope, options.ground_band, exec);

  const int columns = lowest.columns / lowest_per_cloth_cell;
  const int rows = lowest.rows / lowest_per_cloth_cell;
  std::vector<float> heights =
      options.filter == ground_filter::cloth
          ? simulate_cloth(cloth_cell_minima(lowest, columns, rows), columns, rows, options.cloth, exec)
                .heights
          : planes_under_vegetation(lowest, columns, rows, exec);
  model.terrain = fit_terrain(lowest, std::move(heights), columns, rows, options, exec);
  model.funnel.ground_points = model.terrain.ground.size();
  return model;
}
}  // namespace globalmatch::detail
