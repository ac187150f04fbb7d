#include "support/simulator/trees.hpp"

#include "bare_plot.hpp"
#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "support/message_of.hpp"
#include "support/simulator/ray_caster.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace globalmatch::support::test_trees {
namespace {

using namespace detail;

using Eigen::Vector3d;

std::vector<stem> many_stems(const tree_options& options) {
  random_source random(1);
  std::vector<stem> stems;
  for (int i = 0; i < 4000; ++i) stems.push_back(random_stem(options, Vector3d::Zero(), random));
  return stems;
}

double lean_in_degrees(const stem& s) {
  return std::atan(s.lean.norm()) / degree;
}

/// Radii of a stem around its axis at a height, as level rays from outside measure them.
std::vector<double> radii_at(const stem& s, const tree_options& options, double height) {
  surfaces scene;
  random_source random(5);
  add_stem(scene, s, 7, options, random);
  const ray_caster caster(scene);
  std::vector<double> radii;
  const Vector3d middle = s.axis_at(height);
  for (double azimuth = 0; azimuth < 360; azimuth += 3) {
    const Vector3d outward(std::cos(azimuth * degree), std::sin(azimuth * degree), 0);
    const hit nearest = caster.first_hit({middle + 3 * outward, -outward});
    REQUIRE(nearest.stem == 7);
    radii.push_back(3 - nearest.range);
  }
  return radii;
}

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / double(values.size());
}

}  // namespace

TEST_CASE("diameters are the minimum plus a Weibull variable, up to the maximum") {
  tree_options options;
  double sum = 0, thickest = 0, thinnest = 10;
  for (const stem& s : many_stems(options)) {
    sum += s.dbh;
    thickest = std::max(thickest, s.dbh);
    thinnest = std::min(thinnest, s.dbh);
  }
  CHECK(sum / 4000 == Approx(0.05 + 0.19 * std::tgamma(1 + 1 / 2.5)).epsilon(0.02));
  CHECK(thinnest >= 0.05);
  CHECK(thinnest < 0.08);
  options.dbh_max = 0.3;
  const auto stems = many_stems(options);
  CHECK(std::all_of(stems.begin(), stems.end(), [](const stem& s) { return s.dbh <= 0.3; }));
  CHECK(thickest > 0.4);
}

TEST_CASE("half of the stems lean more than the median asked for, and none twice as much") {
  tree_options options;
  options.lean = 12;
  const auto stems = many_stems(options);
  const auto beyond =
      std::count_if(stems.begin(), stems.end(), [](const stem& s) { return lean_in_degrees(s) > 12; });
  CHECK(double(beyond) / 4000 == Approx(0.5).margin(0.03));
  CHECK(std::all_of(stems.begin(), stems.end(), [](const stem& s) { return lean_in_degrees(s) <= 24.001; }));
}

TEST_CASE("the axis starts at the position, leans and bows") {
  stem s;
  s.position = {1, 2, 3};
  s.height = 20;
  s.lean = {0.1, 0};
  s.sweep = {0, 0.3};
  CHECK(s.axis_at(0) == s.position);
  CHECK((s.axis_at(10) - Vector3d(2, 2.3, 13)).norm() < 1e-12);
  CHECK((s.axis_at(20) - Vector3d(3, 2, 23)).norm() < 1e-12);
}

TEST_CASE("a stem has its diameter at breast height, is wider at its base and thinner above") {
  tree_options options;
  stem s;
  s.dbh = 0.3;
  s.height = 18;
  s.lean = {0.02, 0.03};
  CHECK(mean(radii_at(s, options, 1.3)) == Approx(0.15).epsilon(0.02));
  CHECK(mean(radii_at(s, options, 0.1)) > 1.15 * 0.15);
  CHECK(mean(radii_at(s, options, 9)) < 0.7 * 0.15);
  options.flare = 0;
  CHECK(mean(radii_at(s, options, 0.1)) < 1.1 * 0.15);
}

