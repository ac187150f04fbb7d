#include "globalmatch/detail/mapping/cell_sorter.hpp"
#include "globalmatch/detail/mapping/stem_taper.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "catch.hpp"
#include "forest_scenes.hpp"
#include "globalmatch/detail/core/statistics.hpp"
#include "leaning_stems.hpp"

namespace globalmatch::test_stem_taper {

using namespace detail;

using scenes::all_of;
using scenes::as_local_points;
using scenes::ground_of;
using scenes::points_on;

using Eigen::Vector3d;
using scenes::sloped_terrain;
using scenes::upright;

namespace {

constexpr double relative_taper = 0.06;  // [1/m]

/// Stems with a taper of their own kind, and what was found of them without it: a few are seen all around and
/// well, others from one side and by few points. Below 0.4 m `flare` [m] is added towards x.
struct tapered_stand {
  local_points points;
  std::vector<stem_cylinder> found;
  std::vector<cylinder> truth;

  tapered_stand(int well_seen, int faint, double flare, double taper_of_faint = relative_taper) {
    random_source random(1);
    for (int i = 0; i < well_seen + faint; ++i) {
      const bool well = i < well_seen;
      cylinder stem = upright(2 + 2.0 * (i % 8), 2 + 2.0 * (i / 8), 0, 0.1 + 0.02 * (i % 5));
      stem.taper = (well ? relative_taper : taper_of_faint) * stem.radius;
      truth.push_back(stem);
      stem_cylinder fit;
      fit.rms = 0.003;
      for (int k = 0; k < (well ? 2000 : 300); ++k) {
        const auto [outwards, p] = scenes::random_surface_point(
            random, stem, {.from = 0.2, .to = 3, .arc = (well ? 2 : 0.8) * std::numbers::pi, .noise = 0.003});
        const double lifted = p.z < 0.4 ? flare * std::max(outwards.x, 0.0) : 0;
        fit.support.push_back(static_cast<point_index>(points.size()));
        points.push_back(vec3f(p + outwards * (lifted - stem.taper * p.z)),
                         static_cast<point_index>(points.size()));
      }
      std::vector<vec3> all;
      for (const point_index k : fit.support) all.push_back(vec3(points[k]));
      fit.cylinder = refine_cylinder(stem, all, tolerance, options).value();
      found.push_back(fit);
    }
  }

  /// [m] median horizontal distance of the bases of the stems of the second kind from the true ones.
  double error_of(const std::vector<stem_cylinder>& stems, int from) const {
    std::vector<double> errors;
    for (std::size_t i = std::size_t(from); i < stems.size(); ++i)
      errors.push_back((stems[i].cylinder.at_height(0) - truth[i].point).norm());
    return median(errors);
  }

