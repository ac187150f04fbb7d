// What is known of a scan once its stems are mapped: stems, terrain, vertical, samples, and the funnel of
// counts.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "globalmatch/detail/core/local_frame.hpp"
#include "globalmatch/detail/core/visible_ranges.hpp"
#include "globalmatch/points.hpp"

namespace globalmatch {

/// One step between the points of a scan and the correspondences.
struct funnel_step {
  std::string_view step;    ///< its name, as in the reasons of a decision
  std::string_view of;      ///< what came in
  std::size_t in = 0;       ///< how many
  std::string_view what;    ///< what went out
  std::size_t out = 0;      ///< how many
  std::string_view rest;    ///< why the rest was dropped
  std::string_view remedy;  ///< what to look at where too little is left
};

namespace detail {
/// The first step that leaves nothing, or else the first that leaves fewer than `minimum`, as in "ground: 0
/// ground points of 17 raster cells; is `up` the direction away from the ground?"; empty when there is none.
inline std::string where_lost(const std::vector<funnel_step>& steps, std::size_t minimum) {
  for (const std::size_t fewer_than : {std::size_t(1), minimum})
    for (const funnel_step& s : steps)
      if (s.out < fewer_than)
        return std::string(s.step) + ": " + std::to_string(s.out) + " " + std::string(s.what) + " of " +
               std::to_string(s.in) + " " + std::string(s.of) + "; " + std::string(s.remedy);
  return "";
}
}  // namespace detail

/// What became of the points on their way into the terrain.
struct ground_funnel {
  std::size_t points = 0;         ///< points of the scan
  std::size_t not_finite = 0;     ///< of these skipped: NaN, infinite, or further than any plot
  std::size_t low_points = 0;     ///< of these left out: noise scattered below the ground
  std::size_t cells = 0;          ///< raster cells that hold points
  std::size_t cells_apart = 0;    ///< of these left out: not connected to where most of the scan lies
  std::size_t low_outliers = 0;   ///< of these left out: their lowest point is a multipath return
  std::size_t unreachable = 0;    ///< of these left out: no ground is so steep
  std::size_t ground_points = 0;  ///< lowest points near the terrain
  double coordinate_step = 0;     ///< [m] of x or y, where it is a decimetre or more: digits were lost
};

/// How many points and finds each step left.
struct mapping_funnel {
  ground_funnel ground;
  std::size_t understory = 0;   ///< points in the understory layer
  bool by_cells = true;         ///< the next two count cells of 5 cm, not points
  std::size_t thinned = 0;      ///< cells that hold points, or points, one a voxel
  std::size_t stem_points = 0;  ///< of these vertical ones
  std::size_t clusters = 0;     ///< groups of stem points
  std::size_t cylinders = 0;    ///< found in them
  std::size_t likely = 0;       ///< of these with a quality of `min_quality` and more
  std::size_t stems = 0;        ///< after merging and meeting the terrain
};

/// What each step was given and left, in their order.
inline std::vector<funnel_step> explain(const mapping_funnel& f) {
  const std::size_t finite = f.ground.points - f.ground.not_finite;
  const std::string_view stem_points = f.by_cells ? "stem cells" : "stem points";
  return {
      {"scan", "points", f.ground.points, "points with a place", finite,
       "not finite, or further away than any plot", "look at how the scan was read"},
      {"ground", "raster cells", f.ground.cells, "ground points", f.ground.ground_points,
       "apart from the rest, multipath returns, or above the ground",
       "is `up` the direction away from the ground, and are the coordinates metres?"},
      {"understory", "points with a place", finite, "understory points", f.understory,
       "too near the terrain, too high above it, or where it is not known",
       "is `up` the direction away from the ground, and are the coordinates metres?"},
      f.by_cells ? funnel_step{"cells", "understory points", f.understory, "cells", f.thinned,
                               "others in their cell", "is the unit of the scan metres?"}
                 : funnel_step{"voxels", "understory points", f.understory, "thinned points", f.thinned,
                               "others in their voxel", "is the voxel size right for the scan?"},
      {"verticality", f.by_cells ? "cells" : "thinned points", f.thinned, stem_points, f.stem_points,
       "not on vertical surfaces", "is `up` right, and is the scan dense enough for normals?"},
      {"clusters", stem_points, f.stem_points, "clusters", f.clusters, "together, or too few together",
       "a scanner nearer to the stems, or a denser scan, is needed"},
      {"cylinders", "clusters", f.clusters, "cylinders", f.cylinders, "not like a stem",
       "a scanner nearer to the stems, or a denser scan, is needed"},
      {"quality", "cylinders", f.cylinders, "likely stems", f.likely, "less likely a stem than `min_quality`",
       "a scanner nearer to the stems, a denser scan, or a lower `min_quality` is needed"},
      {"stem positions", "likely stems", f.likely, "stems", f.stems,
       "of one stem, or without terrain where their axes meet it", "ground must be seen around the stems"},
  };
}

/// What the heights of a map rest on.
enum class ground_status {
  seen,        ///< on ground that lies under the scan as a connected surface
  none,        ///< on the lowest points, which are no ground: heights are off by an unknown amount
  normalised,  ///< on height 0: the scan's own heights are those above the ground already
};

/// The name of the status, as in the JSON output.
constexpr std::string_view to_string(ground_status status) {
  switch (status) {
    case ground_status::seen:
      return "seen";
    case ground_status::none:
      return "none";
    case ground_status::normalised:
      return "normalised";
  }
  return "";
}

/// Heights at the nodes of a regular raster in a levelled local frame; all lengths in metres, all coordinates
/// in that frame. Node (c, r) lies at x = (c + 0.5) resolution, y = (r + 0.5) resolution.
class terrain {
 public:
  detail::local_frame frame;                   ///< from that of the scan
  double resolution = 0;                       ///< [m] between nodes
  int columns = 0, rows = 0;                   ///< nodes along x, along y
  std::vector<float> heights;                  ///< row by row; interpolated where no ground was seen
  std::vector<std::uint8_t> has_data;          ///< 1 where ground was seen near the node
  std::vector<detail::vec3f> ground;           ///< the ground points the heights were fitted to, node by node
  std::vector<std::uint32_t> first_ground;     ///< of each node, in `ground`; one more than nodes, or empty
  std::vector<std::uint8_t> in_surface;        ///< 1 where ground extends as a surface; empty: not determined
  ground_status status = ground_status::seen;  ///< whether heights are those of ground
  bool cut_off = false;  ///< all below some height is missing: ground is what lies in a surface, else unknown

