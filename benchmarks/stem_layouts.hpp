// Made-up forests seen twice, for the matching benchmarks.
#pragma once

#include "globalmatch/detail/core/random.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <vector>

namespace globalmatch::benchmarks {

using namespace detail;

using positions = std::vector<Eigen::Vector3d>;

/// How a map differs from the forest.
struct view_options {
  double noise = 0.01;        ///< [m] standard deviation of each coordinate
  double detected = 0.85;     ///< share of the stems that are in the map
  double false_stems = 0.10;  ///< added, as a share of those
  /// [m] standard deviation of measured radii; nothing: radii are not measured
  std::optional<double> radius_noise = {};
};

/// Ground that rolls along both axes.
struct relief {
  double along_x = 17, along_y = 13;  ///< [m] a radian of the waves
  double start_x = 0, start_y = 0;    ///< [rad] of the waves at 0

  /// [m]
  double operator()(double x, double y) const {
    return 2 * std::sin(x / along_x + start_x) + 1.5 * std::cos(y / along_y + start_y);
  }
};

/// How stems of a forest stand.
struct stand_options {
  double jitter = 0.12;  ///< [m] standard deviation of stems in rows, in x and in y
  relief ground = {};
};

/// Two maps of one forest and the true transform between them.
struct two_maps {
  positions source, target;
  Eigen::Isometry3d target_from_source;
  std::size_t common = 0;                          ///< stems in both
  std::vector<double> source_radii, target_radii;  ///< [m] of each stem, where they are measured
};

/// A stem as a caller has it who measured radii.
struct measured_stem {
  double x, y, z, radius;
};

inline std::vector<measured_stem> with_radii(const positions& stems, const std::vector<double>& radii) {
  std::vector<measured_stem> measured;
  for (std::size_t i = 0; i < stems.size(); ++i)
    measured.push_back({stems[i].x(), stems[i].y(), stems[i].z(), radii[i]});
  return measured;
}

inline double uniform(random_source& random, double from, double to) {
  return from + (to - from) * random.uniform();
}

template <class T>
const T& any_of(const std::vector<T>& values, random_source& random) {
  return values[random.below(static_cast<std::uint32_t>(values.size()))];
}

inline Eigen::Vector3d gaussian(random_source& random, double sigma) {
  return sigma * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
}

/// Stems on `width` by `depth` [m], 900 a hectare. For what is shown and tuned: "random", "clumped", and
/// "rows" 3 m apart. For what must hold elsewhere as well: "spaced" at least 2 m apart, "gradient", ever
/// denser along x, and "staggered" rows, each shifted by half a spacing.
inline positions plant(std::string_view layout, double width, double depth, random_source& random,
                       const stand_options& stand = {}) {
  constexpr double density = 0.09, row_spacing = 3, stems_a_clump = 12, clump_spread = 2.5, apart = 2;
  positions stems;
  const auto add = [&](double x, double y) { stems.push_back({x, y, stand.ground(x, y)}); };
  const auto count = std::size_t(width * depth * density);
  if (layout == "random") {
    for (std::size_t i = 0; i < count; ++i) add(uniform(random, 0, width), uniform(random, 0, depth));
  } else if (layout == "clumped") {
    positions centers;
    for (std::size_t i = 0; i < 1 + count / std::size_t(stems_a_clump); ++i)
      centers.push_back({uniform(random, 0, width), uniform(random, 0, depth), 0});
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector3d& center = centers[random.below(static_cast<std::uint32_t>(centers.size()))];
      add(center.x() + clump_spread * random.normal(), center.y() + clump_spread * random.normal());
    }
  } else if (layout == "rows" || layout == "staggered") {
    bool shifted = false;
    for (double x = 0; x < width; x += row_spacing, shifted = !shifted)
      for (double y = layout == "staggered" && shifted ? row_spacing / 2 : 0; y < depth; y += row_spacing)
        add(x + stand.jitter * random.normal(), y + stand.jitter * random.normal());
  } else if (layout == "spaced") {
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector3d p(uniform(random, 0, width), uniform(random, 0, depth), 0);
      if (std::all_of(stems.begin(), stems.end(),
                      [&](const Eigen::Vector3d& q) { return (p - q).head<2>().norm() >= apart; }))
        add(p.x(), p.y());
    }
  } else if (layout == "gradient") {
    for (std::size_t i = 0; i < count; ++i)
      add(width * std::sqrt(random.uniform()), uniform(random, 0, depth));
  } else {
    throw std::invalid_argument("layout must be random, clumped, rows, spaced, gradient or staggered");
  }
  return stems;
}

