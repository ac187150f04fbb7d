// Options of stem mapping ([GM] 3.1), step by step.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <stdexcept>

namespace globalmatch {

namespace detail {
/// Throws `std::invalid_argument` with the message, which names an option, unless it holds.
inline void require(bool holds, const char* message) {
  if (!holds) throw std::invalid_argument(message);
}
}  // namespace detail

/// The cloth simulation that finds ground ([CSF]); of `ground_filter::cloth`.
struct cloth_options {
  int rigidness = 2;         ///< rounds of internal forces a step: 1 steep, 2 hilly, 3 flat ground ([CSF] RI)
  double time_step = 0.65;   ///< ([CSF] dT)
  double gravity = 0.2;      ///< [m] a squared unit of time (ours: [CSF] names no value)
  int max_iterations = 500;  ///< ([CSF])
  double convergence_threshold =
      0.005;                ///< [m] the cloth is at rest when no particle moves further in a step (ours)
  double slope_step = 0.3;  ///< [m] slope post-processing: a hanging particle drops to its ground where that
                            ///< lies within this of a resting neighbour's ([CSF] h_cc)
};

/// How ground is separated from what grows on it.
enum class ground_filter {
  planes,      ///< local planes under the lowest points, from those of blocks upwards (ours)
  cloth,       ///< a cloth that falls on the lowest points from below ([GM] 3.1)
  normalized,  ///< not at all: heights are above the ground already, which lies at 0 and may be missing
               ///< (ours)
};

/// How ground is distinguished from what stands on it ([GM] 3.1).
struct ground_options {
  ground_filter filter = ground_filter::planes;  ///< what tells ground from the rest
  double resolution = 0.5;  ///< [m] of the terrain, and of the particles of a cloth ([CSF] GR: 0.5)
  cloth_options cloth = {};
  double low_point_depth = 0.3;  ///< [m] a lowest point this far below its neighbours is no ground (ours)
  double max_slope = 1.0;        ///< [m/m] what stands out more steeply is no ground (ours)
  double ground_band = 0.5;      ///< [m] lowest points within this of cloth or planes are ground ([CSF] h_cp)
  double hole_radius = 1.5;      ///< [m] further than this from all ground points there is no data (ours)
};

/// Throws `std::invalid_argument` naming the field that makes no sense.
inline void require_valid(const ground_options& options) {
  const cloth_options& cloth = options.cloth;
  const double first_fall = cloth.gravity * cloth.time_step * cloth.time_step;
  const auto in = [](double value, double maximum) { return value > 0 && value <= maximum; };
  detail::require(options.resolution >= 0.01 && options.resolution <= 1000,
                  "ground.resolution must lie in [0.01, 1000] m");
  detail::require(cloth.rigidness >= 1 && cloth.rigidness <= 100,
                  "ground.cloth.rigidness must lie in [1, 100]");
  detail::require(cloth.max_iterations >= 1, "ground.cloth.max_iterations must be at least 1");
  detail::require(in(cloth.time_step, 1000), "ground.cloth.time_step must lie in (0, 1000]");
  detail::require(in(cloth.gravity, 1000), "ground.cloth.gravity must lie in (0, 1000]");
  detail::require(cloth.convergence_threshold > 0 && cloth.convergence_threshold < first_fall,
                  "ground.cloth.convergence_threshold must be positive and less than the first fall, "
                  "gravity * time_step^2");
  detail::require(in(cloth.slope_step, 1000), "ground.cloth.slope_step must lie in (0, 1000] m");
  detail::require(in(options.low_point_depth, 1000), "ground.low_point_depth must lie in (0, 1000] m");
  detail::require(in(options.max_slope, 1000), "ground.max_slope must lie in (0, 1000]");
  detail::require(in(options.ground_band, 1000), "ground.ground_band must lie in (0, 1000] m");
  detail::require(in(options.hole_radius, 100), "ground.hole_radius must lie in (0, 100] m");
}

/// The layer in which stems are looked for ([GM] 3.1).
struct understory_options {
  double min_height = 0.2;  ///< [m] above the terrain ([GM] 3.1: 0.2)
  double max_height = 3.0;  ///< [m] above the terrain ([GM] 3.1: 3)
};

/// Throws `std::invalid_argument` when the layer is empty by its limits.
inline void require_valid(const understory_options& options) {
  detail::require(options.min_height < options.max_height,
                  "understory.min_height must be less than understory.max_height");
}

/// Which points are on vertical surfaces ([GM] 3.1).
struct verticality_options {
  bool constraint = true;  ///< false: every understory point may be of a stem ([GM] 5.3.1)
  /// gamma: stem points have a higher verticality ([GM] 3.1: 0.9). Empty: 0.9 for points; 0.5 for cells,
  /// which lets through stems that lean by 30 degrees: cylinders then decide.
  std::optional<double> threshold = {};
  /// [m] radius of the ball whose points make the normal ([GM] 3.1: 0.10). Empty: 0.10 where such a ball
  /// holds `min_neighbors`, else as much more as it takes to hold them, up to `max_radius`.
  std::optional<double> radius = {};
  int min_neighbors = 10;    ///< for a radius from the data (ours)
  double max_radius = 0.25;  ///< [m] for a radius from the data (ours)
};

/// Throws `std::invalid_argument` naming the field that makes no sense.
inline void require_valid(const verticality_options& options) {
  detail::require(!options.threshold || (*options.threshold >= 0 && *options.threshold < 1),
                  "verticality.threshold must lie in [0, 1)");
  detail::require(!options.radius || (*options.radius >= 1e-3 && *options.radius <= 100),
                  "verticality.radius must lie in [0.001, 100] m");
  detail::require(options.min_neighbors >= 3, "verticality.min_neighbors must be at least 3");
  detail::require(options.max_radius >= 1e-3 && options.max_radius <= 100,
                  "verticality.max_radius must lie in [0.001, 100] m");
}

/// What a stem looks like where a cylinder is fitted to it ([GM] 3.1).
struct cylinder_options {
  double min_radius = 0.02;  ///< [m] (ours)
  double max_radius = 0.60;  ///< [m] (ours)
  double max_tilt_deg = 30;  ///< [degrees] between axis and up (ours)
  /// [m] points this near the surface lie on it (ours). Empty: 0.02, or from the noise of the scan where many
  /// stems are fitted.
  std::optional<double> distance_tolerance = {};
  /// [m/m] by which radii shrink upwards, more or less: the taper is then fitted, and held near this where
  /// points tell little of it (ours; stems grow about 1 cm thinner a metre). Empty: cylinders proper, as in
  /// [GM].
  std::optional<double> usual_taper = {};
  double taper_weight = 30;  ///< it is held as firmly as so many points at one metre would hold it (ours)
  int max_iterations = 300;  ///< at most this many hypotheses (ours)
  std::uint64_t seed = 1;
};

/// Throws `std::invalid_argument` naming the field that makes no sense.
inline void require_valid(const cylinder_options& options) {
  detail::require(options.min_radius >= 1e-3 && options.min_radius < options.max_radius,
                  "cylinder.min_radius must be at least 0.001 m and less than cylinder.max_radius");
  detail::require(options.max_radius <= 100, "cylinder.max_radius must be at most 100 m");
  detail::require(options.max_tilt_deg >= 0 && options.max_tilt_deg <= 89,
                  "cylinder.max_tilt_deg must lie in [0, 89] degrees");
  detail::require(!options.distance_tolerance ||
                      (*options.distance_tolerance >= 1e-6 && *options.distance_tolerance <= 10),
                  "cylinder.distance_tolerance must lie in [1e-6, 10] m");
  detail::require(!options.usual_taper || std::isfinite(*options.usual_taper),
                  "cylinder.usual_taper must be finite");
  detail::require(options.taper_weight > 0 && std::isfinite(options.taper_weight),
                  "cylinder.taper_weight must be positive and finite");
  detail::require(options.max_iterations >= 1, "cylinder.max_iterations must be at least 1");
}

/// [GM] gives no values: all are ours.
struct stem_cylinder_options {
  cylinder_options cylinder = {.usual_taper = 0.005};
  double column_width = 0.25;  ///< [m] a stem is first looked for in a column of this width
  int min_points = 15;         ///< on the surface of a stem
  double min_height = 0.8;     ///< [m] that these points fill, in steps of 0.1 m;
                               ///< `min_quality` decides about low ones
  double min_filled = 0.6;     ///< share of the height from the lowest to the
                               ///< highest of them that they fill
  double min_share = 0.6;      ///< of the points in and within 0.1 m of a stem,
                               ///< this share lies on its surface
  double max_inside = 0.4;     ///< points in a stem, as a share of those on its surface
  double max_sigma = 0.01;     ///< [m] uncertainty of the axis in plan: a fifth
                               ///< of the matching tolerance
};

/// Throws `std::invalid_argument` naming the field that makes no sense.
inline void require_valid(const stem_cylinder_options& options) {
  require_valid(options.cylinder);
  const auto is_share = [](double share) { return share >= 0 && share <= 1; };
  detail::require(options.column_width >= 0.01 && options.column_width <= 10,
                  "stems.column_width must lie in [0.01, 10] m");
  detail::require(options.min_height >= 0 && options.min_height <= 1000,
                  "stems.min_height must lie in [0, 1000] m");
  detail::require(is_share(options.min_filled), "stems.min_filled must lie in [0, 1]");
  detail::require(is_share(options.min_share), "stems.min_share must lie in [0, 1]");
  detail::require(is_share(options.max_inside), "stems.max_inside must lie in [0, 1]");
  detail::require(options.max_sigma > 0 && std::isfinite(options.max_sigma),
                  "stems.max_sigma must be positive and finite");
  detail::require(options.min_points >= 6, "stems.min_points must be at least 6");
}

/// What stem points are decided by.
enum class stem_point_rule {
  cells,   ///< the surfaces through cells of 5 cm: a cost for each cell (ours)
  points,  ///< the surfaces through points, one for each voxel: a cost for each point ([GM] 3.1)
};

/// Where the vertical of a map comes from.
enum class vertical_rule {
  given,            ///< from the caller ([GM] takes scans as levelled)
  stems_if_tilted,  ///< from the stems where they stand clearly tilted against what the caller gave (ours)
  stems,            ///< from the stems, if there are enough (ours)
};

/// Options of `map_stems`: of each step of [GM] 3.1, in their order.
struct mapping_options {
  ground_options ground = {};
  understory_options understory = {};
  stem_point_rule rule = stem_point_rule::cells;
  /// [m] Of the understory one point a voxel ([GM] 3.1: 0.01), with `stem_point_rule::points`; with cells a
  /// point that is nearer to the one kept before it, in the order of the scan, is left out (ours).
  double voxel_size = 0.01;
  globalmatch::verticality_options verticality = {};
  /// [m] with `stem_point_rule::points`: stem points nearer than this are of one cluster ([GM] gives no
  /// value). Empty: three times the spacing of points at hand, at least 0.05.
  std::optional<double> link_distance = {};
  stem_cylinder_options stems = {};
  /// What is less likely to be a stem is left out (ours). A thin `understory` layer fills less height, and
  /// needs a lower one.
  double min_quality = 0.6;
  vertical_rule vertical = vertical_rule::stems_if_tilted;
  /// [m] Where the scanner stood, frame of the scan (ours): by how far it saw from there matching knows where
  /// no stem stands. Empty: not known. A scan that was not taken from there shows it by its own stems.
  std::optional<std::array<double, 3>> scanner = std::array<double, 3>{0, 0, 0};
};

/// Throws `std::invalid_argument` naming the field that makes no sense.
inline void require_valid(const mapping_options& options) {
  require_valid(options.ground);
  require_valid(options.understory);
  require_valid(options.verticality);
  require_valid(options.stems);
  detail::require(options.voxel_size >= 1e-4 && options.voxel_size <= 10,
                  "voxel_size must lie in [0.0001, 10] m");
  detail::require(options.min_quality >= 0 && options.min_quality <= 1, "min_quality must lie in [0, 1]");
  for (const double coordinate : options.scanner.value_or(std::array<double, 3>{}))
    detail::require(std::isfinite(coordinate), "scanner must be finite");
  detail::require(
      !options.link_distance || (*options.link_distance >= 1e-4 && *options.link_distance <= 1000),
      "link_distance must lie in [0.0001, 1000] m");
}

}  // namespace globalmatch