  bool empty() const { return heights.empty(); }
  /// Its index in `heights`.
  std::size_t node(int c, int r) const { return std::size_t(r) * std::size_t(columns) + std::size_t(c); }

  /// Whether (x, y) lies on the raster.
  bool covers(double x, double y) const {
    return !empty() && x >= 0 && y >= 0 && x <= columns * resolution && y <= rows * resolution;
  }

  /// Height at (x, y), bilinear between nodes, also where no ground was seen. Requires `covers(x, y)`.
  double interpolated_height(double x, double y) const {
    const double per_node = 1 / resolution, gx = x * per_node - 0.5, gy = y * per_node - 0.5;
    const int c = std::clamp(static_cast<int>(gx), 0, std::max(columns - 2, 0));
    const int r = std::clamp(static_cast<int>(gy), 0, std::max(rows - 2, 0));
    const double u = gx - c, v = gy - r;
    const std::size_t lower = node(c, r), upper = node(c, std::min(r + 1, rows - 1));
    const std::size_t right = c + 1 < columns ? 1 : 0;
    return (1 - v) * ((1 - u) * heights[lower] + u * heights[lower + right]) +
           v * ((1 - u) * heights[upper] + u * heights[upper + right]);
  }

  /// Whether ground was seen near (x, y).
  bool is_known(double x, double y) const {
    if (!covers(x, y)) return false;
    const int c = std::min(static_cast<int>(x / resolution), columns - 1);
    const int r = std::min(static_cast<int>(y / resolution), rows - 1);
    return has_data[node(c, r)] != 0;
  }

  /// Whether the node of (x, y), which the raster covers, lies in a surface of ground.
  bool is_in_surface(double x, double y) const {
    const int c = std::min(static_cast<int>(x / resolution), columns - 1);
    const int r = std::min(static_cast<int>(y / resolution), rows - 1);
    return in_surface[node(c, r)] != 0;
  }

  /// Calls `visit(p)` for the ground points of the nodes within `search_radius` [m] of (x, y), in each
  /// coordinate.
  template <class Visit>
  void for_each_ground_near(double x, double y, double search_radius, const Visit& visit) const {
    if (first_ground.empty()) return;
    const auto number = [&](double v, int maximum) {
      return static_cast<int>(std::clamp(std::floor(v / resolution), 0.0, double(maximum - 1)));
    };
    const int left = number(x - search_radius, columns), right = number(x + search_radius, columns);
    const int top = number(y + search_radius, rows);
    for (int r = number(y - search_radius, rows); r <= top; ++r)
      for (std::uint32_t i = first_ground[node(left, r)]; i < first_ground[node(right, r) + 1]; ++i)
        visit(ground[i]);
  }

