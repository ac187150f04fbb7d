#include "support/simulator.hpp"

#include "support/simulator_detail.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <variant>

namespace globalmatch::support {
namespace {

using namespace simulator_detail;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::uint32_t no_stem = UINT32_MAX;

void require_valid(const scanner_options& o) {
  require(o.angular_step >= 0.01 && o.angular_step <= 10,
          "scanner_options.angular_step must be in [0.01, 10] degrees");
  require(o.min_elevation >= -90 && o.min_elevation < 90,
          "scanner_options.min_elevation must be in [-90, 90) degrees");
  require(o.max_elevation >= o.min_elevation + o.angular_step && o.max_elevation <= 90,
          "scanner_options.max_elevation must be in [min_elevation + angular_step, 90] degrees");
  require(o.min_range >= 0, "scanner_options.min_range must be at least 0 m");
  require(o.max_range > o.min_range && o.max_range <= 1000,
          "scanner_options.max_range must be in (min_range, 1000] m");
  require(o.range_noise >= 0 && o.range_noise <= 1, "scanner_options.range_noise must be in [0, 1] m");
}

void require_valid(const station& from, const plot& scene) {
  require(from.plot_from_scan.linear().col(2).isApprox(Vector3d::UnitZ()),
          "station.plot_from_scan must be level: a yaw and a translation");
  const Vector3d scanner = from.plot_from_scan.translation();
  require(scanner.z() > scene.ground.height(scanner.x(), scanner.y()),
          "station.plot_from_scan must stand above the ground");
}

/// What a scanner sees of an obstacle in plan: it lies within these azimuths, and not nearer than this.
struct plan_view {
  double azimuth = 0;      ///< [rad] of its middle
  double half_width = pi;  ///< [rad]
  double nearest = 0;      ///< [m]

  bool covers(double other_azimuth) const {
    return std::abs(std::remainder(other_azimuth - azimuth, 2 * pi)) <= half_width;
  }
};

/// View of the hull of two discs, given relative to the scanner.
plan_view view_of_discs(const Vector2d& a, double radius_a, const Vector2d& b, double radius_b) {
  const Vector2d line = b - a;
  const double share = line.isZero() ? 0 : std::clamp(-a.dot(line) / line.squaredNorm(), 0.0, 1.0);
  const double nearest = (a + share * line).norm() - std::max(radius_a, radius_b);
  if (nearest <= 0) return {};  // the scanner is under it, or in it
  const double azimuth = std::atan2(a.y(), a.x());
  const double turn = std::remainder(std::atan2(b.y(), b.x()) - azimuth, 2 * pi);
  const double half_a = std::asin(radius_a / a.norm()), half_b = std::asin(radius_b / b.norm());
  const double low = std::min(-half_a, turn - half_b), high = std::max(half_a, turn + half_b);
  return {azimuth + 0.5 * (low + high), 0.5 * (high - low), nearest};
}

plan_view view(const frustum& cone, const Vector3d& scanner) {
  return view_of_discs((cone.bottom - scanner).head<2>(), cone.bottom_radius, (cone.top - scanner).head<2>(),
                       cone.top_radius);
}

plan_view view(const leaf_cloud& leaves, const Vector3d& scanner) {
  const Vector2d centre = (leaves.centre - scanner).head<2>();
  const double radius = leaves.semi_axes.head<2>().maxCoeff();
  return view_of_discs(centre, radius, centre, radius);
}

/// One thing in the way of rays.
struct obstacle {
  plan_view seen;
  std::variant<const frustum*, const leaf_cloud*> shape;
  std::uint32_t stem = no_stem;