TEST_CASE("bark is relief of millimetres, and none when it is not asked for") {
  tree_options options;
  stem s;
  s.dbh = 0.3;
  const auto roughness = [&] {
    const auto radii = radii_at(s, options, 1.3);
    double square_sum = 0;
    for (const double r : radii) square_sum += std::pow(r - mean(radii), 2);
    return std::sqrt(square_sum / double(radii.size()));
  };
  CHECK(roughness() > 0.0015);
  CHECK(roughness() < 0.006);
  options.bark = 0;
  CHECK(roughness() < 0.0005);  // the polygon's
}

TEST_CASE("forks are as frequent as asked for, above breast height, and part from the stem") {
  tree_options options;
  options.forked = 0.25;
  const auto stems = many_stems(options);
  const auto forks = [](const stem& s) { return s.fork_height > 0; };
  CHECK(double(std::count_if(stems.begin(), stems.end(), forks)) / 4000 == Approx(0.25).margin(0.02));
  stem s = *std::find_if(stems.begin(), stems.end(), forks);
  CHECK(s.fork_height >= 1.6);
  surfaces forked, plain;
  random_source one(1), other(1);
  add_stem(forked, s, 0, options, one);
  s.fork_height = 0;
  add_stem(plain, s, 0, options, other);
  CHECK(double(forked.stems.quads.size()) > 1.3 * double(plain.stems.quads.size()));
  CHECK(forked.stem_of_quad.size() == forked.stems.quads.size());
}

TEST_CASE("a crown is branches and leaves above its base, with dead branches below") {
  tree_options options;
  stem s;
  s.height = 16;
  surfaces scene;
  random_source random(2);
  add_crown(scene, s, options, random);
  CHECK(scene.curves.size() == 2 * (options.branches + options.dead_branches));
  CHECK(scene.discs.size() == options.leaves / options.branches * options.branches);
  const auto high = std::count_if(scene.discs.begin(), scene.discs.end(),
                                  [](const Eigen::Vector4f& disc) { return disc.z() > 0.4f * 16; });
  CHECK(double(high) > 0.97 * double(scene.discs.size()));
  options.branches = options.leaves = options.dead_branches = 0;
  surfaces none;
  add_crown(none, s, options, random);
  CHECK(none.curves.empty());
  CHECK(none.discs.empty());
}

TEST_CASE("tree options that make no sense are refused by name") {
  const std::vector<wrong_option<tree_options>> all = {
      {"tree_options.dbh_min", [](auto& o) { o.dbh_min = 0; }},
      {"tree_options.dbh_scale", [](auto& o) { o.dbh_scale = -1; }},
      {"tree_options.dbh_shape", [](auto& o) { o.dbh_shape = 0; }},
      {"tree_options.dbh_max", [](auto& o) { o.dbh_max = 0.01; }},
      {"tree_options.height", [](auto& o) { o.height = std::nan(""); }},
      {"tree_options.lean", [](auto& o) { o.lean = 50; }},
      {"tree_options.common_lean", [](auto& o) { o.common_lean = -1; }},
      {"tree_options.sweep", [](auto& o) { o.sweep = -1; }},
      {"tree_options.flare", [](auto& o) { o.flare = -1; }},
      {"tree_options.bark", [](auto& o) { o.bark = 1; }},
      {"tree_options.pairs", [](auto& o) { o.pairs = 2; }},
      {"tree_options.multi_stem", [](auto& o) { o.multi_stem = -1; }},
      {"tree_options.forked", [](auto& o) { o.forked = 1.1; }},
      {"tree_options.crown_base", [](auto& o) { o.crown_base = 1; }},
      {"tree_options.crown_radius", [](auto& o) { o.crown_radius = -1; }},
      {"tree_options.branches", [](auto& o) { o.branches = 1000000; }},
      {"tree_options.leaves", [](auto& o) { o.leaves = 1000000; }},
      {"tree_options.leaf_radius", [](auto& o) { o.leaf_radius = 0; }},
      {"tree_options.dead_branches", [](auto& o) { o.dead_branches = 1000000; }}};
  for (const auto& [field, spoil] : all) {
    tree_options options;
    spoil(options);
    INFO(field);
    CHECK(message_of([&] { require_valid(options); }).starts_with(field));
  }
}

}  // namespace globalmatch::support::test_trees
