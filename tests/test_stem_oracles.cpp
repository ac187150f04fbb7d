// Formulas of the mapping of stems against oracles, in scenes without symmetry.
#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <numeric>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/eigen_border.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "globalmatch/detail/mapping/cell_columns.hpp"
#include "globalmatch/detail/mapping/cylinder_fit.hpp"
#include "globalmatch/detail/mapping/samples.hpp"
#include "globalmatch/detail/mapping/stem_base.hpp"
#include "globalmatch/detail/mapping/stem_cylinder.hpp"
#include "globalmatch/detail/mapping/stem_positions.hpp"
#include "globalmatch/detail/mapping/stem_taper.hpp"
#include "globalmatch/detail/mapping/vertical_direction.hpp"
#include "globalmatch/detail/mapping/verticality.hpp"

namespace globalmatch {

using namespace detail;

namespace {

using matrix6 = Eigen::Matrix<double, 6, 6>;

/// A cylinder that leans and tapers, nowhere near the origin.
cylinder leaning_cylinder() {
  return {{7.3, -4.1, 12.2}, vec3{0.21, -0.13, 1}.normalized(), 0.23, 0.011};
}

/// Points on the surface of a cylinder, `low` to `high` [m] along it from `point`, over some of its turn.
std::vector<vec3> points_on(const cylinder& c, std::size_t count, double low, double high, double turn,
                            random_source& random) {
  const vec3 u = c.axis.unit_orthogonal(), v = c.axis.cross(u);
  std::vector<vec3> points;
  for (std::size_t i = 0; i < count; ++i) {
    const double along = low + (high - low) * random.uniform(), angle = turn * random.uniform();
    const double radius = c.radius - c.taper * along;
    points.push_back(c.point + along * c.axis + (radius * std::cos(angle)) * u +
                     (radius * std::sin(angle)) * v);
  }
  return points;
}

local_points as_local_points(const std::vector<vec3>& points) {
  local_points result;
  for (std::size_t i = 0; i < points.size(); ++i)
    result.push_back(vec3f(points[i]), static_cast<point_index>(i));
  return result;
}

std::vector<point_index> all_of(std::size_t count) {
  std::vector<point_index> indices(count);
  std::iota(indices.begin(), indices.end(), point_index(0));
  return indices;
}

/// Ground at z = height(x, y) over 20 m by 20 m, a point in each node but for a hole.
template <class Height>
terrain ground_of(const Height& height, double hole_x, double hole_y, double hole) {
  terrain ground;
  ground.resolution = 0.5;
  ground.columns = ground.rows = 40;
  ground.first_ground.push_back(0);
  random_source random(77);
  for (int r = 0; r < ground.rows; ++r)
    for (int c = 0; c < ground.columns; ++c) {
      ground.heights.push_back(float(height((c + 0.5) * 0.5, (r + 0.5) * 0.5)));
      ground.has_data.push_back(1);
      for (int k = 0; k < 3; ++k) {
        const double x = (c + random.uniform()) * 0.5, y = (r + random.uniform()) * 0.5;
        if (std::hypot(x - hole_x, y - hole_y) >= hole)
          ground.ground.push_back(vec3f(vec3{x, y, height(x, y)}));
      }
      ground.first_ground.push_back(std::uint32_t(ground.ground.size()));
    }
  return ground;
}

/// Covariance of the parameters of a cylinder from derivatives of `surface_distance` by small differences.
matrix6 numeric_covariance(const cylinder& c, const std::vector<vec3>& points, double sigma,
                           const cylinder_options& options) {
  const vec3 u = c.axis.unit_orthogonal(), v = c.axis.cross(u);
  const auto changed = [&](int parameter, double by) {
    cylinder other = c;
    if (parameter == 0) other.point += by * u;
    if (parameter == 1) other.point += by * v;
    if (parameter == 2) other.axis = (c.axis + by * u).normalized();
    if (parameter == 3) other.axis = (c.axis + by * v).normalized();
    if (parameter == 4) other.radius += by;
    if (parameter == 5) other.taper += by;
    return other;
  };
  matrix6 normal = matrix6::Zero();
  for (const vec3& p : points) {
    Eigen::Matrix<double, 6, 1> row;
    constexpr double step = 1e-6;
    for (int k = 0; k < 6; ++k)
      row[k] = (changed(k, step).surface_distance(p) - changed(k, -step).surface_distance(p)) / (2 * step);
    normal += row * row.transpose();
  }
  normal += 1e-6 * double(points.size()) * matrix6::Identity();
  normal(5, 5) += options.taper_weight;
  return sigma * sigma * normal.inverse();
}

}  // namespace

TEST_CASE("points of a tapered cylinder that leans lie on its surface, at each height") {
  const cylinder c = leaning_cylinder();
  const vec3 across = c.axis.unit_orthogonal();
  for (const double z : {9.0, 12.2, 16.5}) {
    CHECK(c.at_height(z).z == Approx(z));
    CHECK(c.axis_distance(c.at_height(z)) == Approx(0).margin(1e-9));
    CHECK(c.surface_distance(c.at_height(z) + c.radius_at_height(z) * across) == Approx(0).margin(1e-9));
  }
  CHECK(c.radius_at_height(9) > c.radius_at_height(16.5));
}

TEST_CASE("a circle through three points is as far from each") {
  random_source random(1);
  for (int i = 0; i < 50; ++i) {
    const auto place = [&] { return vec2{30 + random.normal(), -8 + random.normal()}; };
    const vec2 a = place(), b = place(), c = place();
    const auto found = circle_through(a, b, c);
    REQUIRE(found);
    for (const vec2& p : {a, b, c}) CHECK((p - found->center).norm() == Approx(found->radius));
  }
}

TEST_CASE("the covariance of a cylinder is that of its linearised surface distances") {
  random_source random(2);
  const cylinder c = leaning_cylinder();
  const auto points = points_on(c, 400, -0.4, 1.9, 2.1, random);  // one side, and not about the point
  const cylinder_options options{.usual_taper = 0.01, .taper_weight = 5};
  const matrix6 expected = numeric_covariance(c, points, 0.007, options);
  const small_matrix covariance = cylinder_covariance(c, points, 0.007, options);
  for (int row = 0; row < 6; ++row)
    for (int column = 0; column < 6; ++column) {
      CAPTURE(row, column);
      CHECK(covariance(std::size_t(row), std::size_t(column)) ==
            Approx(expected(row, column))
                .epsilon(0.005)
                .margin(1e-3 * std::sqrt(expected(row, row) * expected(column, column))));
    }
}

TEST_CASE("uncertainties along a stem are those of the linearised axis and radius") {
  random_source random(3);
  const cylinder c = leaning_cylinder();
  const auto points = points_on(c, 300, -0.2, 2.4, 1.7, random);
  const small_matrix covariance =
      cylinder_covariance(c, points, 0.01, {.usual_taper = 0.01, .taper_weight = 5});
  matrix6 all;
  for (int row = 0; row < 6; ++row)
    for (int column = 0; column < 6; ++column)
      all(row, column) = covariance(std::size_t(row), std::size_t(column));
  for (const double along : {-1.5, 0.0, 0.8, 3.0}) {
    CAPTURE(along);
    Eigen::Matrix<double, 6, 1> radius;
    radius << 0, 0, 0, 0, 1, -along;
    CHECK(radius_uncertainty(covariance, along) == Approx(std::sqrt(radius.dot(all * radius))));
    double worst = 0;
    for (int k = 0; k < 3600; ++k) {
      const double angle = k * std::numbers::pi / 3600, x = std::cos(angle), y = std::sin(angle);
      Eigen::Matrix<double, 6, 1> shift;
      shift << x, y, along * x, along * y, 0, 0;
      worst = std::max(worst, std::sqrt(shift.dot(all * shift)));
    }
    CHECK(axis_uncertainty(covariance, along) == Approx(worst).epsilon(1e-4));
  }
}

TEST_CASE("a refined cylinder is the one that its points lie on, its taper too") {
  random_source random(4);
  const cylinder truth = leaning_cylinder();
  const auto points = points_on(truth, 500, -1, 2, 3, random);
  cylinder start = truth;
  start.point += vec3{0.02, -0.015, 0.7};
  start.axis = (start.axis + vec3{0.02, 0.01, 0}).normalized();
  start.radius += 0.02;
  start.taper = 0;
  const auto free = refine_cylinder(start, points, 0.1, {.usual_taper = 0.0, .taper_weight = 1e-6});
  REQUIRE(free);
  for (const vec3& p : points) CHECK(std::abs(free->surface_distance(p)) < 1e-4);
  CHECK(free->taper == Approx(truth.taper).epsilon(0.01));
  CHECK(free->axis.dot(truth.axis) > 1 - 1e-7);
  const auto held = refine_cylinder(start, points, 0.1, {.usual_taper = 0.03, .taper_weight = 1e7});
  REQUIRE(held);
  CHECK(held->taper == Approx(0.03).epsilon(0.001));
}

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

TEST_CASE("the ground at a stem is a plane whose points count less the farther they are from it") {
  const double x = 9.7, y = 8.3, radius = 0.3;
  const auto height = [](double at_x, double at_y) {
    return 3 + 0.1 * at_x - 0.2 * at_y + 0.02 * (at_x - 9.7) * (at_x - 9.7);
  };
  terrain ground = ground_of(height, x, y, 0.3);
  ground.ground.front().x = float(x + 0.34);  // lifted by the root flare
  ground.ground.front().y = float(y);
  std::swap(ground.ground.front(),
            ground.ground[ground.first_ground[ground.node(int(x / 0.5), int(y / 0.5))]]);
  for (vec3f& p : ground.ground)
    if (std::hypot(p.x - x, p.y - y) < radius + 0.07) p.z += 0.015f;
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  double weights = 0;
  const auto visit = [&](const auto& use) {
    for (const vec3f& p : ground.ground) {
      const double dx = p.x - x, dy = p.y - y, distance = std::hypot(dx, dy);
      if (distance <= radius + 0.07 || distance >= 1) continue;
      use(Eigen::Vector3d(1, dx, dy), double(p.z), std::pow(1 + distance * distance / 0.04, -2));
    }
  };
  visit([&](const Eigen::Vector3d& row, double z, double weight) {
    normal += weight * row * row.transpose();
    right += weight * z * row;
    weights += weight;
  });
  normal(1, 1) += 3e-3 * weights;
  normal(2, 2) += 3e-3 * weights;
  const double expected = 3 + 0.1 * x - 0.2 * y;
  Eigen::Vector3d shifted = Eigen::Vector3d::Zero();  // heights above the place, as a ridge asks for
  visit(
      [&](const Eigen::Vector3d& row, double z, double weight) { shifted += weight * (z - expected) * row; });
  const Eigen::Vector3d plane = normal.ldlt().solve(shifted);
  const auto found = ground_at(ground, x, y, radius);
  REQUIRE(found);
  CHECK(found->height == Approx(expected + plane[0]).margin(5e-4));
  CHECK(found->sigma == Approx(0.6 * 0.02 * std::sqrt(normal.inverse()(0, 0))).epsilon(0.1));
}

TEST_CASE("what stands out of the ground upwards does not lift it at a stem, a pit there counts") {
  const auto flat = [](double, double) { return 4.0; };
  terrain raised = ground_of(flat, 0, 0, 0);
  for (std::size_t i = 0; i < raised.ground.size(); i += 4) raised.ground[i].z += 0.2f;
  CHECK(ground_at(raised, 10.1, 9.2, 0.1)->height == Approx(4).margin(0.01));
  terrain lowered = ground_of(flat, 0, 0, 0);
  for (std::size_t i = 0; i < lowered.ground.size(); i += 4) lowered.ground[i].z -= 0.2f;
  CHECK(ground_at(lowered, 10.1, 9.2, 0.1)->height < 3.97);
}

TEST_CASE("a thin fragment within the radius of a thick stem is of that stem") {
  random_source random(8);
  const terrain ground = ground_of([](double, double) { return 2.0; }, 0, 0, 0);
  for (const double apart : {0.2, 0.35}) {
    stem_cylinders found;
    found.distance_tolerance = 0.02;
    std::vector<vec3> points;
    for (const auto& [x, radius, count] : {std::tuple(5.0, 0.3, 300), std::tuple(5.0 + apart, 0.08, 100)}) {
      stem_cylinder stem;
      stem.cylinder = {{x, 6, 3.5}, {0, 0, 1}, radius, 0};
      for (const vec3& p : points_on(stem.cylinder, std::size_t(count), -1, 1, 3, random)) {
        stem.support.push_back(point_index(points.size()));
        points.push_back(p);
      }
      found.stems.push_back(stem);
    }
    const auto merged = merge_fragments(found, as_local_points(points), ground, {});
    CHECK(merged.size() == (apart < 0.3 ? 1u : 2u));
    CHECK(merged.front().support.size() == (apart < 0.3 ? 400u : 300u));
  }
}

TEST_CASE("a located stem has the radius and its uncertainty at breast height, in the frame of the scan") {
  random_source random(9);
  terrain ground = ground_of([](double x, double y) { return 20 + 0.15 * x - 0.1 * y; }, 0, 0, 0);
  ground.frame = {{400000, 5200000, 700}, levelling_rotation(vec3{0.3, -0.2, 0.9})};
  stem_cylinder found;
  found.cylinder = {{8.4, 12.1, 22.6}, vec3{0.25, 0.1, 1}.normalized(), 0.31, 0.03};
  const auto points = points_on(found.cylinder, 200, -0.5, 1.2, 2, random);
  found.support = all_of(points.size());
  const cylinder_options options{.usual_taper = 0.03, .taper_weight = 2};
  found.covariance = cylinder_covariance(found.cylinder, points, 0.02, options);
  const auto s = locate_stem(found, as_local_points(points), ground);
  REQUIRE(s);
  const cylinder& c = found.cylinder;
  const vec3 base = ground.frame.to_local(from_eigen(s->position));
  CHECK(base.z == Approx(20 + 0.15 * base.x - 0.1 * base.y).margin(0.02));
  CHECK(c.axis_distance(base) < 1e-6);
  CHECK(s->height_sigma > 0);
  CHECK((ground.frame.rotation * from_eigen(s->axis) - c.axis).norm() < 1e-9);
  const double along = (base.z - c.point.z) / c.axis.z, breast = along + 1.3 / c.axis.z;
  CHECK(s->radius == Approx(c.radius - c.taper * breast));
  const double lean = std::hypot(c.axis.x, c.axis.y) / c.axis.z;
  CHECK(s->radius_sigma ==
        Approx(std::hypot(2.3 * radius_uncertainty(found.covariance, breast), c.taper * s->height_sigma)));
  CHECK(s->position_sigma ==
        Approx(std::hypot(2.3 * axis_uncertainty(found.covariance, along), lean * s->height_sigma)));
}

TEST_CASE("samples on stems are those nearest to the middles of cells, with normals across the axis") {
  random_source random(10);
  stem_map map;
  map.terrain.frame = {{1000, -2000, 300}, levelling_rotation(vec3{-0.2, 0.3, 0.8})};
  stem_cylinder stem;
  stem.cylinder = leaning_cylinder();
  const cell_columns cells =
      sort_into_cells(as_local_points(points_on(stem.cylinder, 6000, -1, 1, 4, random)), cell_width);
  stem.support = all_of(cells.points().size());
  collect_samples({stem}, cells.points(), map, {});
  REQUIRE(map.stem_samples.size() > 100);
  REQUIRE(map.stem_samples.size() < 4000);
  REQUIRE(map.stem_normals.size() == map.stem_samples.size());
  const auto off_middle = [&](const vec3& p) {
    double squares = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double share = p[axis] / cell_width;
      squares += std::pow(share - std::floor(share) - 0.5, 2);
    }
    return squares;
  };
  const auto cell_of = [&](const vec3& p) {
    return std::array{std::floor(p.x / cell_width), std::floor(p.y / cell_width),
                      std::floor(p.z / cell_width)};
  };
  for (std::size_t i = 0; i < map.stem_samples.size(); i += 7) {
    const vec3 p = map.terrain.frame.to_local(from_eigen(map.stem_samples[i]));
    const vec3 normal = map.terrain.frame.rotation * from_eigen(map.stem_normals[i]);
    const vec3 from_axis = p - stem.cylinder.point;
    CHECK(normal.norm() == Approx(1));
    CHECK(std::abs(normal.dot(stem.cylinder.axis)) < 1e-9);
    CHECK(normal.dot(from_axis) == Approx(stem.cylinder.axis_distance(p)));
    for (std::size_t k = 0; k < cells.points().size(); ++k)
      if (const vec3 other(cells.points()[k]); cell_of(other) == cell_of(p))
        CHECK(off_middle(other) > off_middle(p) - 1e-3);
  }
}

