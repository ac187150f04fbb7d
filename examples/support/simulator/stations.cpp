#include "support/simulator/stations.hpp"

#include "support/simulator/detail.hpp"

#include <algorithm>
#include <cmath>

namespace globalmatch::support {
namespace {

using namespace simulator_detail;
using Eigen::Vector2d;
using Eigen::Vector3d;

void require_valid(const station_options& o, const plot& scene) {
  require(o.count >= 1 && o.count <= 1000, "station_options.count must be in [1, 1000]");
  require(o.count == 1 ||
              (o.distance > 0 && o.distance < 0.5 * std::min(scene.options.width, scene.options.depth)),
          "station_options.distance must be less than half of the plot's width and depth");
  require(o.scanner_height > 0 && o.scanner_height <= 10,
          "station_options.scanner_height must be in (0, 10] m");
  require(o.clearance >= 0 && o.clearance <= 10, "station_options.clearance must be in [0, 10] m");
  require(o.tilt >= 0 && o.tilt <= 45, "station_options.tilt must be in [0, 45] degrees");
}

bool is_free(const Vector2d& place, const plot& scene, double clearance) {
  return std::all_of(scene.stems.begin(), scene.stems.end(), [&](const stem& s) {
    return (place - s.position.head<2>()).norm() - 0.5 * s.dbh >= clearance;
  });
}

/// The free place nearest to the wanted one, as far as random tries at a growing distance find it.
Vector2d free_place(const Vector2d& wanted, const plot& scene, double clearance,
                    detail::random_source& random) {
  constexpr int tries = 1000;
  constexpr double furthest = 5;  // [m]
  for (int i = 0; i < tries; ++i) {
    const Vector2d place = wanted + furthest * i / tries * random_direction(random);
    if (is_free(place, scene, clearance)) return place;
  }
  throw std::invalid_argument("station_options.clearance is more than this plot leaves around a station");
}

Eigen::Matrix3d random_attitude(double tilt, detail::random_source& random) {
  const Vector2d axis = random_direction(random);
  const Eigen::AngleAxisd tilted(radians(tilt), Vector3d(axis.x(), axis.y(), 0));
  return (tilted * Eigen::AngleAxisd(between(-pi, pi, random), Vector3d::UnitZ())).toRotationMatrix();
}

}  // namespace

std::vector<station> place_stations(const plot& scene, const station_options& options) {
  require_valid(options, scene);
  detail::random_source random = random_for(options.seed, stream::stations);
  const double start = between(-pi, pi, random);
  std::vector<station> stations;
  for (std::uint32_t i = 0; i < options.count; ++i) {
    Vector2d wanted = Vector2d::Zero();
    if (i > 0) wanted = options.distance * unit_vector(start + 2 * pi * i / double(options.count - 1));
    station s = {Eigen::Isometry3d::Identity(), i + 1};
    s.plot_from_scan.translation() = scene.ground.at(free_place(wanted, scene, options.clearance, random)) +
                                     Vector3d(0, 0, options.scanner_height);
    s.plot_from_scan.linear() = random_attitude(options.tilt, random);
    stations.push_back(s);
  }
  return stations;
}

std::vector<Vector3d> walk_path(const plot& scene, const station_options& options, std::uint32_t number,
                                double step) {
  require_valid(options, scene);
  require(step > 0, "walk_path: step must be more than 0 m");
  detail::random_source random = random_for(options.seed, stream::paths, number);
  const Vector2d size(scene.options.width, scene.options.depth);
  const Vector2d middle = random_place(0.08 * size, random);
  const Vector2d radii = between(0.2, 0.35, random) * size;
  const double start = between(-pi, pi, random), wobble = between(0.1, 0.25, random);
  const double length = 2 * pi * radii.mean() * (1 + wobble);

  std::vector<Vector3d> path;
  for (double walked = 0; walked < length; walked += step) {
    const double angle = start + 2 * pi * walked / length;
    const double swing = 1 + wobble * std::sin(3 * angle + start);
    const Vector2d place = middle + swing * radii.cwiseProduct(unit_vector(angle));
    if (is_free(place, scene, options.clearance))
      path.push_back(scene.ground.at(place) + Vector3d(0, 0, options.scanner_height));
  }
  return path;
}

}  // namespace globalmatch::support
