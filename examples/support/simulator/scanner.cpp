#include "support/simulator/scanner.hpp"

#include "globalmatch/detail/core/threads.hpp"

#include "support/simulator/detail.hpp"

#include <cmath>
#include <optional>
#include <utility>

namespace globalmatch::support {
namespace {

using namespace simulator_detail;
using Eigen::Vector2d;
using Eigen::Vector3d;

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
  require(o.noise_per_metre >= 0 && o.noise_per_metre <= 0.1,
          "scanner_options.noise_per_metre must be in [0, 0.1]");
  require(o.beam_radius >= 0 && o.beam_radius <= 0.1, "scanner_options.beam_radius must be in [0, 0.1] m");
  require(o.beam_divergence >= 0 && o.beam_divergence <= 20,
          "scanner_options.beam_divergence must be in [0, 20] mrad");
  require(o.mixed_pixels >= 0 && o.mixed_pixels <= 1, "scanner_options.mixed_pixels must be in [0, 1]");
  require(o.multipath >= 0 && o.multipath <= 1, "scanner_options.multipath must be in [0, 1]");
}

void require_valid(const mobile_options& o) {
  require(o.step > 0 && o.step <= 10, "mobile_options.step must be in (0, 10] m");
  require(o.rays_per_place >= 1 && o.rays_per_place <= 10000000,
          "mobile_options.rays_per_place must be in [1, 10000000]");
  require(o.drift >= 0 && o.drift <= 10, "mobile_options.drift must be in [0, 10] m");
}

void require_above_ground(const Vector3d& scanner, const plot& scene) {
  require(scanner.z() > scene.ground.height(scanner.x(), scanner.y()),
          "station.plot_from_scan must stand above the ground");
}

/// A ray's return: the range it measures, and the stem it counts for.
struct measurement {
  double range;
  std::uint32_t stem = no_stem;
};

/// Measures along single rays, with all the errors of a real instrument.
class range_finder {
 public:
  range_finder(const plot& scene, const ray_caster& caster, const scanner_options& options)
      : scene_(scene), caster_(caster), options_(options) {}

  std::optional<measurement> measure(const ray& r, detail::random_source& random) const {
    const hit nearest = caster_.first_hit(r);
    if (!(nearest.range >= options_.min_range && nearest.range <= options_.max_range)) return {};
    measurement m = {nearest.range};
    if (const auto mixed = mixed_range(r, nearest.range, random)) {
      m.range = *mixed;
    } else if (nearest.what == surface::ground) {
      m.range = late_range(r, nearest.range, random);
    } else if (nearest.what == surface::stem && in_understory(r, nearest.range)) {
      m.stem = nearest.stem;
    }
    m.range += (options_.range_noise + options_.noise_per_metre * nearest.range) * random.normal();
    return m;
  }

 private:
  /// A beam is as wide as a finger. Where an edge splits it, both parts are measured as one, in between.
  std::optional<double> mixed_range(const ray& r, double range, detail::random_source& random) const {
    constexpr double apart = 0.03, resolved = 1.5;  // [m] nearer echoes are one, further ones are resolved
    if (random.uniform() >= options_.mixed_pixels) return {};
    const double other = caster_.first_hit(elsewhere_in_beam(r, random)).range;
    const double gap = std::abs(other - range);
    if (!(gap > apart && gap < resolved)) return {};
    return range + random.uniform() * (other - range);
  }

  ray elsewhere_in_beam(const ray& r, detail::random_source& random) const {
    const Vector3d aside = r.direction.unitOrthogonal(), across = r.direction.cross(aside);
    const Vector2d direction = random_direction(random);
    const Vector2d in_disc = std::sqrt(random.uniform()) * direction;
    const Vector3d offset = in_disc.x() * aside + in_disc.y() * across;
    const double divergence = 1e-3 * options_.beam_divergence;
    return {r.origin + options_.beam_radius * offset, (r.direction + divergence * offset).normalized()};
  }

  /// Rarely, what comes back from the ground went by way of something else: it seems to lie below.
  double late_range(const ray& r, double range, detail::random_source& random) const {
    constexpr double min_depth = 0.3;  // [m]
    if (random.uniform() >= options_.multipath) return range;
    const double late = range + between(0.5, 5, random);
    const Vector3d p = r.origin + late * r.direction;
    return p.z() < scene_.ground.height(p.x(), p.y()) - min_depth ? late : range;
  }

  bool in_understory(const ray& r, double range) const {
    const Vector3d p = r.origin + range * r.direction;
    const double height = p.z() - scene_.ground.height(p.x(), p.y());
    return height >= 0.2 && height <= 3;
  }

