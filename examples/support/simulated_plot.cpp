#include "support/simulated_plot.hpp"

#include "support/simulator_detail.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace globalmatch::support {
namespace {

using namespace simulator_detail;
using Eigen::Vector2d;
using Eigen::Vector3d;

enum random_stream : std::uint64_t { growing, placing };

double between(double low, double high, random_source& random) {
  return low + (high - low) * random.uniform();
}

Vector2d random_direction(random_source& random) {
  return unit_vector(between(-pi, pi, random));
}

void require_valid(const plot_options& o) {
  require(o.width > 0 && o.width <= 1000, "plot_options.width must be in (0, 1000] m");
  require(o.depth > 0 && o.depth <= 1000, "plot_options.depth must be in (0, 1000] m");
  require(o.stems_per_hectare >= 0 && o.stems_per_hectare <= 20000,
          "plot_options.stems_per_hectare must be in [0, 20000]");
  require(o.min_spacing >= 0 && o.min_spacing <= 100, "plot_options.min_spacing must be in [0, 100] m");
  require(o.min_radius > 0 && o.min_radius <= 2, "plot_options.min_radius must be in (0, 2] m");
  require(o.max_radius >= o.min_radius && o.max_radius <= 2,
          "plot_options.max_radius must be in [min_radius, 2] m");
  require(o.min_height >= 2 && o.min_height <= 100, "plot_options.min_height must be in [2, 100] m");
  require(o.max_height >= o.min_height && o.max_height <= 100,
          "plot_options.max_height must be in [min_height, 100] m");
  require(o.max_lean >= 0 && o.max_lean <= 45, "plot_options.max_lean must be in [0, 45] degrees");
  require(o.branches_per_stem <= 1000, "plot_options.branches_per_stem must be at most 1000");
  require(o.crown_density >= 0 && o.crown_density <= 100,
          "plot_options.crown_density must be in [0, 100] 1/m");
  require(o.shrubs_per_hectare >= 0 && o.shrubs_per_hectare <= 20000,
          "plot_options.shrubs_per_hectare must be in [0, 20000]");
  require(o.relief >= 0 && o.relief <= 2, "plot_options.relief must be in [0, 2] m");
  require(o.slope >= 0 && o.slope <= 45, "plot_options.slope must be in [0, 45] degrees");
}

std::size_t count_on_plot(double per_hectare, const plot_options& o) {
  constexpr double square_metres = 10000;  // in a hectare
  return static_cast<std::size_t>(std::llround(per_hectare * o.width * o.depth / square_metres));
}

Vector2d random_place(const plot_options& o, random_source& random) {
  const double x = between(-o.width / 2, o.width / 2, random);
  return {x, between(-o.depth / 2, o.depth / 2, random)};
}

Vector3d on_ground(const height_field& ground, const Vector2d& place) {
  return {place.x(), place.y(), ground.height(place.x(), place.y())};
}

height_field random_ground(const plot_options& o, random_source& random) {
  height_field ground;
  ground.gradient = std::tan(radians(o.slope)) * random_direction(random);
  double wavelengths = 0;
  for (int i = 0; i < 6; ++i) {
    const double wavelength = between(6, 30, random);
    const Vector2d frequency = 2 * pi / wavelength * random_direction(random);
    ground.waves.push_back({frequency, between(-pi, pi, random), wavelength});  // long waves are high
    wavelengths += wavelength;
  }
  for (height_field::wave& wave : ground.waves) wave.amplitude *= o.relief / wavelengths;
  return ground;
}

std::vector<Vector2d> random_stem_places(const plot_options& o, random_source& random) {
  const std::size_t count = count_on_plot(o.stems_per_hectare, o);
  std::vector<Vector2d> places;
  const auto is_free = [&](const Vector2d& place) {
    return std::none_of(places.begin(), places.end(),
                        [&](const Vector2d& other) { return (place - other).norm() < o.min_spacing; });
  };
  for (std::size_t tries = 0; places.size() < count; ++tries) {
    require(tries < 100 * count, "plot_options.stems_per_hectare is more than min_spacing leaves room for");
    const Vector2d place = random_place(o, random);
    if (is_free(place)) places.push_back(place);
  }
  return places;
}

simulated_stem random_stem(const Vector3d& position, const plot_options& o, random_source& random) {
  constexpr double breast_height = 1.3;   // [m]
  constexpr double root_depth = 0.5;      // [m] of trunk below the ground, so that no slope bares its end
  constexpr double top_to_breast = 0.15;  // ratio of the radii
  const double radius = between(o.min_radius, o.max_radius, random);
  const double height = between(o.min_height, o.max_height, random);
  const double lean = radians(o.max_lean) * random.uniform();
  const Vector2d towards = std::sin(lean) * random_direction(random);
  const Vector3d axis(towards.x(), towards.y(), std::cos(lean));
  const double taper = (1 - top_to_breast) * radius / (height - breast_height);
  return {position,
          radius,
          {position - root_depth * axis, position + height * axis,
           radius + taper * (breast_height + root_depth), top_to_breast * radius}};
}

frustum random_branch(const simulated_stem& stem, random_source& random) {
  const Vector3d stem_line = stem.trunk.top - stem.position;
  const double height = between(0.5, std::min(5.0, stem_line.norm()), random);
  const Vector3d start = stem.position + height * stem_line.normalized();
  const double rise = radians(between(-20, 20, random));
  const Vector2d outward = std::cos(rise) * random_direction(random);
  const double length = stem.trunk.bottom_radius + between(0.2, 0.8, random);
  return {start, start + length * Vector3d(outward.x(), outward.y(), std::sin(rise)), 0.008, 0.003};
}

leaf_cloud random_crown(const simulated_stem& stem, const plot_options& o, random_source& random) {
  const Vector3d stem_line = stem.trunk.top - stem.position;
  const double spread = between(1, 2.2, random);
  const double base = between(0.45, 0.65, random);  // share of the stem below the crown
  return {stem.position + 0.5 * (1 + base) * stem_line,
          {spread, spread, 0.5 * (1 - base) * stem_line.norm()},
          o.crown_density};
}

leaf_cloud random_shrub(const Vector3d& place, random_source& random) {
  const double spread = between(0.3, 1.0, random);
  const double height = between(0.3, 0.9, random);
  return {place + Vector3d(0, 0, 0.5 * height), {spread, spread, height}, between(1, 4, random)};
}

void require_valid(const station_options& o, const plot& scene) {
  require(o.count >= 1 && o.count <= 1000, "station_options.count must be in [1, 1000]");
  require(o.count == 1 || (o.distance > 0 && o.distance < 0.5 * std::min(scene.width, scene.depth)),
          "station_options.distance must be less than half of the plot's width and depth");
  require(o.scanner_height > 0 && o.scanner_height <= 10,
          "station_options.scanner_height must be in (0, 10] m");
  require(o.clearance >= 0 && o.clearance <= 10, "station_options.clearance must be in [0, 10] m");
}

bool is_free(const Vector3d& scanner, const plot& scene, double clearance) {
  const auto plan_distance = [&](const Vector3d& p) { return (scanner - p).head<2>().norm(); };
  const auto keeps_away_from_stem = [&](const simulated_stem& stem) {
    return plan_distance(stem.position) - stem.trunk.bottom_radius >= clearance;
  };
  const auto keeps_away_from_leaves = [&](const leaf_cloud& leaves) {
    const bool high_above = leaves.centre.z() - leaves.semi_axes.z() > scanner.z() + clearance;
    return high_above || plan_distance(leaves.centre) - leaves.semi_axes.head<2>().maxCoeff() >= clearance;
  };
  return std::all_of(scene.stems.begin(), scene.stems.end(), keeps_away_from_stem) &&
         std::all_of(scene.leaves.begin(), scene.leaves.end(), keeps_away_from_leaves);
}

/// The free place nearest to the wanted one, as far as random tries at a growing distance find it.
Vector3d free_place(const Vector2d& wanted, const plot& scene, const station_options& o,
                    random_source& random) {
  constexpr int tries = 1000;
  constexpr double furthest = 5;  // [m]
  for (int i = 0; i < tries; ++i) {
    const Vector2d place = wanted + furthest * i / tries * random_direction(random);
    const Vector3d scanner = on_ground(scene.ground, place) + Vector3d(0, 0, o.scanner_height);
    if (is_free(scanner, scene, o.clearance)) return scanner;
  }
  throw std::invalid_argument("station_options.clearance is more than this plot leaves around a station");
}

}  // namespace

