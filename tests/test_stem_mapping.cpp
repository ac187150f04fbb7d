#include "globalmatch/stem_mapping.hpp"

#include <algorithm>
#include <filesystem>
#include <set>

#include "catch.hpp"
#include "containers.hpp"
#include "forest_scenes.hpp"
#include "globalmatch/detail/mapping/stem_points.hpp"
#include "globalmatch/evaluation.hpp"
#include "support/message_of.hpp"
#include "support/scan_files.hpp"
#include "support/stem_files.hpp"
#include "support/transform_files.hpp"

namespace globalmatch::test_stem_mapping {

using namespace detail;

using Eigen::Vector3d;
using Eigen::Vector3f;
using support::message_of;

namespace {

/// A plot of 12 m x 12 m with six stems and three shrubs on a slope.
struct plot {
  scenes::slope ground{12, 30};
  std::vector<cylinder> stems;
  scenes::cloud scan;

  explicit plot(std::uint64_t seed) {
    random_source random(seed);
    scan = scenes::ground_points(random, 12, 0.1, 0.005, ground);
    for (const auto& [x, y, radius, lean] : {std::array{2.0, 2.5, 0.10, 0.0},
                                             {9.5, 2.0, 0.15, 3.0},
                                             {6.0, 5.5, 0.25, 0.0},
                                             {2.5, 9.0, 0.08, 8.0},
                                             {9.0, 9.5, 0.12, 2.0},
                                             {5.5, 10.5, 0.18, 5.0}}) {
      stems.push_back(scenes::leaning(x, y, ground(x, y), radius, lean, 100 * x));
      const double arc = scenes::in_range(random, 0.9, 2) * std::numbers::pi;
      scenes::append(scan,
                     scenes::stem_points(random, stems.back(), 2500, {.to = 4, .arc = arc, .noise = 0.003}));
    }
    for (const auto& [x, y] : {std::pair(4.0, 7.0), {10.0, 6.0}, {7.0, 1.5}})
      scenes::append(scan, scenes::shrub_points(random, {x, y, ground(x, y) + 0.8}, 0.7, 1500));
  }

  std::vector<Vector3d> positions() const {
    std::vector<Vector3d> feet;
    for (const cylinder& c : stems) feet.push_back(to_eigen(c.point));
    return feet;
  }
};

std::vector<Vector3d> moved(const scenes::cloud& scan, const Eigen::Isometry3d& transform) {
  std::vector<Vector3d> points;
  for (const Vector3f& p : scan) points.push_back(transform * p.cast<double>());
  return points;
}

/// Checks that a map holds the stems of the plot, under a transform, and no others.
void check_finds(const stem_map& map, const plot& truth,
                 const Eigen::Isometry3d& transform = Eigen::Isometry3d::Identity()) {
  CHECK(map.stems.size() == truth.stems.size());
  for (const cylinder& expected : truth.stems) {
    CAPTURE(to_eigen(expected.point).transpose());
    const Vector3d position = transform * to_eigen(expected.point);
    const auto nearest =
        std::min_element(map.stems.begin(), map.stems.end(), [&](const stem& a, const stem& b) {
          return (a.position - position).norm() < (b.position - position).norm();
        });
    REQUIRE(nearest != map.stems.end());
    CHECK((nearest->position - position).norm() < 0.02);
    CHECK(nearest->radius == Approx(expected.radius).margin(0.01));
    CHECK((nearest->axis - transform.linear() * to_eigen(expected.axis)).norm() < 0.02);
    CHECK(nearest->ground_seen);
  }
}

bool same_bits(const stem& a, const stem& b) {
  return a.position == b.position && a.axis == b.axis && a.radius == b.radius &&
         a.position_sigma == b.position_sigma && a.radius_sigma == b.radius_sigma && a.quality == b.quality &&
         a.ground_seen == b.ground_seen && a.support == b.support;
}

bool same_bits(const stem_map& a, const stem_map& b) {
  return std::equal(a.stems.begin(), a.stems.end(), b.stems.begin(), b.stems.end(),
                    [](const stem& s, const stem& t) { return same_bits(s, t); }) &&
         a.terrain.heights == b.terrain.heights && a.distance_tolerance == b.distance_tolerance &&
         a.spacing_near == b.spacing_near && a.spacing_far == b.spacing_far &&
         a.ground_samples == b.ground_samples && a.stem_samples == b.stem_samples;
}

}  // namespace

TEST_CASE("map_stems finds the stems of a plot within 2 cm and nothing else") {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    CAPTURE(seed);
    const plot truth(seed);
    check_finds(map_stems(truth.scan), truth);
  }
}