  static constexpr double tolerance = 0.02;
  cylinder_options options = {.usual_taper = 0};
};

}  // namespace

TEST_CASE("the common taper is that of the stems with most support, and is estimated from ten of them only") {
  tapered_stand stand(15, 25, 0, 0.02);
  std::reverse(stand.found.begin(), stand.found.end());  // the others come first
  const auto taper_of = [&](const std::vector<stem_cylinder>& stems) {
    return common_taper(stems, stand.points, sloped_terrain({}), stand.tolerance, stand.options);
  };
  REQUIRE(taper_of(stand.found));
  const double in_the_middle = relative_taper / (1 - relative_taper * 1.7);  // of the radius 1.7 m up
  CHECK(*taper_of(stand.found) == Approx(in_the_middle).epsilon(0.02));
  CHECK_FALSE(taper_of({stand.found.begin(), stand.found.begin() + 39}));
  CHECK_FALSE(taper_of({}));
  for (stem_cylinder& s : stand.found)
    std::erase_if(s.support, [&](point_index i) { return stand.points.z[i] > 0.4; });
  CHECK_FALSE(taper_of(stand.found));  // nothing is seen above the root flare
}

TEST_CASE("stems seen from one side stand where they do once the taper of the others is known") {
  const tapered_stand stand(15, 25, 0);
  auto refitted = stand.found;
  refit_with_common_taper(refitted, stand.points, sloped_terrain({}), stand.tolerance, stand.options);
  CHECK(stand.error_of(refitted, 15) < 0.7 * stand.error_of(stand.found, 15));
  for (const stem_cylinder& s : refitted) CHECK(axis_uncertainty(s.covariance) > 0);
}

TEST_CASE("the root flare does not move a stem") {
  const tapered_stand stand(8, 0, 0.015);
  auto refitted = stand.found;
  refit_with_common_taper(refitted, stand.points, sloped_terrain({}), stand.tolerance, stand.options);
  CHECK(stand.error_of(stand.found, 0) > 0.001);
  CHECK(stand.error_of(refitted, 0) < 0.001);
}

TEST_CASE("cylinders proper, stems off the terrain and stems seen at their base only stay as they are") {
  const tapered_stand stand(1, 1, 0);
  const auto is_same = [&](const std::vector<stem_cylinder>& stems) {
    for (std::size_t i = 0; i < stems.size(); ++i)
      if (stems[i].cylinder.point != stand.found[i].cylinder.point) return false;
    return true;
  };
  auto proper = stand.found, off = stand.found, foot = stand.found;
  refit_with_common_taper(proper, stand.points, sloped_terrain({}), stand.tolerance, {});
  CHECK(is_same(proper));
  refit_with_common_taper(off, stand.points, terrain{}, stand.tolerance, stand.options);
  CHECK(is_same(off));
  for (stem_cylinder& s : foot)
    std::erase_if(s.support, [&](point_index i) { return stand.points.z[i] > 0.4; });
  refit_with_common_taper(foot, stand.points, sloped_terrain({}), stand.tolerance, stand.options);
  CHECK(is_same(foot));
}

TEST_CASE("stems are refitted to the same bits by any number of threads") {
  const tapered_stand stand(15, 25, 0);
  auto one = stand.found, four = stand.found;
  refit_with_common_taper(one, stand.points, sloped_terrain({}), stand.tolerance, stand.options,
                          {.threads = 1});
  refit_with_common_taper(four, stand.points, sloped_terrain({}), stand.tolerance, stand.options,
                          {.threads = 4});
  for (std::size_t i = 0; i < one.size(); ++i) {
    CHECK(one[i].cylinder.point == four[i].cylinder.point);
    CHECK(one[i].covariance.numbers == four[i].covariance.numbers);
  }
}

TEST_CASE("the root flare ends so high above the ground where the stem stands, not above zero") {
  random_source random(6);
  const terrain ground = ground_of([](double x, double) { return 30 + 0.1 * x; }, 0, 0, 0);
  stem_cylinder stem;
  stem.cylinder = {{8.2, 11.4, 32}, vec3{0.1, 0.05, 1}.normalized(), 0.2, 0.01};
  const auto points = points_on(stem.cylinder, 500, -1.3, 1.5, 3, random);
  stem.support = all_of(points.size());
  const auto base = intersect_terrain(stem.cylinder, ground);
  REQUIRE(base);
  CHECK(base->z == Approx(30 + 0.1 * base->x).margin(1e-4));
  const auto above = above_root_flare(stem, as_local_points(points), ground);
  CHECK(above.size() == std::size_t(std::count_if(points.begin(), points.end(),
                                                  [&](const vec3& p) { return p.z > base->z + 0.4; })));
  CHECK(above.size() < points.size() - 20);
}

TEST_CASE("the common taper is that of the best seen stems, as a share of their radius") {
  random_source random(7);
  const terrain ground = ground_of([](double, double y) { return 5 + 0.05 * y; }, 0, 0, 0);
  std::vector<vec3> points;
  std::vector<stem_cylinder> stems;
  for (int i = 0; i < 60; ++i) {
    const bool best = i % 4 == 1;
    stem_cylinder stem;
    const double radius = 0.1 + 0.004 * i;
    stem.cylinder = {
        {1.5 + 2 * (i % 9), 1.2 + 2 * (i / 9), 7}, {0, 0, 1}, radius, (best ? 0.05 : 0.005) * radius};
    for (const vec3& p : points_on(stem.cylinder, best ? 300 : 150, -1, 2, 5, random)) {
      stem.support.push_back(point_index(points.size()));
      points.push_back(p);
    }
    stems.push_back(stem);
  }
  const auto taper = common_taper(stems, as_local_points(points), ground, 0.03, {.usual_taper = 0.005});
  REQUIRE(taper);
  CHECK(*taper == Approx(0.05).epsilon(0.1));
}

}  // namespace globalmatch::test_stem_taper
