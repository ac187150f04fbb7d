#include "support/simulator/layout.hpp"

#include "support/simulator/detail.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace globalmatch::support {
namespace {

using namespace simulator_detail;
using Eigen::Vector2d;

bool lies_within(const Vector2d& place, const Vector2d& half_size) {
  return (place.array().abs() <= half_size.array()).all();
}

/// Takes places from `next_place` as long as they keep their distance from those before.
template <class NextPlace>
std::vector<Vector2d> spaced_places(std::size_t count, double min_spacing, const Vector2d& half_size,
                                    const NextPlace& next_place) {
  std::vector<Vector2d> places;
  const auto is_free = [&](const Vector2d& place) {
    return std::none_of(places.begin(), places.end(), [&](const Vector2d& other) {
      return (place - other).squaredNorm() < min_spacing * min_spacing;
    });
  };
  for (std::size_t tries = 0; places.size() < count; ++tries) {
    require(tries < 200 * count, "layout_options.stems_per_hectare is more than min_spacing leaves room for");
    const Vector2d place = next_place();
    if (lies_within(place, half_size) && is_free(place)) places.push_back(place);
  }
  return places;
}

std::vector<Vector2d> clumped_places(const layout_options& o, std::size_t count, const Vector2d& half_size,
                                     detail::random_source& random) {
  std::vector<Vector2d> middles;
  const double clumps = std::max(1.0, std::round(double(count) / o.clump_size));
  while (double(middles.size()) < clumps) middles.push_back(random_place(half_size, random));
  return spaced_places(count, o.min_spacing, half_size, [&] {
    const Vector2d& middle = middles[random.below(static_cast<std::uint32_t>(middles.size()))];
    return Vector2d(middle + o.clump_radius * normal_vector(random).head<2>());
  });
}

std::vector<Vector2d> row_places(const layout_options& o, const Vector2d& half_size,
                                 detail::random_source& random) {
  std::vector<Vector2d> places;
  for (double y = -half_size.y() + 0.5 * o.row_spacing; y <= half_size.y(); y += o.row_spacing) {
    for (double x = -half_size.x() + 0.5 * o.tree_spacing; x <= half_size.x(); x += o.tree_spacing) {
      const bool is_missing = random.uniform() < o.missing;
      const Vector2d place = Vector2d(x, y) + o.row_jitter * normal_vector(random).head<2>();
      if (!is_missing && lies_within(place, half_size)) places.push_back(place);
    }
  }
  return places;
}

}  // namespace

void require_valid(const layout_options& o) {
  require(o.stems_per_hectare >= 0 && o.stems_per_hectare <= 20000,
          "layout_options.stems_per_hectare must be in [0, 20000]");
  require(o.min_spacing >= 0 && o.min_spacing <= 100, "layout_options.min_spacing must be in [0, 100] m");
  require(o.clump_size >= 1 && o.clump_size <= 1000, "layout_options.clump_size must be in [1, 1000]");
  require(o.clump_radius > 0 && o.clump_radius <= 100, "layout_options.clump_radius must be in (0, 100] m");
  require(o.row_spacing >= 0.5 && o.row_spacing <= 100, "layout_options.row_spacing must be in [0.5, 100] m");
  require(o.tree_spacing >= 0.5 && o.tree_spacing <= 100,
          "layout_options.tree_spacing must be in [0.5, 100] m");
  require(o.row_jitter >= 0 && o.row_jitter <= 10, "layout_options.row_jitter must be in [0, 10] m");
  require(o.missing >= 0 && o.missing <= 1, "layout_options.missing must be in [0, 1]");
}

std::vector<Vector2d> tree_places(const layout_options& o, const Vector2d& half_size, double share,
                                  std::uint64_t seed) {
  require_valid(o);
  detail::random_source random = random_for(seed, stream::places);
  const std::size_t count = count_on(share * o.stems_per_hectare, half_size);
  switch (o.arrangement) {
    case arrangement::random:
      return spaced_places(count, o.min_spacing, half_size, [&] { return random_place(half_size, random); });
    case arrangement::clumped:
      return clumped_places(o, count, half_size, random);
    case arrangement::rows:
      return row_places(o, half_size, random);
  }
  throw std::invalid_argument("layout_options.arrangement is none of its names");
}

}  // namespace globalmatch::support
