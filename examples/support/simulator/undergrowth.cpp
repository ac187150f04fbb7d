#include "support/simulator/undergrowth.hpp"

#include "support/simulator/detail.hpp"

#include <algorithm>
#include <cmath>

namespace globalmatch::support {
namespace {

using namespace simulator_detail;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector4d;

Vector4d with_radius(const Vector3d& place, double radius) {
  return {place.x(), place.y(), place.z(), radius};
}

/// A blade that rises and bends over.
void add_blade(surfaces& scene, const Vector3d& base, double height, detail::random_source& random) {
  const Vector2d direction = random_direction(random);
  const Vector2d lean = height * between(0, 0.6, random) * direction;
  const Vector3d middle = base + Vector3d(0.3 * lean.x(), 0.3 * lean.y(), 0.6 * height);
  const Vector3d tip = base + Vector3d(lean.x(), lean.y(), height * between(0.7, 1, random));
  scene.add_curve({with_radius(base, 0.003), with_radius(middle, 0.003), with_radius(tip, 0.001)});
}

void add_stump(surfaces& scene, const Vector3d& position, double radius, double height) {
  scene.add_curve({with_radius(position - Vector3d(0, 0, 0.3), 1.5 * radius),
                   with_radius(position + Vector3d(0, 0, height), 1.1 * radius)});
}

void add_log(surfaces& scene, const terrain& ground, const Vector2d& place, detail::random_source& random) {
  const double radius = between(0.025, 0.15, random), length = between(2, 12, random);
  const Vector2d along = length * random_direction(random);
  const auto lying = [&](const Vector2d& p, double r) {
    return with_radius(ground.at(p) + Vector3d(0, 0, 0.8 * r), r);
  };
  const Vector2d middle = place + 0.5 * along, end = place + along;
  scene.add_curve({lying(place, radius), lying(middle, 0.8 * radius), lying(end, 0.5 * radius)});
}

void add_pole(surfaces& scene, const Vector3d& position, detail::random_source& random) {
  const double radius = between(0.015, 0.05, random), height = between(1, 2.5, random);
  scene.add_curve({with_radius(position - Vector3d(0, 0, 0.2), radius),
                   with_radius(position + Vector3d(0, 0, height), radius)});
}

}  // namespace

void require_valid(const undergrowth_options& o) {
  require(o.shrubs_per_hectare >= 0 && o.shrubs_per_hectare <= 20000,
          "undergrowth_options.shrubs_per_hectare must be in [0, 20000]");
  require(o.shrub_min_height >= 0.1 && o.shrub_min_height <= 10,
          "undergrowth_options.shrub_min_height must be in [0.1, 10] m");
  require(o.shrub_max_height >= o.shrub_min_height && o.shrub_max_height <= 10,
          "undergrowth_options.shrub_max_height must be in [shrub_min_height, 10] m");
  require(o.shrub_leaves <= 10000, "undergrowth_options.shrub_leaves must be at most 10000");
  require(o.shrub_leaf_radius > 0 && o.shrub_leaf_radius <= 0.5,
          "undergrowth_options.shrub_leaf_radius must be in (0, 0.5] m");
  require(o.blades_per_square_metre >= 0 && o.blades_per_square_metre <= 1000,
          "undergrowth_options.blades_per_square_metre must be in [0, 1000]");
  require(o.grass_height > 0 && o.grass_height <= 3, "undergrowth_options.grass_height must be in (0, 3] m");
  require(o.logs_per_hectare >= 0 && o.logs_per_hectare <= 10000,
          "undergrowth_options.logs_per_hectare must be in [0, 10000]");
  require(o.stumps_per_hectare >= 0 && o.stumps_per_hectare <= 10000,
          "undergrowth_options.stumps_per_hectare must be in [0, 10000]");
  require(o.poles_per_hectare >= 0 && o.poles_per_hectare <= 10000,
          "undergrowth_options.poles_per_hectare must be in [0, 10000]");
}

std::vector<shrub> plant_shrubs(const undergrowth_options& o, const terrain& ground,
                                const Vector2d& half_size, std::uint64_t seed) {
  detail::random_source random = random_for(seed, stream::shrubs);
  std::vector<shrub> shrubs;
  for (std::size_t i = count_on(o.shrubs_per_hectare, half_size); i > 0; --i) {
    const Vector3d position = ground.at(random_place(half_size, random));
    const double height = between(o.shrub_min_height, o.shrub_max_height, random);
    shrubs.push_back({position, height, height * between(0.4, 0.9, random)});
  }
  return shrubs;
}

void add_shrub(surfaces& scene, const shrub& s, const undergrowth_options& o, detail::random_source& random) {
  const int twigs = 6 + int(random.below(9));
  const auto leaves =
      static_cast<std::size_t>(double(o.shrub_leaves) * s.height * s.height) / std::size_t(twigs);
  for (int i = 0; i < twigs; ++i) {
    const Vector2d direction = random_direction(random);
    const Vector2d outward = s.radius * std::sqrt(random.uniform()) * direction;
    const Vector3d base = s.position + 0.1 * Vector3d(outward.x(), outward.y(), -0.1);
    const Vector3d tip = s.position + Vector3d(outward.x(), outward.y(), s.height * between(0.6, 1, random));
    const Vector3d middle = 0.5 * (base + tip) + 0.08 * s.height * normal_vector(random);
    const double thickness = between(0.003, 0.004 + 0.006 * s.height, random);
    scene.add_curve(
        {with_radius(base, thickness), with_radius(middle, 0.7 * thickness), with_radius(tip, 0.002)});
    for (std::size_t leaf = 0; leaf < leaves; ++leaf) {
      const Vector3d along = base + between(0.2, 1, random) * (tip - base);
      const Vector3d normal = normal_vector(random);
      const double radius = o.shrub_leaf_radius * between(0.6, 1.4, random);
      scene.add_disc(along + 0.12 * s.height * normal_vector(random), radius, normal);
    }
  }
}

void add_grass(surfaces& scene, const undergrowth_options& o, const terrain& ground,
               const Vector2d& half_size, std::uint64_t seed) {
  constexpr int blades_in_tuft = 12;
  constexpr double square_metres = 10000;  // in a hectare
  detail::random_source random = random_for(seed, stream::grass);
  for (std::size_t i = count_on(o.blades_per_square_metre * square_metres / blades_in_tuft, half_size); i > 0;
       --i) {
    const Vector2d tuft = random_place(half_size, random);
    const double height = o.grass_height * between(0.3, 1, random);
    for (int blade = 0; blade < blades_in_tuft; ++blade) {
      const Vector2d place = tuft + 0.06 * normal_vector(random).head<2>();
      add_blade(scene, ground.at(place), height * between(0.6, 1, random), random);
    }
  }
}

void add_debris(surfaces& scene, const undergrowth_options& o, const terrain& ground,
                const Vector2d& half_size, const std::function<bool(const Vector2d&)>& is_free,
                std::uint64_t seed) {
  detail::random_source random = random_for(seed, stream::debris);
  const auto distribute = [&](double per_hectare, const auto& add) {
    for (std::size_t i = count_on(per_hectare, half_size); i > 0; --i) {
      const Vector2d place = random_place(half_size, random);
      detail::random_source own(random.next());  // a place that is taken changes nothing elsewhere
      if (is_free(place)) add(place, own);
    }
  };
  distribute(o.logs_per_hectare,
             [&](const Vector2d& place, detail::random_source& own) { add_log(scene, ground, place, own); });
  distribute(o.stumps_per_hectare, [&](const Vector2d& place, detail::random_source& own) {
    const double radius = between(0.06, 0.25, own);
    add_stump(scene, ground.at(place), radius, between(0.1, 0.5, own));
  });
  distribute(o.poles_per_hectare, [&](const Vector2d& place, detail::random_source& own) {
    add_pole(scene, ground.at(place), own);
  });
}

void add_remains(surfaces& scene, const Vector3d& position, double dbh, const terrain& ground,
                 detail::random_source& random) {
  add_stump(scene, position, 0.5 * dbh, between(0.1, 0.3, random));
  const Vector2d heap = position.head<2>() + 1.5 * random_direction(random);
  for (int i = 0; i < 30; ++i) {
    const Vector2d place = heap + 0.7 * normal_vector(random).head<2>();
    const Vector2d direction = random_direction(random);
    const Vector2d along = between(0.4, 1.8, random) * direction;
    const auto lying = [&](const Vector2d& p) {
      return Vector3d(ground.at(p) + Vector3d(0, 0, between(0.02, 0.4, random)));
    };
    const Vector3d base = lying(place), tip = lying(place + along);
    scene.add_curve({with_radius(base, between(0.005, 0.015, random)), with_radius(tip, 0.003)});
    for (int leaf = 0; leaf < 10; ++leaf) {
      const Vector3d normal = normal_vector(random);
      const Vector3d aside = 0.05 * normal_vector(random);
      scene.add_disc(base + random.uniform() * (tip - base) + aside, 0.04, normal);
    }
  }
}

}  // namespace globalmatch::support