  const plot& scene_;
  const ray_caster& caster_;
  const scanner_options& options_;
};

/// A scan in parts of `rays_per_part` rays: `measure_part(i, points, stems)` appends what the i-th part
/// measures, and the stems that its points count for.
template <class MeasurePart>
simulated_scan scan_in_parts(std::size_t parts, std::size_t rays_per_part, std::size_t stems,
                             const execution& exec, const MeasurePart& measure_part) {
  struct part {
    std::vector<Vector3d> points;
    std::vector<std::uint32_t> stems;
  };
  std::vector<part> all(parts);
  detail::parallel_for(
      exec, "scan", parts, [&](std::size_t i) { measure_part(i, all[i].points, all[i].stems); }, 16);

  simulated_scan result;
  result.rays = parts * rays_per_part;
  result.returns_per_stem.resize(stems);
  std::size_t count = 0;
  for (const part& p : all) count += p.points.size();
  result.points.reserve(count);  // growing would need twice the memory
  for (part& p : all) {
    result.points.insert(result.points.end(), p.points.begin(), p.points.end());
    for (const std::uint32_t s : p.stems) ++result.returns_per_stem[s];
    p = {};
  }
  return result;
}

detail::random_source rays_of(const scanner_options& o, const station& from, std::size_t part) {
  return random_for(o.seed, stream::rays, (std::uint64_t{from.number} << 32) + part);
}

/// A way off that starts at nothing and comes back to it, as drift that is closed by a loop.
Vector3d drift_at(double share, const Vector3d& size) {
  return 0.5 * (1 - std::cos(2 * pi * share)) * size;
}

}  // namespace

simulated_scan scan_from(const station& from, const plot& scene, const ray_caster& caster,
                         const scanner_options& options, const execution& exec) {
  require_valid(options);
  const Vector3d scanner = from.plot_from_scan.translation();
  require_above_ground(scanner, scene);
  const range_finder finder(scene, caster, options);
  const auto columns = static_cast<std::size_t>(std::llround(360 / options.angular_step));
  const auto rows = static_cast<std::size_t>(
      std::floor((options.max_elevation - options.min_elevation) / options.angular_step + 1e-9));
  return scan_in_parts(
      columns, rows, scene.stems.size(), exec, [&](std::size_t column, auto& points, auto& stems) {
        detail::random_source random = rays_of(options, from, column);
        const Vector2d azimuth = unit_vector(2 * pi * (double(column) + 0.5) / double(columns));
        for (std::size_t row = 0; row < rows; ++row) {
          const double elevation =
              radians(options.min_elevation + (double(row) + 0.5) * options.angular_step);
          const Vector2d level = std::cos(elevation) * azimuth;
          const Vector3d in_scan(level.x(), level.y(), std::sin(elevation));
          const auto m = finder.measure({scanner, from.plot_from_scan.linear() * in_scan}, random);
          if (!m) continue;
          points.push_back(m->range * in_scan);
          if (m->stem != no_stem) stems.push_back(m->stem);
        }
      });
}

simulated_scan scan_along(const std::vector<Vector3d>& path, const station& from, const plot& scene,
                          const ray_caster& caster, const scanner_options& options,
                          const mobile_options& mobile, const execution& exec) {
  require_valid(options);
  require_valid(mobile);
  require(!path.empty(), "scan_along: path must have a place");
  for (const Vector3d& place : path) require_above_ground(place, scene);
  const range_finder finder(scene, caster, options);
  const Eigen::Isometry3d scan_from_plot = from.plot_from_scan.inverse();
  const double lowest = std::sin(radians(options.min_elevation)),
               highest = std::sin(radians(options.max_elevation));
  detail::random_source random_drift =
      random_for(options.seed, stream::paths, from.number + (std::uint64_t{1} << 32));
  const Vector3d drift = mobile.drift * normal_vector(random_drift).normalized();
  return scan_in_parts(path.size(), mobile.rays_per_place, scene.stems.size(), exec,
                       [&](std::size_t i, auto& points, auto& stems) {
                         detail::random_source random = rays_of(options, from, i);
                         const Vector3d error = drift_at(double(i) / double(path.size()), drift);
                         for (std::size_t k = 0; k < mobile.rays_per_place; ++k) {
                           const double up = between(lowest, highest, random);
                           const Vector2d level = std::sqrt(1 - up * up) * random_direction(random);
                           const ray r = {path[i], {level.x(), level.y(), up}};
                           const auto m = finder.measure(r, random);
                           if (!m) continue;
                           points.push_back(scan_from_plot * (r.origin + m->range * r.direction + error));
                           if (m->stem != no_stem) stems.push_back(m->stem);
                         }
                       });
}

}  // namespace globalmatch::support