TEST_CASE("map_stems finds the stems of a plot without the verticality constraint too") {
  const plot truth(4);
  mapping_options options;
  options.verticality.constraint = false;
  check_finds(map_stems(truth.scan, options), truth);
}

TEST_CASE("map_stems finds the stems where heights are normalized and the ground is gone") {
  plot truth(4);
  std::vector<Vector3d> normalized;
  for (const Vector3f& p : truth.scan) {
    const Vector3d q = p.cast<double>();
    const double height = q.z() - truth.ground(q.x(), q.y());
    if (height > 0.15) normalized.push_back({q.x(), q.y(), height});
  }
  mapping_options options;
  options.ground.filter = ground_filter::normalized;
  const stem_map map = map_stems(normalized, options);
  CHECK(map.stems.size() == truth.stems.size());
  for (const cylinder& expected : truth.stems) {
    const auto nearest =
        std::min_element(map.stems.begin(), map.stems.end(), [&](const stem& a, const stem& b) {
          return (a.position - to_eigen(expected.point)).head<2>().norm() <
                 (b.position - to_eigen(expected.point)).head<2>().norm();
        });
    REQUIRE(nearest != map.stems.end());
    CHECK((nearest->position - to_eigen(expected.point)).head<2>().norm() < 0.04);
    CHECK(std::abs(nearest->position.z()) < 1e-6);
  }
}

TEST_CASE("map_stems by the steps of the paper finds the stems of a plot too") {
  const plot truth(4);
  mapping_options options;
  options.ground.filter = ground_filter::cloth;
  options.rule = stem_point_rule::points;
  check_finds(map_stems(truth.scan, options), truth);
}

TEST_CASE("every container gives the same stem map, bit for bit") {
  const plot truth(5);
  const stem_map expected = map_stems(truth.scan);
  containers::for_each_container(truth.scan, [&](const std::string& kind, const auto& range) {
    CAPTURE(kind);
    CHECK(same_bits(map_stems(range), expected));
  });
}

TEST_CASE("a stem map has the same bits for 1, 2 and 8 threads") {
  const plot truth(6);
  const auto map_with = [&](int threads) {
    return map_stems(truth.scan, {}, Vector3d::UnitZ(), {.threads = threads});
  };
  const stem_map alone = map_with(1);
  for (const int threads : {2, 8}) CHECK(same_bits(map_with(threads), alone));
}

TEST_CASE("the stems of a scan in map coordinates are moved by exactly the shift") {
  const plot truth(7);
  const stem_map here = map_stems(truth.scan);
  const Vector3d shift(500000, 5300000, 1000);
  const stem_map there = map_stems(moved(truth.scan, Eigen::Isometry3d(Eigen::Translation3d(shift))));
  REQUIRE(there.stems.size() == here.stems.size());
  for (std::size_t i = 0; i < here.stems.size(); ++i) {
    CHECK((there.stems[i].position - shift - here.stems[i].position).norm() < 1e-6);
    CHECK(there.stems[i].axis == here.stems[i].axis);
    CHECK(there.stems[i].radius == here.stems[i].radius);
    CHECK((there.stems[i].support == here.stems[i].support));
  }
  CHECK((there.terrain.heights == here.terrain.heights));
  CHECK(there.terrain.frame.origin == here.terrain.frame.origin + detail::vec3::from(shift));
}

TEST_CASE("stems of a turned scan turn along, when up is said") {
  const plot truth(8);
  for (const Vector3d& up : {Vector3d(1, 0, 0), Vector3d(0.3, -0.2, 1), Vector3d(0, 0, -2)}) {
    CAPTURE(up.transpose());
    Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
    transform.linear() = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), up).toRotationMatrix();
    transform.translation() = Vector3d(30, -20, 10);
    const stem_map map = map_stems(moved(truth.scan, transform), {}, up);
    check_finds(map, truth, transform);
    CHECK((map.up - up.normalized()).norm() < 1e-12);
  }
}

