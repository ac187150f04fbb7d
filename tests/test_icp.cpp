#include "globalmatch/icp.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "catch.hpp"
#include "position_types.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_icp {

using namespace detail;

using scenes::positions;

namespace {

using scenes::four;
using scenes::six;

/// Rolling ground and ten stems, with other samples for each seed.
positions surface(std::uint64_t seed) {
  const auto ground = [](double x, double y) { return 0.6 * std::sin(x / 1.5) + 0.4 * std::cos(y / 1.2); };
  positions points;
  random_source samples(seed), places(1);
  for (int i = 0; i < 3000; ++i) {
    const double x = scenes::uniform(samples, 0, 6), y = scenes::uniform(samples, 0, 6);
    points.push_back({x, y, ground(x, y)});
  }
  for (int stem = 0; stem < 10; ++stem) {
    const double x = scenes::uniform(places, 0.5, 5.5), y = scenes::uniform(places, 0.5, 5.5), radius = 0.15;
    for (int i = 0; i < 300; ++i) {
      const double angle = scenes::uniform(samples, 0, 2 * std::numbers::pi),
                   z = scenes::uniform(samples, 0.2, 2);
      points.push_back({x + radius * std::cos(angle), y + radius * std::sin(angle), ground(x, y) + z});
    }
  }
  return points;
}

Eigen::Isometry3d ten_centimetres_two_degrees_off(const Eigen::Isometry3d& truth, degrees_of_freedom dof) {
  const Eigen::Vector3d axis = dof == four ? Eigen::Vector3d(0, 0, 1) : Eigen::Vector3d(0.3, -0.4, 0.8);
  const Eigen::AngleAxisd turn(2 * std::numbers::pi / 180, axis.normalized());
  const Eigen::Vector3d center(3, 3, 0), shift(0.07, -0.06, 0.04);
  return truth * Eigen::Translation3d(center + shift) * turn * Eigen::Translation3d(-center);
}

}  // namespace

TEST_CASE("icp brings ground and stems from 10 cm and 2 degrees off to 1 mm, both metrics") {
  const Eigen::Isometry3d truth = scenes::yaw_and_shift(0.8, {4, -2, 1});
  const positions source = surface(1), target = scenes::moved(truth, surface(1));
  for (const auto metric : {icp_metric::point_to_point, icp_metric::point_to_plane})
    for (const auto dof : {four, six}) {
      INFO("metric " << int(metric) << ", dof " << int(dof));
      const auto coarse = ten_centimetres_two_degrees_off(truth, dof);
      const icp_result result = refine_by_icp(source, target, coarse, dof, {.metric = metric});
      CHECK(result.converged);
      CHECK(result.iterations > 1);
      CHECK(result.pairs > source.size() / 2);
      CHECK(result.rms < 0.001);
      CHECK(scenes::max_error(result.target_from_source, truth, source) < 0.001);
    }
}

TEST_CASE("icp by planes aligns different samples of one surface to 5 mm") {
  const Eigen::Isometry3d truth = scenes::yaw_and_shift(0.8, {4, -2, 1});
  const positions source = surface(2), target = scenes::moved(truth, surface(1));
  const auto coarse = ten_centimetres_two_degrees_off(truth, four);
  const icp_result result =
      refine_by_icp(source, target, coarse, four, {.metric = icp_metric::point_to_plane});
  CHECK(result.converged);
  CHECK(scenes::max_error(result.target_from_source, truth, source) < 0.005);
}

TEST_CASE("icp by planes is not lifted by what stands on the ground in one scan alone") {
  const Eigen::Isometry3d truth = scenes::yaw_and_shift(0.8, {4, -2, 1});
  positions source = surface(2);
  random_source grass(3);
  for (std::size_t i = 0; i < 3000; i += 5) source[i].z() += scenes::uniform(grass, 0.03, 0.15);
  const positions target = scenes::moved(truth, surface(1));
  const auto coarse = ten_centimetres_two_degrees_off(truth, four);
  const icp_result result =
      refine_by_icp(source, target, coarse, four, {.metric = icp_metric::point_to_plane});
  CHECK(result.converged);
  CHECK(std::abs((result.target_from_source.translation() - truth.translation()).z()) < 0.002);
}

