#include "globalmatch/mapping_options.hpp"

#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "catch.hpp"
#include "support/message_of.hpp"

namespace globalmatch::test_mapping_options {

using support::message_of;

namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN(),
                 infinity = std::numeric_limits<double>::infinity();

/// What is said of options after a change.
template <class Change>
std::string message(const Change& change) {
  mapping_options options;
  change(options);
  return message_of([&] { require_valid(options); });
}

/// Checks that a number may lie in [low, high], both included, and nowhere else; `set(options, number)`.
template <class Set>
void require_range(const std::string& name, double low, double high, const Set& set) {
  CAPTURE(name);
  const auto said = [&](double value) { return message([&](mapping_options& o) { set(o, value); }); };
  CHECK(said(low).empty());
  CHECK(said(high).empty());
  for (const double bad :
       {std::nextafter(low, -infinity), std::nextafter(high, infinity), nan, infinity, -infinity})
    CHECK(said(bad).starts_with(name + " must"));
}

}  // namespace

TEST_CASE("the usual mapping options are valid, those of the papers have their values") {
  const mapping_options usual;
  CHECK(message([](mapping_options&) {}).empty());
  CHECK(usual.understory.min_height == 0.2);
  CHECK(usual.understory.max_height == 3.0);
  CHECK(usual.voxel_size == 0.01);
  CHECK(usual.ground.resolution == 0.5);
  CHECK(usual.ground.cloth.time_step == 0.65);
  CHECK(usual.ground.cloth.max_iterations == 500);
}

TEST_CASE("numbers of mapping options lie in their ranges, ends included") {
  require_range("ground.resolution", 0.01, 1000, [](auto& o, double v) { o.ground.resolution = v; });
  require_range("verticality.radius", 1e-3, 100, [](auto& o, double v) { o.verticality.radius = v; });
  require_range("verticality.max_radius", 1e-3, 100, [](auto& o, double v) { o.verticality.max_radius = v; });
  require_range("cylinder.max_tilt_deg", 0, 89, [](auto& o, double v) { o.stems.cylinder.max_tilt_deg = v; });
  require_range("cylinder.distance_tolerance", 1e-6, 10,
                [](auto& o, double v) { o.stems.cylinder.distance_tolerance = v; });
  require_range("stems.column_width", 0.01, 10, [](auto& o, double v) { o.stems.column_width = v; });
  require_range("stems.min_height", 0, 1000, [](auto& o, double v) { o.stems.min_height = v; });
  require_range("stems.min_filled", 0, 1, [](auto& o, double v) { o.stems.min_filled = v; });
  require_range("stems.min_share", 0, 1, [](auto& o, double v) { o.stems.min_share = v; });
  require_range("stems.max_inside", 0, 1, [](auto& o, double v) { o.stems.max_inside = v; });
  require_range("min_quality", 0, 1, [](auto& o, double v) { o.min_quality = v; });
  require_range("voxel_size", 1e-4, 10, [](auto& o, double v) { o.voxel_size = v; });
  require_range("link_distance", 1e-4, 1000, [](auto& o, double v) { o.link_distance = v; });
}

TEST_CASE("numbers that must be positive are refused at zero, and up to their maximum they are not") {
  const auto require_positive = [](const std::string& name, double maximum, const auto& set) {
    CAPTURE(name);
    const auto said = [&](double value) { return message([&](mapping_options& o) { set(o, value); }); };
    CHECK(said(maximum).empty());
    for (const double bad : {0.0, -1.0, std::nextafter(maximum, infinity), nan})
      CHECK(said(bad).starts_with(name + " must"));
  };
  require_positive("ground.cloth.time_step", 1000, [](auto& o, double v) { o.ground.cloth.time_step = v; });
  require_positive("ground.cloth.gravity", 1000, [](auto& o, double v) { o.ground.cloth.gravity = v; });
  require_positive("ground.cloth.slope_step", 1000, [](auto& o, double v) { o.ground.cloth.slope_step = v; });
  require_positive("ground.low_point_depth", 1000, [](auto& o, double v) { o.ground.low_point_depth = v; });
  require_positive("ground.max_slope", 1000, [](auto& o, double v) { o.ground.max_slope = v; });
  require_positive("ground.ground_band", 1000, [](auto& o, double v) { o.ground.ground_band = v; });
  require_positive("ground.hole_radius", 100, [](auto& o, double v) { o.ground.hole_radius = v; });
  constexpr double most = std::numeric_limits<double>::max();
  require_positive("cylinder.taper_weight", most,
                   [](auto& o, double v) { o.stems.cylinder.taper_weight = v; });
  require_positive("stems.max_sigma", most, [](auto& o, double v) { o.stems.max_sigma = v; });
}

TEST_CASE("counts of mapping options have a minimum") {
  const auto require_minimum = [](const std::string& name, int minimum, const auto& set) {
    CAPTURE(name);
    CHECK(message([&](mapping_options& o) { set(o, minimum); }).empty());
    CHECK(message([&](mapping_options& o) { set(o, minimum - 1); }).starts_with(name + " must"));
  };
  require_minimum("ground.cloth.rigidness", 1, [](auto& o, int v) { o.ground.cloth.rigidness = v; });
  require_minimum("ground.cloth.max_iterations", 1,
                  [](auto& o, int v) { o.ground.cloth.max_iterations = v; });
  require_minimum("verticality.min_neighbors", 3, [](auto& o, int v) { o.verticality.min_neighbors = v; });
  require_minimum("cylinder.max_iterations", 1, [](auto& o, int v) { o.stems.cylinder.max_iterations = v; });
  require_minimum("stems.min_points", 6, [](auto& o, int v) { o.stems.min_points = v; });
  CHECK(message([](auto& o) { o.ground.cloth.rigidness = 101; }).starts_with("ground.cloth.rigidness must"));
}

TEST_CASE("options that depend on each other are refused together") {
  const auto first_fall = 0.2 * 0.65 * 0.65;
  CHECK(message([&](auto& o) { o.ground.cloth.convergence_threshold = 0.99 * first_fall; }).empty());
  for (const double bad : {0.0, 1.01 * first_fall, nan})
    CHECK(message([&](auto& o) {
            o.ground.cloth.convergence_threshold = bad;
          }).starts_with("ground.cloth.convergence_threshold must"));
  CHECK(message([](auto& o) { o.understory = {-1, -0.5}; }).empty());
  for (const double bad : {3.0, 3.5, nan})
    CHECK(message([&](auto& o) { o.understory.min_height = bad; }).starts_with("understory.min_height must"));
  CHECK(
      message([](auto& o) { o.stems.cylinder.min_radius = 0.0009; }).starts_with("cylinder.min_radius must"));
  CHECK(message([](auto& o) { o.stems.cylinder.min_radius = 0.6; }).starts_with("cylinder.min_radius must"));
  CHECK(message([](auto& o) { o.stems.cylinder.max_radius = 100; }).empty());
  CHECK(message([](auto& o) { o.stems.cylinder.max_radius = 101; }).starts_with("cylinder.max_radius must"));
  CHECK(message([](auto& o) { o.verticality.threshold = 0; }).empty());
  CHECK(message([](auto& o) { o.verticality.threshold = 1; }).starts_with("verticality.threshold must"));
  CHECK(message([](auto& o) { o.stems.cylinder.usual_taper = -0.01; }).empty());
  for (const double bad : {infinity, nan})
    CHECK(message([&](auto& o) {
            o.stems.cylinder.usual_taper = bad;
          }).starts_with("cylinder.usual_taper must"));
}

}  // namespace globalmatch::test_mapping_options