TEST_CASE("the vertical of a scan that was not level comes from its stems, unless the given one is wanted") {
  constexpr double degree = std::numbers::pi / 180;
  random_source random(11);
  scenes::cloud scan = scenes::ground_points(random, 14, 0.1, 0.005, [](double, double) { return 0.0; });
  std::vector<Vector3d> feet;
  for (int i = 0; i < 12; ++i) {
    feet.emplace_back(2 + 3.2 * (i % 4), 2.5 + 4 * (i / 4), 0);
    const cylinder c = scenes::leaning(feet[std::size_t(i)].x(), feet[std::size_t(i)].y(), 0, 0.12, 0, 0);
    scenes::append(scan, scenes::stem_points(random, c, 2000, {.to = 4, .noise = 0.003}));
  }
  const auto map_tilted = [&](double angle, vertical_rule rule) {
    CAPTURE(angle);
    const Eigen::Isometry3d tilt(Eigen::AngleAxisd(angle * degree, Vector3d(1, 2, 0).normalized()));
    const stem_map map = map_stems(moved(scan, tilt), {.vertical = rule});
    CHECK(map.given_up == Vector3d::UnitZ());
    REQUIRE(map.stems.size() == feet.size());
    REQUIRE(map.upright);
    CHECK(angle_between(map.upright->up, tilt * Vector3d::UnitZ()) < 0.3 * degree);
    for (const Vector3d& foot : feet)
      CHECK(std::any_of(map.stems.begin(), map.stems.end(),
                        [&](const stem& s) { return (s.position - tilt * foot).norm() < 0.02; }));
    return map;
  };
  for (const double angle : {12.0, 20.0}) {  // the latter is mapped twice
    const stem_map by_stems = map_tilted(angle, vertical_rule::stems_if_tilted);
    CHECK(by_stems.up_by_stems);
    CHECK(by_stems.up == by_stems.upright->up);
    CHECK(is_tilted(by_stems));
    CHECK(describe_tilt(by_stems).find("taken from them") != std::string::npos);
  }
  const stem_map as_given = map_tilted(12, vertical_rule::given);
  CHECK(as_given.up == Vector3d::UnitZ());
  CHECK_FALSE(as_given.up_by_stems);
  CHECK(is_tilted(as_given));
  CHECK(describe_tilt(as_given).find("taken from them") == std::string::npos);

  const stem_map level = map_tilted(0, vertical_rule::stems_if_tilted);
  CHECK(level.up == Vector3d::UnitZ());
  CHECK_FALSE(is_tilted(level));
  const stem_map level_by_stems = map_tilted(0, vertical_rule::stems);
  CHECK(level_by_stems.up_by_stems);
  CHECK(level_by_stems.up == level_by_stems.upright->up);
}

TEST_CASE("stems are ordered by position, and their supports are points of the scan near them") {
  const plot truth(9);
  const stem_map map = map_stems(truth.scan);
  std::set<point_index> seen;
  for (std::size_t i = 0; i < map.stems.size(); ++i) {
    const stem& s = map.stems[i];
    if (i > 0) CHECK(map.stems[i - 1].position.x() <= s.position.x());
    CHECK(s.support.size() > 500);
    CHECK(std::is_sorted(s.support.begin(), s.support.end()));
    CHECK(s.position_sigma > 0);
    CHECK(s.position_sigma < 0.01);
    CHECK(s.radius_sigma > 0);
    CHECK(s.radius_sigma < 0.01);
    CHECK(s.quality > 0.9);
    CHECK(s.quality < 1);
    const cylinder c{detail::vec3::from(Vector3d(s.position + s.axis * breast_height / s.axis.z())),
                     detail::vec3::from(s.axis), s.radius, s.taper};
    double furthest = 0;
    for (const point_index p : s.support) {
      furthest = std::max(furthest, std::abs(c.surface_distance(detail::vec3::from(truth.scan[p]))));
      seen.insert(p);
    }
    CHECK(furthest < map.distance_tolerance + 1e-3);
  }
  std::size_t supports = 0;
  for (const stem& s : map.stems) supports += s.support.size();
  CHECK(seen.size() == supports);
}

TEST_CASE("samples lie on the ground and on the stems, in the frame of the scan") {
  const plot truth(10);
  const stem_map map = map_stems(truth.scan);
  CHECK(map.ground_samples.size() == map.terrain.ground.size());
  CHECK(map.ground_samples.size() > 1500);
  double deepest = 0;
  for (const Vector3d& p : map.ground_samples)
    deepest = std::max(deepest, std::abs(p.z() - truth.ground(p.x(), p.y())));
  CHECK(deepest < 0.5);
  // One in each cell that a stem has points in.
  const double furthest = std::sqrt(3.0) * detail::cell_width + 1e-5;
  std::size_t supports = 0, without_sample = 0;
  for (const stem& s : map.stems)
    for (const point_index i : s.support) {
      ++supports;
      if (i % 16 != 0) continue;
      const Vector3d p = truth.scan[i].cast<double>();
      without_sample += std::none_of(map.stem_samples.begin(), map.stem_samples.end(),
                                     [&](const Vector3d& q) { return (p - q).norm() < furthest; });
    }
  CHECK(without_sample == 0);
  CHECK(map.stem_samples.size() < supports);
  CHECK(map.stem_normals.size() == map.stem_samples.size());
}