TEST_CASE("icp without a metric returns the coarse transform as it is") {
  const positions points = surface(1);
  const auto coarse = ten_centimetres_two_degrees_off(scenes::yaw_and_shift(1, {1, 2, 3}), six);
  const icp_result result = refine_by_icp(points, points, coarse, four, {.metric = icp_metric::none});
  CHECK(result.target_from_source.matrix() == coarse.matrix());
  CHECK_FALSE(result.converged);
  CHECK(result.iterations == 0);
}

TEST_CASE("icp with too few pairs has not converged and leaves the coarse transform") {
  const positions points = surface(1), five(points.begin(), points.begin() + 5);
  const Eigen::Isometry3d near = scenes::yaw_and_shift(0.01, {0, 0, 0}),
                          far = scenes::yaw_and_shift(0, {500, 0, 0});
  for (const auto metric : {icp_metric::point_to_point, icp_metric::point_to_plane}) {
    const icp_options options{.metric = metric};
    for (const auto& [source, target, coarse] :
         {std::tuple(positions{}, positions{}, near), std::tuple(five, points, near),
          std::tuple(points, positions{}, near), std::tuple(points, points, far)}) {
      const icp_result result = refine_by_icp(source, target, coarse, four, options);
      CHECK_FALSE(result.converged);
      CHECK(result.pairs == 0);
      CHECK(result.target_from_source.matrix() == coarse.matrix());
    }
  }
}

TEST_CASE("icp with points at one place has not converged and stays finite") {
  const positions pile(10, Eigen::Vector3d(1, 2, 3));
  for (const auto metric : {icp_metric::point_to_point, icp_metric::point_to_plane}) {
    const icp_result result =
        refine_by_icp(pile, pile, Eigen::Isometry3d::Identity(), four, {.metric = metric});
    CHECK(result.target_from_source.matrix().allFinite());
    CHECK(scenes::max_error(result.target_from_source, Eigen::Isometry3d::Identity(), pile) < 0.3);
  }
}

TEST_CASE("icp by planes does not claim to have converged where it slides on a plane") {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    INFO("seed " << seed);
    random_source random(seed);
    positions source, target;
    for (auto* plane : {&source, &target})
      for (int i = 0; i < 400; ++i)
        plane->push_back(
            {scenes::uniform(random, 0, 10), scenes::uniform(random, 0, 10), 0.002 * random.normal()});
    const icp_result result = refine_by_icp(source, target, scenes::yaw_and_shift(0, {0, 0, 0.1}), four,
                                            {.metric = icp_metric::point_to_plane});
    CHECK_FALSE(result.converged);
  }
}

TEST_CASE("4-DoF icp keeps the z axis, also for tilted samples") {
  const positions source = surface(1);
  const Eigen::Isometry3d tilt(Eigen::AngleAxisd(0.02, Eigen::Vector3d(1, 0, 0)));
  const positions target = scenes::moved(tilt, surface(1));
  for (const auto metric : {icp_metric::point_to_point, icp_metric::point_to_plane}) {
    const icp_result result =
        refine_by_icp(source, target, scenes::yaw_and_shift(0.02, {0.03, 0, 0}), four, {.metric = metric});
    CHECK(result.iterations > 0);
    CHECK((result.target_from_source.linear() * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitZ()).norm() <
          1e-12);
  }
}

