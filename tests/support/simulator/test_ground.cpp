#include "support/simulator/terrain.hpp"

#include "bare_plot.hpp"
#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "support/message_of.hpp"
#include "support/simulator/ray_caster.hpp"

#include <algorithm>
#include <cmath>

namespace globalmatch::support::test_ground {
namespace {

using namespace detail;

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr ground_options smooth = {.relief = 0, .hump_height = 0, .roughness = 0};

}  // namespace

TEST_CASE("the height of the ground is where a ray from above hits its mesh") {
  const terrain ground = make_terrain({.slope = 20}, {10, 8}, 1);
  surfaces scene;
  scene.ground = ground.mesh();
  const ray_caster caster(scene);
  random_source random(1);
  double worst = 0;
  for (int i = 0; i < 2000; ++i) {
    const double x = 19.8 * random.uniform() - 9.9, y = 15.8 * random.uniform() - 7.9;
    const hit down = caster.first_hit({{x, y, 20}, -Vector3d::UnitZ()});
    REQUIRE(down.what == surface::ground);
    worst = std::max(worst, std::abs(20 - down.range - ground.height(x, y)));
  }
  CHECK(worst < 1e-4);
}

TEST_CASE("ground rises by its slope, to 35 degrees and more") {
  for (const double slope : {0.0, 15.0, 35.0}) {
    ground_options options = smooth;
    options.slope = slope;
    const terrain ground = make_terrain(options, {10, 10}, 2);
    const Vector2d gradient(ground.height(1, 0) - ground.height(0, 0),
                            ground.height(0, 1) - ground.height(0, 0));
    CHECK(std::atan(gradient.norm()) / degree == Approx(slope).margin(1e-9));
  }
}

TEST_CASE("waves and humps are no higher than asked for, and roughness has its standard deviation") {
  const auto heights = [](const ground_options& options) {
    const terrain ground = make_terrain(options, {30, 30}, 3);
    std::vector<double> all;  // at the nodes of the grid
    for (int i = -60; i <= 60; ++i)
      for (int j = -60; j <= 60; ++j)
        all.push_back(ground.height(i * 2 * terrain::cell, j * 2 * terrain::cell));
    return all;
  };
  for (const bool humps : {false, true}) {
    ground_options options = smooth;
    (humps ? options.hump_height : options.relief) = 0.4;
    const std::vector<double> all = heights(options);
    const auto [lowest, highest] = std::minmax_element(all.begin(), all.end());
    CHECK(*lowest >= -0.4);
    CHECK(*highest <= 0.4);
    CHECK(*highest - *lowest > 0.3);
  }
  ground_options rough = smooth;
  rough.roughness = 0.02;
  double square_sum = 0;
  const std::vector<double> all = heights(rough);
  for (const double height : all) square_sum += height * height;
  CHECK(std::sqrt(square_sum / double(all.size())) == Approx(0.02).epsilon(0.03));
}

TEST_CASE("beyond its rectangle the ground stays as high as at the edge") {
  const terrain ground({5, 5}, [](const Vector2d& place) { return place.x(); });
  CHECK(ground.height(100, 0) == Approx(5));
  CHECK(ground.height(-100, 3) == Approx(-5));
}

TEST_CASE("make_terrain refuses options that make no sense, by name") {
  const std::vector<wrong_option<ground_options>> all = {
      {"ground_options.slope", [](auto& o) { o.slope = 60; }},
      {"ground_options.slope", [](auto& o) { o.slope = std::nan(""); }},
      {"ground_options.relief", [](auto& o) { o.relief = -1; }},
      {"ground_options.wavelength", [](auto& o) { o.wavelength = 0; }},
      {"ground_options.hump_height", [](auto& o) { o.hump_height = 3; }},
      {"ground_options.roughness", [](auto& o) { o.roughness = -0.1; }}};
  for (const auto& [field, spoil] : all) {
    ground_options options;
    spoil(options);
    INFO(field);
    CHECK(message_of([&] { make_terrain(options, {5, 5}, 1); }).starts_with(field));
  }
}

}  // namespace globalmatch::support::test_ground