TEST_CASE("the funnel counts what each step left") {
  const plot truth(11);
  scenes::cloud scan = truth.scan;
  scan.push_back({std::numeric_limits<float>::quiet_NaN(), 0, 0});
  const stem_map map = map_stems(scan);
  const mapping_funnel& funnel = map.funnel;
  CHECK(funnel.ground.points == scan.size());
  CHECK(funnel.ground.not_finite == 1);
  CHECK(funnel.ground.ground_points == map.terrain.ground.size());
  CHECK(funnel.understory < scan.size());
  CHECK(funnel.thinned <= funnel.understory);
  CHECK(funnel.stem_points < funnel.thinned);
  CHECK(funnel.stem_points > 5000);
  CHECK(funnel.clusters >= 6);
  CHECK(funnel.cylinders >= 6);
  CHECK(funnel.likely <= funnel.cylinders);
  CHECK(funnel.likely >= funnel.stems);
  CHECK(funnel.stems == map.stems.size());
  CHECK(map.spacing_near > 0);
  CHECK(map.spacing_near <= map.spacing_far);
}

TEST_CASE("outliers and points that are not finite do not change the stems found") {
  const plot truth(12);
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  for (const Vector3f& outlier : {Vector3f(1e9f, -1e9f, 1e9f), Vector3f(5, 5, -1e9f), Vector3f(nan, 0, 0)})
    for (const bool first : {true, false}) {
      CAPTURE(outlier.transpose(), first);
      scenes::cloud scan = truth.scan;
      scan.insert(first ? scan.begin() : scan.end(), outlier);
      check_finds(map_stems(scan), truth);
    }
}

TEST_CASE("a scan without stems has an empty map and a funnel that says where they were lost") {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  random_source random(13);
  scenes::cloud line, wall;
  for (int i = 0; i < 500; ++i) line.push_back({0.01f * float(i), 0, 0});
  for (int i = 0; i < 4000; ++i)
    wall.push_back(scenes::exact({scenes::in_range(random, 0, 3), 0, scenes::in_range(random, 0, 3)}));
  const scenes::cloud ground = scenes::ground_points(random, 10, 0.1, 0.01, scenes::slope{20, 0});
  for (const scenes::cloud& scan :
       {scenes::cloud{}, scenes::cloud{{1, 2, 3}}, scenes::cloud(100, Vector3f(1, 2, 3)),
        scenes::cloud(10, Vector3f(nan, 0, 0)), line, wall, ground}) {
    const stem_map map = map_stems(scan);
    CHECK(map.stems.empty());
    CHECK_FALSE(map.cancelled);
    CHECK(map.funnel.ground.points == scan.size());
    CHECK(map.funnel.stems == 0);
  }
}

TEST_CASE("no stem of a map is less likely one than asked for, and an empty map says that this is why") {
  const plot truth(11);
  mapping_options options;
  options.min_quality = 1;
  const stem_map none = map_stems(truth.scan, options);
  CHECK(none.stems.empty());
  CHECK(none.stem_samples.empty());
  CHECK(none.funnel.cylinders >= 6);
  CHECK(none.funnel.likely == 0);
  const std::string reason = detail::where_lost(explain(none.funnel), 1);
  CHECK(reason.starts_with("quality: 0 likely stems of "));
  CHECK(reason.find("min_quality") != std::string::npos);
  options.min_quality = 0.9;
  for (const stem& s : map_stems(truth.scan, options).stems) CHECK(s.quality >= 0.9);
}

TEST_CASE("every stage of the mapping reports, and each can cancel it") {
  const plot truth(14);
  std::vector<std::string> stages;
  // Work between two loops may report an earlier stage again, where it takes long.
  const execution watch{.on_progress = [&](const progress& p) {
    if (std::find(stages.begin(), stages.end(), p.stage) == stages.end()) stages.emplace_back(p.stage);
    return true;
  }};
  map_stems(truth.scan, {}, Vector3d::UnitZ(), watch);
  CHECK(stages == std::vector<std::string>{"ground", "understory", "cells", "verticality", "clusters",
                                           "noise", "cylinders", "stem positions", "samples"});
  for (const std::string& stage : stages) {
    CAPTURE(stage);
    const execution cancel{.threads = 1, .on_progress = [&](const progress& p) { return p.stage != stage; }};
    const stem_map map = map_stems(truth.scan, {}, Vector3d::UnitZ(), cancel);
    CHECK(map.cancelled);
    CHECK(map.stems.empty());
    CHECK(map.terrain.empty());
  }
}

