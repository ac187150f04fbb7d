#include "globalmatch/detail/published/point_verticality.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "catch.hpp"
#include "forest_scenes.hpp"
#include "support/message_of.hpp"

namespace globalmatch::test_point_verticality {

using namespace detail;

using Eigen::Vector3d;
using Eigen::Vector3f;
using scenes::cloud;
using support::message_of;

namespace {

/// A grid of 20 x 20 points with the given step, in the plane of u and v.
cloud plane(const Vector3d& u, const Vector3d& v, double step) {
  cloud points;
  for (int i = 0; i < 20; ++i)
    for (int j = 0; j < 20; ++j) points.push_back((i * step * u + j * step * v).cast<float>());
  return points;
}

std::pair<float, float> min_and_max(const std::vector<local_surface>& surfaces) {
  std::pair<float, float> range{1, 0};
  for (const local_surface& s : surfaces) {
    range.first = std::min(range.first, s.verticality());
    range.second = std::max(range.second, s.verticality());
  }
  return range;
}

bool all_finite(const std::vector<local_surface>& surfaces) {
  return std::all_of(surfaces.begin(), surfaces.end(), [](const local_surface& s) {
    return is_finite(vec3(s.normal)) && std::isfinite(s.spacing);
  });
}

verticality_options with_radius(double radius) {
  verticality_options options;
  options.radius = radius;
  return options;
}

verticality_options with_threshold(double threshold) {
  verticality_options options;
  options.threshold = threshold;
  return options;
}

verticality_options without_constraint() {
  verticality_options options;
  options.constraint = false;
  return options;
}

local_surface surface_with(float verticality) {
  const float z = 1 - verticality;
  return {vec3f(std::sqrt(1 - z * z), 0, z), 0.01f};
}

}  // namespace

TEST_CASE("the verticality of a floor is 0, of a wall 1, and of a slope 1 - cos(slope)") {
  const auto floor = estimate_surfaces(scenes::as_local(plane(Vector3d::UnitX(), Vector3d::UnitY(), 0.03)));
  CHECK(min_and_max(floor).second < 1e-5f);
  for (const double azimuth : {0.0, 0.4, 2.0}) {
    const Vector3d along(std::cos(azimuth), std::sin(azimuth), 0);
    const auto wall = estimate_surfaces(scenes::as_local(plane(along, Vector3d::UnitZ(), 0.03)));
    CHECK(min_and_max(wall).first > 1 - 1e-5f);
  }
  const double slope = std::numbers::pi / 6;
  const auto hill = estimate_surfaces(
      scenes::as_local(plane(Vector3d::UnitX(), {0, std::cos(slope), std::sin(slope)}, 0.03)));
  CHECK(min_and_max(hill).first == Approx(1 - std::cos(slope)).margin(1e-5));
  CHECK(min_and_max(hill).second == Approx(1 - std::cos(slope)).margin(1e-5));
}

TEST_CASE("the verticality of an upright stem exceeds the threshold all around, and its normals are radial") {
  random_source random(1);
  const cylinder stem = scenes::upright(0, 0, 0, 0.15);
  const local_points points = scenes::as_local(scenes::stem_points(random, stem, 6000));
  const auto surfaces = estimate_surfaces(points);
  std::size_t upright = 0, radial = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    upright += surfaces[i].verticality() > 0.9f ? 1 : 0;
    const vec3f outwards = vec3f(vec3{points.x[i], points.y[i], 0}.normalized());
    radial += std::abs(surfaces[i].normal.dot(outwards)) > 0.95f ? 1 : 0;
  }
  CHECK(double(upright) > 0.99 * double(points.size()));
  CHECK(double(radial) > 0.99 * double(points.size()));
}

TEST_CASE("normals are of unit length") {
  random_source random(2);
  float largest = 0;
  for (const local_surface& s : estimate_surfaces(scenes::as_local(scenes::random_cloud(random, 1000, 1))))
    if (!(s.normal == vec3f{})) largest = std::max(largest, std::abs(float(vec3(s.normal).norm()) - 1));
  CHECK(largest < 1e-5f);
}

TEST_CASE("verticality holds far from the origin of the local frame too") {
  cloud wall = plane(Vector3d::UnitX(), Vector3d::UnitZ(), 0.03125);
  for (Vector3f& p : wall) p += Vector3f(500, -800, 64);
  CHECK(min_and_max(estimate_surfaces(scenes::as_local(wall))).first > 1 - 1e-5f);
}

TEST_CASE("a radius that is given is the one used, and holds no more than its ball") {
  const local_points sparse = scenes::as_local(plane(Vector3d::UnitX(), Vector3d::UnitZ(), 0.15));
  for (const local_surface& s : estimate_surfaces(sparse, with_radius(0.10))) CHECK(s.normal == vec3f{});
  for (const local_surface& s : estimate_surfaces(sparse, with_radius(0.16)))
    CHECK_FALSE(s.normal == vec3f{});
  // A step between two floors, which a wider ball would see as a slope.
  cloud step = plane(Vector3d::UnitX(), Vector3d::UnitY(), 0.02);
  for (Vector3f& p : step) p.z() = p.x() > 0.19f ? 0.15f : 0.0f;
  CHECK(min_and_max(estimate_surfaces(scenes::as_local(step), with_radius(0.10))).second < 1e-5f);
  CHECK(min_and_max(estimate_surfaces(scenes::as_local(step), with_radius(0.20))).second > 0.01f);
}

