#include "globalmatch/detail/mapping/stem_cylinder.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "globalmatch/detail/mapping/cell_sorter.hpp"
#include "leaning_stems.hpp"

namespace globalmatch::test_stem_cylinder {

using namespace detail;

using scenes::as_local_points;
using scenes::leaning_cylinder;
using scenes::points_on;

namespace {

/// Points on a stem, inside of it and around it, in cells.
struct stem_scene {
  cylinder stem = leaning_cylinder();
  std::vector<vec3> points;

  explicit stem_scene(std::size_t on_surface) {
    random_source random(31);
    points = points_on(stem, on_surface, -0.95, 0.95, 4, random);
  }
  void add(std::size_t count, double from_surface) {
    random_source random(32);
    cylinder other = stem;
    other.radius += from_surface;
    for (const vec3& p : points_on(other, count, -0.8, 0.8, 6, random)) points.push_back(p);
  }
  std::optional<stem_cylinder> score(const stem_cylinder_options& changed = {}) const {
    stem_cylinder_options options = changed;
    options.cylinder.distance_tolerance = 0.02;
    return score_stem(stem, sort_into_cells(as_local_points(points), 0.05), options);
  }
};

}  // namespace

TEST_CASE("all points near a stem are visited, those inside it too, however it leans") {
  random_source random(5);
  std::vector<vec3> scattered;
  for (int i = 0; i < 20000; ++i)
    scattered.push_back({4 + 6 * random.uniform(), -8 + 6 * random.uniform(), 11 + 3 * random.uniform()});
  const cell_columns cells = sort_into_cells(as_local_points(scattered), 0.05);
  cylinder c{{7.3, -4.8, 12.2}, vec3{0.35, -0.3, 1}.normalized(), 0.3, 0.04};
  std::vector<point_index> expected, found;
  for (std::size_t i = 0; i < cells.points().size(); ++i)
    if (c.surface_distance(vec3(cells.points()[i])) < 0.1) expected.push_back(point_index(i));
  REQUIRE(expected.size() > 200);
  for_each_near(cells, c, 0.1, [&](point_index i, double distance) {
    found.push_back(i);
    CHECK(distance == Approx(c.surface_distance(vec3(cells.points()[i]))).margin(1e-6));
  });
  CHECK(found == expected);
}

TEST_CASE("the evidence of a stem counts what lies on it, in it and around it") {
  stem_scene scene(600);
  scene.add(60, -0.1);
  scene.add(90, 0.06);
  scene.add(50, 0.15);  // too far to count
  const auto found = scene.score();
  REQUIRE(found);
  CHECK(found->support.size() == 600);
  CHECK(std::is_sorted(found->support.begin(), found->support.end()));
  CHECK(found->surface_share == Approx(600.0 / 750));
  CHECK(found->inside_share == Approx(60.0 / 600));
  CHECK(found->rms < 1e-5);
  CHECK(found->filled_height > 1.7);
  CHECK(found->filled_height <= 2.0 + 1e-9);
  const stem_scene alone(600);
  CHECK(alone.score()->surface_share == 1);
  CHECK(alone.score()->inside_share == 0);
}

TEST_CASE("a cylinder is no stem beyond any single one of the limits") {
  stem_scene scene(600);
  scene.add(60, -0.1);
  scene.add(90, 0.06);
  const auto found = scene.score();
  REQUIRE(found);
  const double height = found->filled_height, sigma = axis_uncertainty(found->covariance);
  CHECK(scene.score({.min_height = height - 0.01}));
  CHECK_FALSE(scene.score({.min_height = height + 0.01}));
  CHECK(scene.score({.min_points = 600}));
  CHECK_FALSE(scene.score({.min_points = 601}));
  CHECK(scene.score({.min_share = 0.799}));
  CHECK_FALSE(scene.score({.min_share = 0.801}));
  CHECK(scene.score({.max_inside = 0.101}));
  CHECK_FALSE(scene.score({.max_inside = 0.099}));
  CHECK(scene.score({.max_sigma = 1.01 * sigma}));
  CHECK_FALSE(scene.score({.max_sigma = 0.99 * sigma}));
}

TEST_CASE("the rms of a stem is that of its support, and its covariance grows with it") {
  random_source random(33);
  stem_scene scene(0), rougher(0);
  for (const auto& [to, noise] : {std::pair(&scene, 0.004), std::pair(&rougher, 0.008)})
    for (int i = 0; i < 800; ++i) {
      cylinder other = to->stem;
      other.radius += noise * (2 * random.uniform() - 1);  // all within the tolerance
      to->points.push_back(points_on(other, 1, -0.95, 0.95, 4, random).front());
    }
  const auto found = scene.score(), rough = rougher.score();
  REQUIRE((found && rough));
  CHECK(found->rms == Approx(0.004 / std::sqrt(3.0)).epsilon(0.05));
  CHECK(rough->rms == Approx(0.008 / std::sqrt(3.0)).epsilon(0.05));
  // Not below a quarter of the tolerance, 5 mm.
  CHECK(found->covariance(4, 4) / rough->covariance(4, 4) == Approx(1).epsilon(0.25));
}

TEST_CASE("a stem is the surer the higher, the clearer, the smoother and the thinner it is") {
  constexpr double tolerance = 0.02;
  stem_cylinder faint;
  faint.filled_height = 1.4;
  faint.surface_share = 0.7;
  faint.rms = tolerance / std::sqrt(3.0);  // points fill the tolerance evenly, as leaves do
  faint.cylinder.radius = 0.25;
  stem_cylinder high = faint, clear = faint, smooth = faint, thin = faint, all = faint;
  high.filled_height = all.filled_height = 2.8;
  clear.surface_share = all.surface_share = 1;
  smooth.rms = all.rms = tolerance / 3;
  thin.cylinder.radius = all.cylinder.radius = 0.08;
  for (const stem_cylinder& better : {high, clear, smooth, thin}) {
    CHECK(stem_quality(better, tolerance) > stem_quality(faint, tolerance));
    CHECK(stem_quality(all, tolerance) > stem_quality(better, tolerance));
  }
  CHECK(stem_quality(all, tolerance) < 1);
  CHECK(stem_quality(all, tolerance) > 0.99);
  CHECK(stem_quality(faint, tolerance) < 0.01);
  CHECK(stem_quality(faint, tolerance) > 0);
}

TEST_CASE("stems thicker than those that the quality was fitted to are no less likely") {
  stem_cylinder thick;
  thick.filled_height = 2;
  thick.surface_share = 0.9;
  thick.rms = 0.01;
  thick.cylinder.radius = 0.3;
  const double fitted = stem_quality(thick, 0.03);
  CHECK(fitted > 0.7);
  for (const double radius : {0.5, 0.8}) {
    thick.cylinder.radius = radius;
    CHECK(stem_quality(thick, 0.03) == fitted);
  }
}

TEST_CASE("a scored stem carries its quality, which is low among leaves that fill the space around") {
  const stem_scene scene(600);
  const auto found = scene.score();
  REQUIRE(found);
  CHECK(found->quality == stem_quality(*found, 0.02));
  CHECK(found->quality > 0.9);
  stem_scene leaves(0);
  random_source random(34);
  for (int i = 0; i < 600; ++i) {
    cylinder other = leaves.stem;
    other.radius += 0.12 * random.uniform() - 0.03;
    leaves.points.push_back(points_on(other, 1, -0.95, 0.95, 4, random).front());
  }
  const auto doubtful = leaves.score({.min_share = 0, .max_inside = 1, .max_sigma = 1});
  REQUIRE(doubtful);
  CHECK(doubtful->quality < 0.1);
}

TEST_CASE("there is no stem where there are no points, or hardly any") {
  CHECK_FALSE(stem_scene(0).score());
  CHECK_FALSE(stem_scene(1).score());
  CHECK_FALSE(stem_scene(14).score({.min_height = 0}));
}

}  // namespace globalmatch::test_stem_cylinder
