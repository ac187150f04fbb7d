#include "globalmatch/detail/mapping/cell_sorter.hpp"
#include "globalmatch/detail/mapping/stem_cylinders.hpp"
#include "globalmatch/detail/published/point_verticality.hpp"
#include "globalmatch/detail/published/stem_points_by_points.hpp"

#include "catch.hpp"
#include "forest_scenes.hpp"
#include "support/message_of.hpp"

namespace globalmatch::test_stem_cylinders {

using namespace detail;

using Eigen::Vector3d;
using scenes::cloud;
using scenes::leaning;
using scenes::upright;
using support::message_of;

namespace {

/// Points in cells, all in one cluster.
struct one_cluster {
  cell_columns cells;
  point_clusters clusters;

  explicit one_cluster(const cloud& scan) : cells(sort_into_cells(scenes::as_local(scan), 0.05)) {
    for (point_index i = 0; i < cells.points().size(); ++i) clusters.members.push_back(i);
    clusters.first.push_back(cells.points().size());
  }

  stem_cylinders find(const stem_cylinder_options& options = {}, const execution& exec = {}) const {
    return find_stem_cylinders(cells, clusters, {&fit_along_line}, options, exec);
  }
  stem_cylinders find_by_normals(const stem_cylinder_options& options = {}) const {
    std::vector<vec3f> normals;
    for (const local_surface& s : estimate_surfaces(cells.points())) normals.push_back(s.normal);
    return find_stem_cylinders(cells, clusters, {&fit_by_normals, normals}, options);
  }
};

/// What a scanner sees of a stem from one side.
scenes::seen_surface one_side(double noise) {
  return {.arc = std::numbers::pi, .noise = noise};
}

double horizontal_error(const cylinder& truth, const cylinder& found) {
  return (truth.at_height(1.5) - found.at_height(1.5)).xy().norm();
}

/// The smallest horizontal distance at 1.5 m of any stem found from the true one.
double horizontal_error(const cylinder& truth, const stem_cylinders& found) {
  double least = 1e9;
  for (const stem_cylinder& s : found.stems) least = std::min(least, horizontal_error(truth, s.cylinder));
  return least;
}

bool same_bits(const stem_cylinders& a, const stem_cylinders& b) {
  return a.distance_tolerance == b.distance_tolerance &&
         std::equal(a.stems.begin(), a.stems.end(), b.stems.begin(), b.stems.end(),
                    [](const stem_cylinder& s, const stem_cylinder& t) {
                      return s.cylinder.point == t.cylinder.point && s.cylinder.axis == t.cylinder.axis &&
                             s.cylinder.radius == t.cylinder.radius && s.support == t.support &&
                             s.rms == t.rms && s.covariance.numbers == t.covariance.numbers;
                    });
}

}  // namespace

TEST_CASE("one stem in a cluster is found to 2 mm, with its evidence") {
  random_source random(1);
  for (const cylinder& truth :
       {upright(0, 0, 0, 0.08), upright(4, 5, 0, 0.25), leaning(-3, 2, 0, 0.15, 15, 130)}) {
    CAPTURE(truth.radius);
    const one_cluster scene(scenes::stem_points(random, truth, 1500, one_side(0.003)));
    for (const stem_cylinders& found : {scene.find(), scene.find_by_normals()}) {
      REQUIRE(found.stems.size() == 1);
      const stem_cylinder& stem = found.stems[0];
      CHECK(horizontal_error(truth, stem.cylinder) < 0.002);
      CHECK(stem.cylinder.radius == Approx(truth.radius).margin(0.002));
      CHECK(stem.support.size() > 1450);
      CHECK(std::is_sorted(stem.support.begin(), stem.support.end()));
      CHECK(stem.filled_height == Approx(3).margin(0.15));
      CHECK(stem.rms == Approx(0.003).epsilon(0.2));
      CHECK(axis_uncertainty(stem.covariance) < 0.002);
    }
  }
}

TEST_CASE("two stems in one cluster are both found") {
  random_source random(2);
  for (const double distance : {0.3, 0.5, 1.0}) {
    CAPTURE(distance);
    const cylinder first = upright(0, 0, 0, 0.1), second = upright(distance, 0.05, 0, 0.08);
    cloud scan = scenes::stem_points(random, first, 1500, {.noise = 0.003});
    scenes::append(scan, scenes::stem_points(random, second, 1000, {.noise = 0.003}));
    const stem_cylinders found = one_cluster(scan).find();
    CHECK(found.stems.size() == 2);
    CHECK(horizontal_error(first, found) < 0.003);
    CHECK(horizontal_error(second, found) < 0.003);
  }
}

TEST_CASE("a stem joined by branches to a shrub is found") {
  random_source random(3);
  const cylinder truth = upright(0, 0, 0, 0.12);
  cloud scan = scenes::stem_points(random, truth, 1500, {.noise = 0.003});
  scenes::append(scan, scenes::shrub_points(random, {1, 0, 0.6}, 0.5, 800));
  for (int i = 0; i < 60; ++i) scan.push_back(scenes::exact({0.12 + 0.015 * i, 0, 1.2 - 0.01 * i}));
  const stem_cylinders found = one_cluster(scan).find();
  REQUIRE(found.stems.size() == 1);
  CHECK(horizontal_error(truth, found) < 0.003);
}

TEST_CASE("shrubs are hardly ever stems") {
  int stems = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    random_source random(seed);
    const double radius = scenes::in_range(random, 0.5, 1.5);
    stems += !one_cluster(scenes::shrub_points(random, {0, 0, radius}, radius, 3000)).find().stems.empty();
  }
  CHECK(stems <= 2);
}

