#include "globalmatch/detail/mapping/verticality.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "catch.hpp"
#include "forest_scenes.hpp"
#include "globalmatch/detail/mapping/cell_sorter.hpp"

namespace globalmatch::test_verticality {

using namespace detail;

using Eigen::Vector3d;
using Eigen::Vector3f;

namespace {

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

}  // namespace

TEST_CASE(
    "cells have the verticality of the points in the cells around, as many as it says, by principal "
    "components") {
  random_source random(21);
  scenes::cloud dense_and_sparse = scenes::random_cloud(random, 4000, 1);
  for (const Vector3f& p : scenes::random_cloud(random, 900, 1.2))
    dense_and_sparse.push_back(p + Vector3f(3, 0, 0));
  const cell_columns cells = sort_into_cells(scenes::as_local(dense_and_sparse), 0.05);
  const auto surfaces = estimate_surfaces(cells);
  REQUIRE(surfaces.size() == cells.cells());
  const local_points& points = cells.points();
  std::array<std::size_t, column_window::max_half_width + 1> checked{};
  for (std::size_t column = 0; column < cells.columns(); ++column)
    for (auto c = cells.cells_begin(column); c < cells.cells_end(column); ++c) {
      const int half_width = surfaces[c].half_width;
      const auto cell_of = [](float v) { return std::floor(double(v) / 0.05); };
      const std::size_t first = cells.points_begin(c);
      std::vector<Vector3d> around;
      for (std::size_t i = 0; i < points.size(); ++i)
        if (std::abs(cell_of(points.x[i]) - cell_of(points.x[first])) <= half_width &&
            std::abs(cell_of(points.y[i]) - cell_of(points.y[first])) <= half_width &&
            std::abs(cell_of(points.z[i]) - cell_of(points.z[first])) <= half_width)
          around.push_back(scenes::in_double(points[i]));
      if (half_width == 0) {
        CHECK(around.size() < 4);
        continue;
      }
      Vector3d mean = Vector3d::Zero();
      for (const Vector3d& p : around) mean += p / double(around.size());
      Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
      for (const Vector3d& p : around)
        covariance += (p - mean) * (p - mean).transpose() / double(around.size());
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
      if (solver.eigenvalues()(1) < 1.1 * solver.eigenvalues()(0)) continue;  // the normal is undetermined
      const double expected = 1 - std::abs(solver.eigenvectors()(2, 0));
      CHECK(surfaces[c].verticality == Approx(expected).margin(1e-4));
      CHECK(surfaces[c].spacing == Approx((2 * half_width + 1) * 0.05 / std::sqrt(double(around.size()))));
      ++checked[std::size_t(half_width)];
    }
  for (const int half_width : {1, 2, 3}) CHECK(checked[std::size_t(half_width)] > 100);
}

TEST_CASE("cells of sparse points look further, up to three cells, and lone points have no surface") {
  const auto half_width_at = [](float spacing) {
    scenes::cloud wall;
    for (int i = 0; i < 30; ++i)
      for (int j = 0; j < 30; ++j) wall.push_back({spacing * float(i), 0.01f, spacing * float(j)});
    const cell_columns cells = sort_into_cells(scenes::as_local(wall), 0.05);
    const auto surfaces = estimate_surfaces(cells);
    CHECK(std::all_of(surfaces.begin(), surfaces.end(),
                      [](const cell_surface& s) { return s.half_width == 0 || s.verticality > 0.999f; }));
    return surfaces[surfaces.size() / 2].half_width;
  };
  CHECK(half_width_at(0.02f) == 1);
  CHECK(half_width_at(0.07f) == 2);
  CHECK(half_width_at(0.10f) == 3);
  CHECK(half_width_at(0.50f) == 0);
}

TEST_CASE("stem cells lean by thirty degrees at most, unless the options say otherwise") {
  const cell_surface leaning{0.6f, 0.02f, 1}, steep{0.4f, 0.02f, 1}, unknown{1, 0, 0};
  CHECK(is_stem_cell(leaning, {}));
  CHECK_FALSE(is_stem_cell(steep, {}));
  CHECK_FALSE(is_stem_cell(unknown, {}));
  CHECK_FALSE(is_stem_cell(leaning, with_threshold(0.9)));
  CHECK(is_stem_cell(steep, without_constraint()));
  CHECK_FALSE(is_stem_cell(unknown, without_constraint()));
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

}  // namespace globalmatch::test_verticality