plot grow_plot(const plot_options& options) {
  require_valid(options);
  random_source random(options.seed, growing);
  plot scene = {options.width, options.depth, random_ground(options, random)};
  for (const Vector2d& place : random_stem_places(options, random))
    scene.stems.push_back(random_stem(on_ground(scene.ground, place), options, random));
  for (const simulated_stem& stem : scene.stems) {
    for (std::size_t i = 0; i < options.branches_per_stem; ++i)
      scene.branches.push_back(random_branch(stem, random));
    if (options.crown_density > 0) scene.leaves.push_back(random_crown(stem, options, random));
  }
  for (std::size_t i = count_on_plot(options.shrubs_per_hectare, options); i > 0; --i)
    scene.leaves.push_back(random_shrub(on_ground(scene.ground, random_place(options, random)), random));
  return scene;
}

std::vector<station> place_stations(const plot& scene, const station_options& options) {
  require_valid(options, scene);
  random_source random(options.seed, placing);
  const double start = between(-pi, pi, random);
  std::vector<station> stations;
  for (std::uint32_t i = 0; i < options.count; ++i) {
    Vector2d wanted = Vector2d::Zero();
    if (i > 0) wanted = options.distance * unit_vector(start + 2 * pi * i / double(options.count - 1));
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = free_place(wanted, scene, options, random);
    pose.linear() = Eigen::AngleAxisd(between(-pi, pi, random), Vector3d::UnitZ()).toRotationMatrix();
    stations.push_back({pose, i + 1});
  }
  return stations;
}

}  // namespace globalmatch::support
