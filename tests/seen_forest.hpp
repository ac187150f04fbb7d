// A forest on level ground as scanners in it see it: stems that hide others, and how far each scanner sees.
#pragma once

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "globalmatch/detail/core/eigen_border.hpp"
#include "made_up_maps.hpp"

namespace globalmatch::scenes {

struct trunk {
  Eigen::Vector2d at;
  double radius;
};

/// The trunk that a ray from a place meets first, and where: no trunk within `max_range` [m] is none.
struct met_trunk {
  std::size_t trunk = std::numeric_limits<std::size_t>::max();
  double range = 0;
};
inline met_trunk first_met(const std::vector<trunk>& trunks, const Eigen::Vector2d& from, double azimuth,
                           double max_range) {
  const Eigen::Vector2d along(std::cos(azimuth), std::sin(azimuth));
  met_trunk met{.range = max_range};
  for (std::size_t i = 0; i < trunks.size(); ++i) {
    const Eigen::Vector2d offset = trunks[i].at - from;
    const double across = along.x() * offset.y() - along.y() * offset.x();
    const double inside = trunks[i].radius * trunks[i].radius - across * across;
    if (inside <= 0 || offset.dot(along) <= 0) continue;
    const double range = offset.dot(along) - std::sqrt(inside);
    if (range > 0 && range < met.range) met = {i, range};
  }
  return met;
}

/// How far a scanner at a place sees, of which it is the origin, 1.5 m above level ground: up to trunks, else
/// up to `max_range` [m].
inline visible_ranges seen_from(const std::vector<trunk>& trunks, const Eigen::Vector2d& place,
                                double max_range = 40) {
  constexpr int azimuths = 7200;
  visible_ranges visible;
  visible.scanner = {0, 0, 1.5};
  for (int k = 0; k < azimuths; ++k) {
    const double azimuth = 2 * std::numbers::pi * (k + 0.5) / azimuths;
    const double range = first_met(trunks, place, azimuth, max_range).range;
    for (int row = 0; row < visible_ranges::rows; ++row) {
      const double slope = visible_ranges::max_slope * (2 * (row + 0.5) / visible_ranges::rows - 1);
      const auto seen = visible_ranges::return_at(
          vec3f{float(range * std::cos(azimuth)), float(range * std::sin(azimuth)), float(range * slope)});
      if (seen) visible.add(*seen);
    }
  }
  return visible;
}

inline std::vector<trunk> random_trunks(random_source& random, std::size_t count, double width) {
  std::vector<trunk> trunks;
  for (std::size_t i = 0; i < count; ++i)
    trunks.push_back({{width * (random.uniform() - 0.5), width * (random.uniform() - 0.5)},
                      0.1 + 0.15 * random.uniform()});
  return trunks;
}

/// The map of a scanner that stood at a place and is turned by an angle [rad]: the trunks that it sees, with
/// a centimetre of noise. `seen` has the number of each.
struct station {
  Eigen::Isometry3d forest_from_scan;
  stem_map map;
  std::vector<std::size_t> seen;

  station(const std::vector<trunk>& trunks, const Eigen::Vector2d& place, double angle, random_source& random)
      : forest_from_scan(Eigen::Translation3d(place.x(), place.y(), 0) *
                         Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ())) {
    std::vector<bool> is_seen(trunks.size(), false);
    for (int k = 0; k < 7200; ++k)
      if (const met_trunk met = first_met(trunks, place, 2 * std::numbers::pi * k / 7200, 35);
          met.trunk < trunks.size())
        is_seen[met.trunk] = true;
    std::vector<trunk> turned;  // about the scanner, into the frame of the scan
    for (std::size_t i = 0; i < trunks.size(); ++i) {
      const Eigen::Vector2d at = Eigen::Rotation2Dd(-angle) * (trunks[i].at - place);
      turned.push_back({at, trunks[i].radius});
      if (!is_seen[i]) continue;
      stem s;
      s.position = {at.x() + 0.01 * random.normal(), at.y() + 0.01 * random.normal(), 0};
      s.radius = trunks[i].radius;
      s.position_sigma = 0.01;
      s.height_sigma = 0.02;
      map.stems.push_back(s);
      seen.push_back(i);
    }
    map.visible = seen_from(turned, {0, 0});
    const double half = 50;  // [m]
    terrain& ground = map.terrain;
    ground.frame.origin = {-half, -half, 0};
    ground.resolution = 1;
    ground.columns = ground.rows = int(2 * half);
    ground.heights.assign(std::size_t(ground.columns) * std::size_t(ground.rows), 0);
    ground.has_data.assign(ground.heights.size(), 1);
    map.visible.scanner = {half, half, 1.5};
  }

  /// Of the stems that the other one sees, too, only those stay that are the `count` nearest to the middle of
  /// the forest.
  void keep_common(const std::vector<trunk>& trunks, const station& other, std::size_t count) {
    std::vector<std::size_t> common;
    for (const std::size_t i : seen)
      if (std::find(other.seen.begin(), other.seen.end(), i) != other.seen.end()) common.push_back(i);
    std::sort(common.begin(), common.end(),
              [&](std::size_t a, std::size_t b) { return trunks[a].at.norm() < trunks[b].at.norm(); });
    common.erase(common.begin(), common.begin() + std::ptrdiff_t(std::min(count, common.size())));
    std::size_t kept = 0;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      if (std::find(common.begin(), common.end(), seen[i]) != common.end()) continue;
      map.stems[kept] = map.stems[i];
      seen[kept++] = seen[i];
    }
    map.stems.resize(kept);
    seen.resize(kept);
  }
};

}  // namespace globalmatch::scenes