TEST_CASE("the verticality from sums is that of the normal of principal component analysis") {
  random_source random(11);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d a(random.normal(), random.normal(), random.normal()),
        b(random.normal(), random.normal(), random.normal());
    moments sums;
    std::vector<Eigen::Vector3d> points;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (int k = 0; k < 30; ++k) {
      points.push_back(Eigen::Vector3d(5, -7, 3) + random.normal() * a + 0.6 * random.normal() * b +
                       0.05 * Eigen::Vector3d(random.normal(), random.normal(), random.normal()));
      mean += points.back() / 30;
      sums.add(points.back().x(), points.back().y(), points.back().z());
    }
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    for (const Eigen::Vector3d& p : points) covariance += (p - mean) * (p - mean).transpose();
    const Eigen::Vector3d normal =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvectors().col(0);
    CHECK(sums.verticality() == Approx(1 - std::abs(normal.z())).margin(1e-3));
  }
}

TEST_CASE("the uncertainty of the vertical is the noise of the axes over the root of their number") {
  random_source random(12);
  const vec3 truth = vec3{0.3, -0.4, 1}.normalized();
  const vec3 u = truth.unit_orthogonal(), v = truth.cross(u);
  constexpr double noise = 0.03;
  double squares = 0, sigmas = 0;
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<vec3> axes;
    for (int i = 0; i < 100; ++i) {
      const double lean = i % 10 == 0 ? 10 : 1;  // a tenth leans much
      axes.push_back(
          (truth + noise * lean * random.normal() * u + noise * lean * random.normal() * v).normalized());
    }
    const auto upright = upright_of(axes);
    REQUIRE(upright);
    squares += (from_eigen(upright->up) - truth).squared_norm() / 200;
    sigmas += upright->sigma / 200;
  }
  CHECK(sigmas == Approx(std::sqrt(squares / 2)).epsilon(0.15));  // in one direction
}

}  // namespace globalmatch