  /// Height at (x, y), or nothing outside the raster and where no ground was seen.
  std::optional<double> height_at(double x, double y) const {
    if (!is_known(x, y)) return std::nullopt;
    return interpolated_height(x, y);
  }
};

constexpr double breast_height = 1.3;  ///< [m] above the ground, where diameters are measured

/// A stem, in the frame of its scan.
struct stem {
  Eigen::Vector3d position = {0, 0, 0};  ///< [m] where the axis meets the terrain
  Eigen::Vector3d axis = {0, 0, 1};      ///< unit, pointing up
  double radius = 0;                     ///< [m] at breast height, 1.3 m above the ground
  double radius_sigma = 0;               ///< [m] uncertainty of the radius
  double taper = 0;                      ///< [m/m] by which it grows thinner upwards
  double position_sigma = 0;             ///< [m] uncertainty in plan of the axis
  double height_sigma = 0;               ///< [m] uncertainty of the ground's height; never 0 when mapped
  double quality = 1;                    ///< probability that it is a stem, `stem_quality`
  bool ground_seen = true;               ///< false: the terrain is interpolated there
  std::uint32_t ground_points = 0;       ///< cells of 0.25 m within 1 m of it that hold ground, of some 50
  /// Points of the scan that lie on it, increasing; of those that were not thinned out
  std::vector<point_index> support;
};

/// A stem is a position that knows its radius, its axis, and how uncertain it is.
template <>
struct point_traits<stem> {
  static const Eigen::Vector3d& xyz(const stem& s) { return s.position; }
  static double radius(const stem& s) { return s.radius; }
  static double position_sigma(const stem& s) { return s.position_sigma; }
  static double height_sigma(const stem& s) { return s.height_sigma; }
  static const Eigen::Vector3d& axis(const stem& s) { return s.axis; }
};

/// How stems stand.
struct upright_direction {
  Eigen::Vector3d up = {0, 0, 1};  ///< unit, frame of the stems
  double sigma = 0;                ///< [rad] standard deviation, in any direction
};

/// What is known of a scan once its stems are mapped; everything that matching and registration need.
struct stem_map {
  std::vector<stem> stems;                   ///< ordered by position, frame of the scan
  globalmatch::terrain terrain;              ///< heights, local frame
  Eigen::Vector3d up = {0, 0, 1};            ///< the vertical, unit, frame of the scan
  Eigen::Vector3d given_up = {0, 0, 1};      ///< what the caller gave for it, unit
  bool up_by_stems = false;                  ///< the vertical comes from the stems
  std::optional<upright_direction> upright;  ///< how the stems stand, frame of the scan
  double spacing_near = 0;                   ///< [m] of the understory points: a tenth are closer together
  double spacing_far = 0;                    ///< [m] a tenth are wider apart
  double distance_tolerance = 0;  ///< [m] points this near a stem's surface were taken to lie on it
  std::vector<Eigen::Vector3d> ground_samples;  ///< ground points, frame of the scan
  std::vector<Eigen::Vector3d> stem_samples;    ///< points on the stems, thinned, frame of the scan
  std::vector<Eigen::Vector3d> stem_normals;    ///< unit, from the stem's axis to each of these
  /// How far the scanner saw in each direction, frame of the terrain; empty where it is not known where it
  /// stood, or where the scan was taken from several places
  detail::visible_ranges visible;
  mapping_funnel funnel;
  bool cancelled = false;  ///< the progress callback said so; nothing else is filled
};

namespace detail {
/// Whether stems are clearly tilted against `up` (unit): by more than their uncertainty explains, and more
/// than stands are that lean with the wind.
template <class V>
bool is_tilted(const upright_direction& upright, const V& up) {
  constexpr double deviations = 4, usual = 4 * std::numbers::pi / 180;  // [rad]
  return angle_between(upright.up, up) > std::max(usual, deviations * upright.sigma);
}
}  // namespace detail

/// Whether the scan was clearly not level: its stems are tilted against the `up` that the caller gave.
inline bool is_tilted(const stem_map& map) {
  return map.upright && detail::is_tilted(*map.upright, map.given_up);
}

/// How far, for people, and the remedy: "stand 8.1 degrees off the vertical ...".
inline std::string describe_tilt(const stem_map& map) {
  const int tenths =
      int(std::lround(detail::angle_between(map.upright->up, map.given_up) * 1800 / std::numbers::pi));
  return "stand " + std::to_string(tenths / 10) + "." + std::to_string(tenths % 10) +
         " degrees off the vertical" + (map.up_by_stems ? ", which is taken from them instead" : "") +
         "; a scan that was not level should turn freely (dof 6)";
}

}  // namespace globalmatch