TEST_CASE("walls, wires and the ground are no stems") {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    CAPTURE(seed);
    random_source random(seed);
    cloud wall, wire, ground;
    for (int i = 0; i < 3000; ++i) {
      const double u = scenes::in_range(random, 0, 3), v = scenes::in_range(random, 0, 3);
      wall.push_back(scenes::exact({u, 0.003 * random.normal(), v}));
      wire.push_back(scenes::exact({u, 0.01 * random.normal(), 2}));
      ground.push_back(scenes::exact({u, v, 0.01 * random.normal()}));
    }
    for (const cloud& scan : {wall, wire, ground}) CHECK(one_cluster(scan).find().stems.empty());
  }
}

TEST_CASE("what is too low, too thinly filled, or seen too little around is no stem, as the options say") {
  random_source random(4);
  const cylinder truth = upright(0, 0, 0, 0.1);
  const one_cluster low(scenes::stem_points(random, truth, 1000, {.to = 1.2, .noise = 0.003}));
  CHECK(low.find().stems.size() == 1);
  stem_cylinder_options options;
  options.min_height = 1.4;
  CHECK(low.find(options).stems.empty());
  const one_cluster stump(scenes::stem_points(random, truth, 1000, {.to = 0.6, .noise = 0.003}));
  CHECK(stump.find().stems.empty());

  const one_cluster sliver(scenes::stem_points(random, truth, 300, {.arc = 0.5, .noise = 0.005}));
  CHECK(sliver.find().stems.empty());

  const one_cluster few(scenes::stem_points(random, truth, 300, {.noise = 0.002}));
  CHECK(few.find().stems.size() == 1);
  options = {};
  options.min_points = 301;
  CHECK(few.find(options).stems.empty());
}

TEST_CASE("limits of the cylinder are respected") {
  random_source random(5);
  const one_cluster thick(scenes::stem_points(random, upright(0, 0, 0, 0.3), 2000, {.noise = 0.002}));
  const one_cluster lean(scenes::stem_points(random, leaning(0, 0, 0, 0.1, 15, 0), 2000, {.noise = 0.002}));
  CHECK(thick.find().stems.size() == 1);
  CHECK(lean.find().stems.size() == 1);
  stem_cylinder_options options;
  options.cylinder.max_radius = 0.25;
  for (const stem_cylinder& s : thick.find(options).stems) CHECK(s.cylinder.radius <= 0.25);
  options = {};
  options.cylinder.max_tilt_deg = 5;
  for (const stem_cylinder& s : lean.find(options).stems)
    CHECK(s.cylinder.axis.z >= std::cos(5 * std::numbers::pi / 180));
}

TEST_CASE("the distance tolerance comes from the noise of the stems, within 1 cm and 4 cm") {
  const auto threshold_at = [](double noise) {
    random_source random(6);
    return one_cluster(scenes::stem_points(random, upright(0, 0, 0, 0.15), 2000, {.noise = noise}))
        .find()
        .distance_tolerance;
  };
  CHECK(threshold_at(0.0005) == 0.01);
  CHECK(threshold_at(0.005) == Approx(0.015).epsilon(0.1));
  CHECK(threshold_at(0.008) == Approx(0.024).epsilon(0.1));
}