TEST_CASE("map_stems refuses bad arguments by name") {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const scenes::cloud nothing;
  const auto message = [&](const auto& spoil) {
    mapping_options options;
    spoil(options);
    return message_of([&] { map_stems(nothing, options); });
  };
  CHECK(message([](mapping_options&) {}).empty());
  for (const double bad : {0.0, -1.0, nan, 1e-12, std::numeric_limits<double>::infinity()}) {
    CHECK(message([&](auto& o) { o.voxel_size = bad; }).starts_with("voxel_size"));
    CHECK(message([&](auto& o) { o.link_distance = bad; }).starts_with("link_distance"));
    CHECK(message([&](auto& o) { o.verticality.radius = bad; }).starts_with("verticality.radius"));
    CHECK(message([&](auto& o) { o.stems.column_width = bad; }).starts_with("stems.column_width"));
  }
  CHECK(message([](auto& o) { o.understory.min_height = 3; }).starts_with("understory.min_height"));
  CHECK(message([](auto& o) { o.stems.cylinder.max_iterations = 0; }).find("cylinder.max_iterations") !=
        std::string::npos);
  for (const Vector3d& up : {Vector3d(0, 0, 0), Vector3d(nan, 0, 1)})
    CHECK(message_of([&] { map_stems(nothing, {}, up); }).starts_with("up must be"));
  CHECK(message_of([&] {
          map_stems(nothing, {}, Vector3d::UnitZ(), {.threads = -1});
        }).starts_with("execution.threads"));
}

TEST_CASE("a link distance that is given joins or parts stems") {
  const plot truth(15);
  mapping_options options;
  options.rule = stem_point_rule::points;
  options.link_distance = 0.05;
  const std::size_t parted = map_stems(truth.scan, options).funnel.clusters;
  options.link_distance = 10;
  const stem_map joined = map_stems(truth.scan, options);
  CHECK(joined.funnel.clusters == 1);
  CHECK(parted >= 6);
  check_finds(joined, truth);
}

namespace {

std::filesystem::path clouds() {
  return std::filesystem::path(GLOBALMATCH_SHARED_DATA) / "clouds";
}

/// Scores the stems found in both halves of a real pair against those that a person found in the whole cloud,
/// by circles at breast height: there the places are compared, since stems lean by up to 20 degrees.
void check_real_pair(const std::string& plot_name, const std::string& pair, std::size_t min_found) {
  if (!std::filesystem::exists(clouds())) {
    WARN("skipped: no real scans in " << clouds());
    return;
  }
  const auto truth = support::read_stems(clouds() / (plot_name + "_stems.csv")).stems;
  const auto prefix = plot_name + "_" + pair;
  const Eigen::Isometry3d target_from_source = support::read_transform(clouds() / (prefix + "_gt.txt"));
  for (const bool is_source : {true, false}) {
    CAPTURE(prefix, is_source);
    const auto scan = support::open_scan(clouds() / (prefix + (is_source ? "_src.ply" : "_tgt.ply")));
    const stem_map map = map_stems(scan);
    std::vector<Vector3d> finds;
    for (const stem& s : map.stems) {
      const Vector3d at_breast_height = s.position + breast_height / s.axis.z() * s.axis;
      finds.push_back(is_source ? target_from_source * at_breast_height : at_breast_height);
    }
    const map_score score = score_map(finds, truth, 0.25);
    CHECK(score.true_finds >= min_found);
    CHECK(score.found - score.true_finds <= 1);
  }
}

}  // namespace

TEST_CASE("15 of 16 real pines are found in each half, and at most one stem that is none", "[slow]") {
  check_real_pair("pine_plot", "interleaved", 15);
  check_real_pair("pine_plot", "virtualscans", 15);
}

TEST_CASE("28 of 30 real conifers are found in each half, and at most one stem that is none", "[slow]") {
  check_real_pair("dense_conifers", "interleaved", 28);
  check_real_pair("dense_conifers", "virtualscans", 28);
}

TEST_CASE("an up of any length is made a unit vector") {
  const scenes::cloud nothing;
  for (const double length : {1e-200, 1e-3, 1e200}) {
    const stem_map map = map_stems(nothing, {}, length * Vector3d(3, 0, 4));
    CHECK((map.up - Vector3d(0.6, 0, 0.8)).norm() < 1e-15);
    CHECK((map.given_up - Vector3d(0.6, 0, 0.8)).norm() < 1e-15);
  }
}

}  // namespace globalmatch::test_stem_mapping