TEST_CASE("icp takes points of any type and gives the same bits for any number of threads") {
  const positions source = surface(1),
                  target = scenes::moved(scenes::yaw_and_shift(0.01, {0.05, 0.02, 0}), source);
  const Eigen::Isometry3d coarse = Eigen::Isometry3d::Identity();
  const icp_result expected = refine_by_icp(source, target, coarse, four, {}, {.threads = 1});
  for (const int threads : {2, 8}) {
    const icp_result result = refine_by_icp(source, target, coarse, four, {}, {.threads = threads});
    CHECK(result.target_from_source.matrix() == expected.target_from_source.matrix());
    CHECK(result.rms == expected.rms);
  }
  scenes::for_each_type_with_heights(source, [&](const char* name, const auto& range) {
    INFO(name);
    const icp_result result = refine_by_icp(range, target, coarse, four);
    CHECK(result.target_from_source.matrix() == expected.target_from_source.matrix());
  });
}

TEST_CASE("icp is as right far from the origin as near it") {
  const Eigen::Isometry3d far_away = scenes::yaw_and_shift(0, {500000, 5300000, 1000});
  const positions source = scenes::moved(far_away, surface(1));
  const Eigen::Isometry3d off = ten_centimetres_two_degrees_off(Eigen::Isometry3d::Identity(), four);
  for (const auto metric : {icp_metric::point_to_point, icp_metric::point_to_plane}) {
    const icp_result result =
        refine_by_icp(source, source, far_away * off * far_away.inverse(), four, {.metric = metric});
    CHECK(result.converged);
    CHECK(scenes::max_error(result.target_from_source, Eigen::Isometry3d::Identity(), source) < 0.001);
  }
}

TEST_CASE("icp uses no more source points than asked for") {
  const positions points = surface(1);
  REQUIRE(points.size() > 1000);
  for (const std::size_t most : {std::size_t(100), std::size_t(1000), points.size()}) {
    icp_options options;
    options.max_points = most;
    const icp_result result = refine_by_icp(points, points, Eigen::Isometry3d::Identity(), four, options);
    CHECK(result.pairs <= most);
    CHECK(result.pairs > most / 3);
  }
}

TEST_CASE("icp skips points that are not finite") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const positions clean = surface(1);
  const Eigen::Isometry3d coarse = scenes::yaw_and_shift(0, {0.03, 0, 0});
  positions with_nan = clean;
  with_nan.insert(with_nan.begin() + 40, {nan, 0, 0});
  with_nan.insert(with_nan.begin(), {0, 0, nan});
  for (const auto metric : {icp_metric::point_to_point, icp_metric::point_to_plane}) {
    const icp_options options{.metric = metric};
    const auto expected = refine_by_icp(clean, clean, coarse, four, options).target_from_source.matrix();
    CHECK(refine_by_icp(with_nan, clean, coarse, four, options).target_from_source.matrix() == expected);
    CHECK(refine_by_icp(clean, with_nan, coarse, four, options).target_from_source.matrix() == expected);
  }
}

TEST_CASE("icp stops when the progress callback says so") {
  const positions points = surface(1);
  const execution exec{.threads = 1, .on_progress = [](const progress&) { return false; }};
  CHECK_THROWS_AS(refine_by_icp(points, points, Eigen::Isometry3d::Identity(), four, {}, exec),
                  operation_cancelled);
}