/// Radius [m] of a stem at this place: they differ by a sixth, and grow along x and shrink again.
inline double any_radius(double x, random_source& random) {
  return std::max(0.04, 0.12 + 0.015 * std::sin(x / 20) + 0.02 * random.normal());
}

/// Two maps of a forest on `width` by `side` [m] and more: squares of that side, at both ends of it.
inline two_maps look_twice(const positions& forest, double width, double side, const view_options& options,
                           const Eigen::Isometry3d& target_from_source, random_source& random,
                           const relief& ground = {}) {
  two_maps maps;
  maps.target_from_source = target_from_source;
  const auto measure = [&](std::vector<double>& radii, double radius) {
    if (options.radius_noise)
      radii.push_back(std::max(0.0, radius + *options.radius_noise * random.normal()));
  };
  for (const Eigen::Vector3d& p : forest) {
    const double radius = options.radius_noise ? any_radius(p.x(), random) : 0;
    const bool in_source = p.x() < side && random.uniform() < options.detected;
    if (in_source) {
      maps.source.push_back(p + gaussian(random, options.noise));
      measure(maps.source_radii, radius);
    }
    const bool in_target = p.x() > width - side && random.uniform() < options.detected;
    if (in_target) {
      maps.target.push_back(maps.target_from_source * Eigen::Vector3d(p + gaussian(random, options.noise)));
      measure(maps.target_radii, radius);
    }
    maps.common += in_source && in_target;
  }
  const auto add_false = [&](positions& map, std::vector<double>& radii, double from,
                             const Eigen::Isometry3d& transform) {
    for (auto i = std::size_t(options.false_stems * double(map.size())); i > 0; --i) {
      const double x = uniform(random, from, from + side), y = uniform(random, 0, side);
      map.push_back(transform * Eigen::Vector3d(x, y, ground(x, y)));
      if (options.radius_noise) measure(radii, any_radius(x, random));
    }
  };
  add_false(maps.source, maps.source_radii, 0, Eigen::Isometry3d::Identity());
  add_false(maps.target, maps.target_radii, width - side, maps.target_from_source);
  return maps;
}

inline Eigen::Isometry3d any_yaw_elsewhere(random_source& random) {
  return Eigen::Translation3d(50, -60, 7) *
         Eigen::AngleAxisd(uniform(random, -std::numbers::pi, std::numbers::pi), Eigen::Vector3d::UnitZ());
}

/// Two maps of about `stems` stems each that share `overlap` of their area.
inline two_maps overlapping_maps(std::string_view layout, std::size_t stems, double overlap,
                                 const view_options& options, random_source& random,
                                 const stand_options& stand = {}) {
  const double density = layout == "rows" || layout == "staggered" ? 1.0 / 9 : 0.09;
  const double side = std::sqrt(double(stems) / (density * options.detected * (1 + options.false_stems)));
  const double width = (2 - overlap) * side;
  const Eigen::Isometry3d target_from_source = any_yaw_elsewhere(random);
  return look_twice(plant(layout, width, side, random, stand), width, side, options, target_from_source,
                    random, stand.ground);
}

/// Largest distance [m] between the stems under both transforms.
inline double max_error(const Eigen::Isometry3d& estimate, const Eigen::Isometry3d& truth,
                        const positions& stems) {
  double largest = 0;
  for (const Eigen::Vector3d& p : stems) largest = std::max(largest, (estimate * p - truth * p).norm());
  return largest;
}

/// Mean distance [m] between the stems under both transforms.
inline double mean_error(const Eigen::Isometry3d& estimate, const Eigen::Isometry3d& truth,
                         const positions& stems) {
  double sum = 0;
  for (const Eigen::Vector3d& p : stems) sum += (estimate * p - truth * p).norm();
  return sum / double(stems.size());
}

}  // namespace globalmatch::benchmarks
