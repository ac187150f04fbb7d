#include "support/simulator/trees.hpp"

#include "support/simulator/detail.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

namespace globalmatch::support {
namespace {

using namespace simulator_detail;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector4d;

constexpr std::size_t sides = 36;  // of a stem: a polygon 0.1 % thinner than its circle

/// Radius [m] without bark: taper to the tip, flare at the base.
double radius_at(const stem& s, double flare, double height) {
  const double taper = std::pow(std::max(0.0, (s.height - height) / (s.height - breast_height)), 0.8);
  return 0.5 * s.dbh * taper * (1 + flare * std::exp(-std::max(height, -0.2) / 0.2));
}

/// Relief of bark around a stem, correlated along it and around it.
class bark_relief {
 public:
  bark_relief(double amplitude, detail::random_source& random) : amplitude_(amplitude), random_(random) {
    climb(0);
  }

  /// The next ring of it, further up.
  void climb(double memory = 0.7) {
    std::array<double, sides> fresh;
    for (double& value : fresh) value = random_.normal();
    for (std::size_t i = 0; i < sides; ++i) {
      const double smooth = (fresh[i] + fresh[(i + 1) % sides] + fresh[(i + 2) % sides]) / std::sqrt(3.0);
      relief_[i] = memory * relief_[i] + std::sqrt(1 - memory * memory) * amplitude_ * smooth;
    }
  }
  double operator[](std::size_t side) const { return relief_[side]; }