TEST_CASE("a distance tolerance that is given is the one used, and without stems it is the default") {
  random_source random(7);
  const one_cluster scene(scenes::stem_points(random, upright(0, 0, 0, 0.15), 1000, {.noise = 0.003}));
  stem_cylinder_options options;
  options.cylinder.distance_tolerance = 0.017;
  CHECK(scene.find(options).distance_tolerance == 0.017);
  CHECK(scene.find(options).stems.size() == 1);
  cloud ground;
  for (int i = 0; i < 500; ++i)
    ground.push_back(scenes::exact({scenes::in_range(random, 0, 3), scenes::in_range(random, 0, 3), 0}));
  CHECK(one_cluster(ground).find().distance_tolerance == default_distance_tolerance);
}

TEST_CASE("stems have the same bits for 1, 2 and 8 threads, and for the same seed") {
  random_source random(8);
  cloud scan;
  point_clusters clusters;
  for (int i = 0; i < 12; ++i) {
    const cylinder c = leaning(2 * i, 0, 0, 0.05 + 0.02 * i, i, 30 * i);
    scenes::append(scan, scenes::stem_points(random, c, 400, one_side(0.003)));
  }
  const cell_columns cells = sort_into_cells(scenes::as_local(scan), 0.05);
  clusters = cluster_cells(cells, estimate_surfaces(cells), {}, 15);
  const auto find = [&](int threads) {
    return find_stem_cylinders(cells, clusters, {&fit_along_line}, {}, {.threads = threads});
  };
  const stem_cylinders alone = find(1);
  CHECK(alone.stems.size() == 12);
  for (const int threads : {1, 2, 8}) CHECK(same_bits(alone, find(threads)));
}

TEST_CASE("degenerate clusters hold no stems") {
  cloud pole;
  for (int i = 0; i < 300; ++i) pole.push_back({1, 2, 0.01f * float(i)});
  for (const cloud& scan : {cloud{}, cloud{{1, 2, 3}}, cloud(100, Eigen::Vector3f(1, 2, 3)), pole})
    CHECK(one_cluster(scan).find().stems.empty());
  CHECK(find_stem_cylinders({}, {}).stems.empty());
}

TEST_CASE("bad stem options are refused by name") {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const auto message = [](const auto& spoil) {
    stem_cylinder_options options;
    spoil(options);
    return message_of([&] { find_stem_cylinders({}, {}, {&fit_along_line}, options); });
  };
  CHECK(message([](stem_cylinder_options&) {}).empty());
  CHECK(message([](auto& o) { o.cylinder.max_iterations = 0; }).starts_with("cylinder.max_iterations"));
  for (const double bad : {0.0, -1.0, nan}) {
    CHECK(message([&](auto& o) { o.column_width = bad; }).starts_with("stems.column_width"));
    CHECK(message([&](auto& o) { o.max_sigma = bad; }).starts_with("stems.max_sigma"));
  }
  for (const double bad : {-1.0, nan})
    CHECK(message([&](auto& o) { o.min_height = bad; }).starts_with("stems.min_height"));
  for (const double bad : {-0.1, 1.1, nan}) {
    CHECK(message([&](auto& o) { o.min_filled = bad; }).starts_with("stems.min_filled"));
    CHECK(message([&](auto& o) { o.min_share = bad; }).find("min_share") != std::string::npos);
    CHECK(message([&](auto& o) { o.max_inside = bad; }).find("max_inside") != std::string::npos);
  }
  CHECK(message([](auto& o) { o.min_points = 5; }).starts_with("stems.min_points"));
}

TEST_CASE("normals that are not one for each point are refused") {
  random_source random(9);
  const one_cluster scene(scenes::stem_points(random, upright(0, 0, 0, 0.1), 100, {}));
  const std::vector<vec3f> too_few(99);
  CHECK(message_of([&] {
          find_stem_cylinders(scene.cells, scene.clusters, {&fit_by_normals, too_few});
        }).starts_with("normals"));
}

TEST_CASE("finding stems reports its stage and can be cancelled") {
  random_source random(10);
  const one_cluster scene(scenes::stem_points(random, upright(0, 0, 0, 0.1), 100, {}));
  const execution exec{.threads = 1, .on_progress = [](const progress& p) { return p.stage != "cylinders"; }};
  CHECK_THROWS_AS(scene.find({}, exec), operation_cancelled);
}

}  // namespace globalmatch::test_stem_cylinders