  double first_hit(const ray& r, random_source& random) const {
    if (const auto* cone = std::get_if<const frustum*>(&shape)) return support::first_hit(**cone, r);
    return support::first_hit(*std::get<const leaf_cloud*>(shape), r, random);
  }
};

/// All that stands on the plot, the nearest first.
std::vector<obstacle> obstacles_of(const plot& scene, const Vector3d& scanner) {
  std::vector<obstacle> all;
  for (std::uint32_t i = 0; i < scene.stems.size(); ++i)
    all.push_back({view(scene.stems[i].trunk, scanner), &scene.stems[i].trunk, i});
  for (const frustum& branch : scene.branches) all.push_back({view(branch, scanner), &branch});
  for (const leaf_cloud& leaves : scene.leaves) all.push_back({view(leaves, scanner), &leaves});
  std::stable_sort(all.begin(), all.end(),
                   [](const obstacle& a, const obstacle& b) { return a.seen.nearest < b.seen.nearest; });
  return all;
}

struct hit {
  double range = no_hit;
  std::uint32_t stem = no_stem;
};

/// The nearest hit of a ray on obstacles that are sorted by distance in plan, if it is nearer than `ground`.
hit nearest_hit(const ray& r, double ground, const std::vector<const obstacle*>& obstacles,
                random_source& random) {
  const double plan_share = r.direction.head<2>().norm();
  hit nearest = {ground, no_stem};
  for (const obstacle* o : obstacles) {
    if (o->seen.nearest > nearest.range * plan_share) break;
    const double range = o->first_hit(r, random);
    if (range < nearest.range) nearest = {range, o->stem};
  }
  return nearest;
}

bool in_understory(const Vector3d& p, const height_field& ground) {
  const double above = p.z() - ground.height(p.x(), p.y());
  return above >= 0.2 && above <= 3;
}

/// What the rays of one azimuth return.
struct column_scan {
  std::vector<Vector3d> points;           ///< [m] in the scanner's frame
  std::vector<std::uint32_t> understory;  ///< the stem of every return that counts for one
};

class column_scanner {
 public:
  column_scanner(const plot& scene, const station& from, const scanner_options& options)
      : scene_(scene),
        from_(from),
        options_(options),
        obstacles_(obstacles_of(scene, from.plot_from_scan.translation())) {}

  std::size_t columns() const { return static_cast<std::size_t>(std::llround(360 / options_.angular_step)); }
  std::size_t rows() const {
    return static_cast<std::size_t>(
        std::llround((options_.max_elevation - options_.min_elevation) / options_.angular_step));
  }

  column_scan scan(std::size_t column) const {
    const double azimuth = 2 * pi * (double(column) + 0.5) / double(columns());
    const Vector2d scan_direction = unit_vector(azimuth);
    const Vector2d plot_direction = from_.plot_from_scan.linear().topLeftCorner<2, 2>() * scan_direction;
    const Vector3d scanner = from_.plot_from_scan.translation();
    const std::vector<const obstacle*> in_the_way = obstacles_towards(plot_direction);
    ground_walk ground(scene_.ground, scanner, plot_direction, options_.max_range);
    random_source random(options_.seed, (std::uint64_t{from_.number} << 32) + column);

    column_scan result;
    for (std::size_t row = 0; row < rows(); ++row) {
      const double elevation = radians(options_.min_elevation + (double(row) + 0.5) * options_.angular_step);
      const double along = std::cos(elevation), up = std::sin(elevation);
      const ray r = {scanner, {along * plot_direction.x(), along * plot_direction.y(), up}};
      const hit nearest = nearest_hit(r, ground.distance(up / along) / along, in_the_way, random);
      if (nearest.range < options_.min_range || nearest.range > options_.max_range) continue;

      const double measured = nearest.range + options_.range_noise * random.normal();
      result.points.emplace_back(measured * along * scan_direction.x(), measured * along * scan_direction.y(),
                                 measured * up);
      if (nearest.stem != no_stem && in_understory(r.origin + nearest.range * r.direction, scene_.ground))
        result.understory.push_back(nearest.stem);
    }
    return result;
  }

 private:
  std::vector<const obstacle*> obstacles_towards(const Vector2d& direction) const {
    const double azimuth = std::atan2(direction.y(), direction.x());
    std::vector<const obstacle*> found;
    for (const obstacle& o : obstacles_)
      if (o.seen.covers(azimuth)) found.push_back(&o);
    return found;
  }

  const plot& scene_;
  const station& from_;
  const scanner_options& options_;
  std::vector<obstacle> obstacles_;
};

}  // namespace

simulated_scan scan_plot(const plot& scene, const station& from, const scanner_options& options,
                         const execution& how) {
  require_valid(options);
  require_valid(from, scene);
  const column_scanner scanner(scene, from, options);
  std::vector<column_scan> columns(scanner.columns());
  parallel_for(
      how, "scan", columns.size(), [&](std::size_t i) { columns[i] = scanner.scan(i); }, 16);

  simulated_scan result;
  result.rays = scanner.columns() * scanner.rows();
  result.returns_per_stem.resize(scene.stems.size());
  std::size_t returns = 0;
  for (const column_scan& column : columns) returns += column.points.size();
  result.points.reserve(returns);  // growing would need twice the memory
  for (const column_scan& column : columns) {
    result.points.insert(result.points.end(), column.points.begin(), column.points.end());
    for (const std::uint32_t stem : column.understory) ++result.returns_per_stem[stem];
  }
  return result;
}

}  // namespace globalmatch::support