 private:
  double amplitude_;
  detail::random_source& random_;
  std::array<double, sides> relief_ = {};
};

/// A tube around `axis`, with rings at these heights.
struct tube {
  std::function<Vector3d(double)> axis;
  std::function<double(double)> radius;
  std::vector<double> heights;
};

void add_ring(quad_mesh& mesh, const tube& t, double height, const bark_relief& bark) {
  constexpr double step = 0.01;  // [m]
  const Vector3d middle = t.axis(height);
  const Vector3d up = (t.axis(height + step) - middle).normalized();
  const Vector3d u = Vector3d::UnitY().cross(up).normalized(), v = up.cross(u);
  for (std::size_t i = 0; i < sides; ++i) {
    const Vector2d around = unit_vector(2 * pi * double(i) / double(sides));
    const double radius = std::max(0.002, t.radius(height) + bark[i]);
    mesh.vertices.push_back((middle + radius * (around.x() * u + around.y() * v)).cast<float>());
  }
}

void add_tube(surfaces& scene, const tube& t, std::uint32_t index, double bark_amplitude,
              detail::random_source& random) {
  bark_relief bark(bark_amplitude, random);
  const auto first = static_cast<std::uint32_t>(scene.stems.vertices.size());
  constexpr auto around = static_cast<std::uint32_t>(sides);
  for (std::uint32_t ring = 0; ring < t.heights.size(); ++ring, bark.climb()) {
    add_ring(scene.stems, t, t.heights[ring], bark);
    for (std::uint32_t i = 0; ring > 0 && i < around; ++i) {
      const std::uint32_t next = (i + 1) % around, below = first + (ring - 1) * around;
      scene.stems.quads.push_back({below + i, below + next, below + around + next, below + around + i});
      scene.stem_of_quad.push_back(index);
    }
  }
}

/// Close together where a scan looks for stems, coarse above.
std::vector<double> ring_heights(double from, double to) {
  constexpr double fine_below = 4, fine = 0.1, coarse = 0.6;  // [m]
  std::vector<double> heights;
  for (double h = from; h < to; h += h < fine_below ? fine : coarse) heights.push_back(h);
  heights.push_back(to);
  return heights;
}

double weibull(double scale, double shape, detail::random_source& random) {
  return scale * std::pow(-std::log(1 - random.uniform()), 1 / shape);
}

/// Leaves along the outer part of a branch: correlated in space, as nature has them and a haze has not.
void add_leaves(surfaces& scene, const Vector3d& base, const Vector3d& tip, std::size_t count, double radius,
                detail::random_source& random) {
  const double deviation = 0.06 + 0.1 * (tip - base).norm();  // [m]
  for (std::size_t i = 0; i < count; ++i) {
    const Vector3d along = base + between(0.25, 1.05, random) * (tip - base);
    const Vector3d centre = along + deviation * normal_vector(random);
    const Vector3d normal = normal_vector(random) + Vector3d(0, 0, 0.7);
    scene.add_disc(centre, radius * between(0.6, 1.4, random), normal);
  }
}

void add_live_branch(surfaces& scene, const stem& s, const tree_options& o, std::size_t leaves,
                     detail::random_source& random) {
  const double share = random.uniform();  // of the way up the crown
  const double height = s.height * (o.crown_base + (0.97 - o.crown_base) * share);
  const double extent = 0.2 + o.crown_radius * std::pow(1 - share, 0.7) * between(0.7, 1.2, random);
  const Vector2d outward = random_direction(random);
  const Vector3d base = s.axis_at(height);
  const Vector3d middle =
      base + 0.5 * extent * Vector3d(outward.x(), outward.y(), between(-0.1, 0.5, random));
  const Vector3d tip = middle + 0.5 * extent * Vector3d(outward.x(), outward.y(), between(-0.5, 0.3, random));
  const double thickness = std::min(0.006 + 0.008 * extent, 0.8 * radius_at(s, 0, height));
  scene.add_curve({Vector4d(base.x(), base.y(), base.z(), thickness),
                   Vector4d(middle.x(), middle.y(), middle.z(), 0.7 * thickness),
                   Vector4d(tip.x(), tip.y(), tip.z(), 0.003)});
  add_leaves(scene, base, tip, leaves, o.leaf_radius, random);
}

void add_dead_branch(surfaces& scene, const stem& s, const tree_options& o, detail::random_source& random) {
  const double height = between(0.6, std::max(1.0, s.height * o.crown_base), random);
  const double length = 0.5 * s.dbh + std::min(2.5, weibull(0.7, 1.5, random));
  const Vector2d outward = random_direction(random);
  const Vector3d base = s.axis_at(height);
  const Vector3d middle =
      base + 0.6 * length * Vector3d(outward.x(), outward.y(), between(-0.3, 0.4, random));
  const Vector3d tip = middle + 0.4 * length * Vector3d(outward.x(), outward.y(), between(-0.8, 0.3, random));
  const double thickness = between(0.004, 0.012, random);
  scene.add_curve({Vector4d(base.x(), base.y(), base.z(), thickness),
                   Vector4d(middle.x(), middle.y(), middle.z(), 0.6 * thickness),
                   Vector4d(tip.x(), tip.y(), tip.z(), 0.002)});
}

}  // namespace

Vector3d stem::axis_at(double height_above) const {
  const Vector2d sideways = height_above * lean + std::sin(pi * height_above / height) * sweep;
  return position + Vector3d(sideways.x(), sideways.y(), height_above);
}

void require_valid(const tree_options& o) {
  require(o.dbh_min >= 0.02 && o.dbh_min <= 3, "tree_options.dbh_min must be in [0.02, 3] m");
  require(o.dbh_scale >= 0 && o.dbh_scale <= 3, "tree_options.dbh_scale must be in [0, 3] m");
  require(o.dbh_shape >= 0.5 && o.dbh_shape <= 20, "tree_options.dbh_shape must be in [0.5, 20]");
  require(o.dbh_max >= o.dbh_min && o.dbh_max <= 3, "tree_options.dbh_max must be in [dbh_min, 3] m");
  require(o.height >= 4 && o.height <= 100, "tree_options.height must be in [4, 100] m");
  require(o.lean >= 0 && o.lean <= 30, "tree_options.lean must be in [0, 30] degrees");
  require(o.common_lean >= 0 && o.common_lean <= 30, "tree_options.common_lean must be in [0, 30] degrees");
  require(o.sweep >= 0 && o.sweep <= 2, "tree_options.sweep must be in [0, 2] m");
  require(o.flare >= 0 && o.flare <= 3, "tree_options.flare must be in [0, 3]");
  require(o.bark >= 0 && o.bark <= 0.05, "tree_options.bark must be in [0, 0.05] m");
  require(o.pairs >= 0 && o.pairs <= 1, "tree_options.pairs must be in [0, 1]");
  require(o.multi_stem >= 0 && o.multi_stem <= 1, "tree_options.multi_stem must be in [0, 1]");
  require(o.forked >= 0 && o.forked <= 1, "tree_options.forked must be in [0, 1]");
  require(o.crown_base >= 0 && o.crown_base <= 0.95, "tree_options.crown_base must be in [0, 0.95]");
  require(o.crown_radius >= 0 && o.crown_radius <= 20, "tree_options.crown_radius must be in [0, 20] m");
  require(o.branches <= 1000, "tree_options.branches must be at most 1000");
  require(o.leaves <= 100000, "tree_options.leaves must be at most 100000");
  require(o.leaf_radius > 0 && o.leaf_radius <= 1, "tree_options.leaf_radius must be in (0, 1] m");
  require(o.dead_branches <= 1000, "tree_options.dead_branches must be at most 1000");
}

stem random_stem(const tree_options& o, const Vector3d& position, detail::random_source& random) {
  stem s;
  s.position = position;
  s.dbh = std::min(o.dbh_max, o.dbh_min + weibull(o.dbh_scale, o.dbh_shape, random));
  s.height = std::max(3.0, o.height * std::pow(s.dbh / 0.2, 0.4) * between(0.9, 1.1, random));
  const double lean = std::min(2 * o.lean, weibull(o.lean / std::sqrt(std::numbers::ln2), 2, random));
  s.lean = std::tan(radians(lean)) * random_direction(random);
  const Vector2d sweep_direction = random_direction(random);
  s.sweep = o.sweep * random.normal() * sweep_direction;
  const bool forks = random.uniform() < o.forked;
  const double fork_height = between(1.6, std::max(2.0, 0.5 * s.height), random);
  const Vector2d fork_direction = random_direction(random);
  s.fork = between(0.1, 0.3, random) * fork_direction;
  if (forks) s.fork_height = fork_height;
  return s;
}

void add_stem(surfaces& scene, const stem& s, std::uint32_t index, const tree_options& o,
              detail::random_source& random) {
  constexpr double root_depth = 0.6;  // [m] below the ground, so that no slope bares its end
  const double bark = o.bark * std::min(1.0, s.dbh / 0.2);
  const auto axis = [&s](double h) { return s.axis_at(h); };
  const auto radius = [&](double h) { return radius_at(s, o.flare, h); };
  add_tube(scene, {axis, radius, ring_heights(-root_depth, s.height)}, index, bark, random);
  if (s.fork_height == 0) return;
  const auto second_axis = [&s](double h) {
    const Vector2d off = (h - s.fork_height) * s.fork;
    return Vector3d(s.axis_at(h) + Vector3d(off.x(), off.y(), 0));
  };
  const auto second_radius = [&](double h) { return 0.75 * radius_at(s, 0, h); };
  add_tube(scene, {second_axis, second_radius, ring_heights(s.fork_height, 0.9 * s.height)}, index, bark,
           random);
}

void add_crown(surfaces& scene, const stem& s, const tree_options& o, detail::random_source& random) {
  for (std::size_t i = 0; i < o.branches; ++i) add_live_branch(scene, s, o, o.leaves / o.branches, random);
  for (std::size_t i = 0; i < o.dead_branches; ++i) add_dead_branch(scene, s, o, random);
}

}  // namespace globalmatch::support
