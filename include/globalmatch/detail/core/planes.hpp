// Planes through points by least squares, for every block of a raster.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "globalmatch/detail/core/threads.hpp"
#include "globalmatch/detail/core/vectors.hpp"
#include "globalmatch/execution.hpp"

namespace globalmatch::detail {

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

  void add(const vec3f& p) {
    const double px = p.x, py = p.y, pz = p.z;
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

}  // namespace globalmatch::detail