TEST_CASE("without a given radius, sparse points get a normal from wider around, up to the largest radius") {
  const auto has_normals = [](double spacing, const verticality_options& options) {
    const auto surfaces =
        estimate_surfaces(scenes::as_local(plane(Vector3d::UnitX(), Vector3d::UnitZ(), spacing)), options);
    return std::all_of(surfaces.begin(), surfaces.end(),
                       [](const local_surface& s) { return s.verticality() > 0.999f; });
  };
  CHECK(has_normals(0.09, {}));
  CHECK(has_normals(0.12, {}));
  CHECK_FALSE(has_normals(0.30, {}));
  verticality_options wider;
  wider.max_radius = 1.5;
  CHECK(has_normals(0.30, wider));
}

TEST_CASE("spacing is that of the square grid the points lie on") {
  for (const double step : {0.01, 0.03, 0.06}) {
    CAPTURE(step);
    const auto surfaces =
        estimate_surfaces(scenes::as_local(plane(Vector3d::UnitX(), Vector3d::UnitZ(), step)));
    const float middle = surfaces[10 * 20 + 10].spacing;
    CHECK(middle == Approx(step).epsilon(0.15));
  }
}

TEST_CASE("degenerate neighbourhoods give finite surfaces") {
  cloud vertical_line, cloud_with_outlier(50, Vector3f(1, 2, 3));
  for (int i = 0; i < 50; ++i) vertical_line.push_back({1, 2, 0.01f * float(i)});
  cloud_with_outlier.push_back({1e9f, -1e9f, 1e9f});
  for (const cloud& points :
       {cloud{}, cloud{{1, 2, 3}}, cloud{{1, 2, 3}, {1, 2, 3.01f}}, vertical_line, cloud_with_outlier}) {
    const auto surfaces = estimate_surfaces(scenes::as_local(points));
    CHECK(surfaces.size() == points.size());
    CHECK(all_finite(surfaces));
  }
}

TEST_CASE("fewer than three neighbours make no normal, and no stem point") {
  const auto surfaces = estimate_surfaces(scenes::as_local({{0, 0, 0}, {0, 0, 0.05f}, {5, 5, 5}}));
  for (const local_surface& s : surfaces) {
    CHECK(s.normal == vec3f{});
    CHECK(s.verticality() == 0);
  }
  CHECK(select_stem_points(surfaces).empty());
  CHECK(select_stem_points(surfaces, without_constraint()).empty());
}

TEST_CASE("stem points are those above the threshold, or all with a normal without the constraint") {
  const std::vector<local_surface> surfaces = {surface_with(0), surface_with(0.89f), surface_with(0.91f),
                                               local_surface{}, surface_with(1)};
  using indices = std::vector<point_index>;
  CHECK(select_stem_points(surfaces) == indices{2, 4});
  CHECK(select_stem_points(surfaces, with_threshold(0.5)) == indices{1, 2, 4});
  CHECK(select_stem_points(surfaces, without_constraint()) == indices{0, 1, 2, 4});
  CHECK(select_stem_points(std::vector<local_surface>(3, surface_with(0.5f)), with_threshold(0.5)).empty());
}

TEST_CASE("surfaces have the same bits for 1, 2 and 8 threads") {
  random_source random(3);
  const local_points points = scenes::as_local(scenes::random_cloud(random, 5000, 1.5));
  const auto alone = estimate_surfaces(points, {}, {.threads = 1});
  for (const int threads : {2, 8}) {
    const auto together = estimate_surfaces(points, {}, {.threads = threads});
    CHECK(std::equal(alone.begin(), alone.end(), together.begin(), together.end(),
                     [](const local_surface& a, const local_surface& b) {
                       return a.normal == b.normal && a.spacing == b.spacing;
                     }));
  }
}

TEST_CASE("estimating surfaces reports its stage and can be cancelled") {
  const local_points points = scenes::as_local(scenes::lattice_cloud(5));
  const execution exec{.threads = 1,
                       .on_progress = [](const progress& p) { return p.stage != "verticality"; }};
  CHECK_THROWS_AS(estimate_surfaces(points, {}, exec), operation_cancelled);
}

TEST_CASE("bad verticality options are refused by name") {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const auto message = [](const auto& spoil) {
    verticality_options options;
    spoil(options);
    return message_of([&] { estimate_surfaces(local_points{}, options); });
  };
  CHECK(message([](verticality_options&) {}).empty());
  for (const double bad : {-0.1, 1.0, nan}) {
    CHECK(message([&](auto& o) { o.threshold = bad; }).starts_with("verticality.threshold"));
    CHECK(message_of([&] {
            select_stem_points({}, with_threshold(bad));
          }).starts_with("verticality.threshold"));
  }
  for (const double bad : {0.0, -0.1, nan}) {
    CHECK(message([&](auto& o) { o.radius = bad; }).starts_with("verticality.radius"));
    CHECK(message([&](auto& o) { o.max_radius = bad; }).starts_with("verticality.max_radius"));
  }
  CHECK(message([](auto& o) { o.min_neighbors = 2; }).starts_with("verticality.min_neighbors"));
}

}  // namespace globalmatch::test_point_verticality