TEST_CASE("points of a layer with normals are only paired when they face the same way") {
  // Two scanners see overlapping flanks of the stems, each some that the other one does not.
  const auto half_stems = [](double from, double to) {
    icp_layer seen;
    for (int tree = 0; tree < 12; ++tree)
      for (int k = 0; k < 40; ++k)
        for (int level = 0; level < 8; ++level) {
          const double angle = from + (to - from) * k / 39.0;
          const Eigen::Vector3d outward(std::cos(angle), std::sin(angle), 0);
          const Eigen::Vector3d foot(3.0 * (tree % 4), 4.0 * (tree / 4) + 0.5 * (tree % 3), 0);
          seen.source.push_back(foot + 0.15 * outward + Eigen::Vector3d(0, 0, 0.3 * level));
          seen.source_normals.push_back(outward);
        }
    return seen;
  };
  const icp_layer front = half_stems(-1.4, 1.4), back = half_stems(0.4, 3.2);
  icp_layer both = {front.source, back.source}, ground;
  for (int i = 0; i < 400; ++i) ground.source.push_back({0.5 * (i % 20), 0.5 * (i / 20), 0});
  ground.target = ground.source;  // stems alone would leave the height open
  const auto error = [&](const icp_layer& stems, icp_metric metric) {
    const icp_result result =
        refine_by_icp(std::vector{ground, stems}, Eigen::Isometry3d::Identity(), four, {.metric = metric});
    return (result.target_from_source.matrix() - Eigen::Matrix4d::Identity()).norm();
  };
  const double without = error(both, icp_metric::point_to_point);
  both.source_normals = front.source_normals;
  both.target_normals = back.source_normals;
  CHECK(without > 0.02);
  CHECK(error(both, icp_metric::point_to_point) < 0.3 * without);
  CHECK(error(both, icp_metric::point_to_plane) < 0.005);
}

TEST_CASE("normals must be given for all points of both scans, or for none") {
  icp_layer layer;
  layer.source = layer.target = std::vector<Eigen::Vector3d>(10, Eigen::Vector3d::Zero());
  layer.source_normals = std::vector<Eigen::Vector3d>(10, Eigen::Vector3d::UnitZ());
  const auto refine = [&] {
    refine_by_icp(std::vector{layer}, Eigen::Isometry3d::Identity(), degrees_of_freedom::four);
  };
  CHECK_THROWS_WITH(refine(), Catch::Contains("normals must be given"));
  layer.target_normals = std::vector<Eigen::Vector3d>(9, Eigen::Vector3d::UnitZ());
  CHECK_THROWS_WITH(refine(), Catch::Contains("normals must be given"));
}

TEST_CASE("normals of the source are turned with it before they are compared") {
  random_source random(61);
  icp_layer stems;
  for (int i = 0; i < 600; ++i) {
    const double angle = scenes::uniform(random, -3, 3);
    const Eigen::Vector3d outward(std::cos(angle), std::sin(angle), 0);
    stems.source.push_back(Eigen::Vector3d(2.5 * (i % 7), 1.7 * (i % 5), 0.01 * i) + 0.2 * outward);
    stems.source_normals.push_back(outward);
  }
  const Eigen::Isometry3d truth = scenes::yaw_and_shift(2.2, {-7, 30, 4});
  stems.target = scenes::moved(truth, stems.source);
  for (const Eigen::Vector3d& n : stems.source_normals) stems.target_normals.push_back(truth.linear() * n);
  for (const auto metric : {icp_metric::point_to_point, icp_metric::point_to_plane}) {
    const Eigen::Isometry3d coarse = Eigen::Translation3d(0.004, -0.003, 0) * truth;
    const icp_result result = refine_by_icp(std::vector{stems}, coarse, six, {.metric = metric});
    CHECK(result.pairs > 500);
    if (metric == icp_metric::point_to_point)
      CHECK(scenes::max_error(result.target_from_source, truth, stems.source) < 1e-3);
  }
}

TEST_CASE("icp goes on while it turns, also where it does not shift any more") {
  const positions source = surface(1), target = source;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : source) center += p / double(source.size());
  const Eigen::Isometry3d coarse =
      Eigen::Translation3d(center) * scenes::yaw_and_shift(0.02, {0, 0, 0}) * Eigen::Translation3d(-center);
  icp_options options{.metric = icp_metric::point_to_plane};
  options.convergence_threshold = 0.01;
  const icp_result result = refine_by_icp(source, target, coarse, four, options);
  CHECK(result.converged);
  CHECK(result.iterations > 1);
}

}  // namespace globalmatch::test_icp
