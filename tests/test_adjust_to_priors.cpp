#include "globalmatch/detail/survey/adjust_to_priors.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "catch.hpp"
#include "globalmatch/survey.hpp"
#include "globalmatch/survey_refinement.hpp"
#include "made_up_maps.hpp"
#include "survey_layouts.hpp"

namespace globalmatch::test_adjust_to_priors {

using namespace detail;

using benchmarks::plant;
using benchmarks::survey_layout;
using benchmarks::surveyed_map;
using scenes::positions;

namespace {

/// Stations in a row, each of which sees little of the next one, so that errors add up along it.
std::vector<surveyed_map> maps_in_a_row(random_source& random) {
  constexpr survey_layout layout = {.noise = 0.06};
  const positions trees = plant("spaced", 330, 22, random);
  return survey_stand(trees, layout, std::numeric_limits<std::size_t>::max(), random, 0);
}

std::vector<positions> stems_of(const std::vector<surveyed_map>& maps) {
  std::vector<positions> stems;
  for (const surveyed_map& m : maps) stems.push_back(m.stems);
  return stems;
}

/// Where the coordinates of priors have the stand, whose verticals may lean there.
Eigen::Isometry3d grid_from_stand(double lean = 0) {
  Eigen::Isometry3d grid = Eigen::Isometry3d::Identity();
  grid.linear() =
      (Eigen::AngleAxisd(lean, Eigen::Vector3d::UnitX()) * Eigen::AngleAxisd(2.1, Eigen::Vector3d::UnitZ()))
          .toRotationMatrix();
  grid.translation() = Eigen::Vector3d(431000, 5621000, 312);
  return grid;
}

Eigen::Isometry3d truth_of(const surveyed_map& map, double lean = 0) {
  return grid_from_stand(lean) * map.stand_from_scan;
}

survey_options::prior measured(const std::vector<surveyed_map>& maps, std::size_t m, double sigma,
                               random_source& random, double lean = 0) {
  survey_options::prior p;
  p.scan = m;
  p.sigma_plan = p.sigma_height = sigma;
  p.position = truth_of(maps[m], lean).translation() +
               sigma * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
  return p;
}

/// Root mean square [m] over all scans, in plan and in height.
struct rms_error {
  double plan = 0, height = 0;
  rms_error(const survey& s, const std::vector<surveyed_map>& maps, double lean = 0) {
    for (std::size_t m = 0; m < maps.size(); ++m) {
      REQUIRE(s.scans[m].status == survey::status::placed);
      const Eigen::Vector3d off =
          s.scans[m].survey_from_scan.translation() - truth_of(maps[m], lean).translation();
      plan += off.head<2>().squaredNorm() / double(maps.size());
      height += off.z() * off.z() / double(maps.size());
    }
    plan = std::sqrt(plan);
    height = std::sqrt(height);
  }
};

/// The same survey, moved as a whole to the priors.
survey moved_as_a_whole(survey s, const survey_options& options) {
  use_known_frames(s, options, [](int) { return std::optional<std::size_t>(); });
  return s;
}

std::size_t reference_of(const survey& s) {
  for (std::size_t m = 0; m < s.scans.size(); ++m)
    if (is_held(s.scans[m])) return m;
  FAIL("no reference");
  return 0;
}

/// Errors in plan beside the reference over their standard deviations, squared and summed, of both axes.
struct normalised_errors {
  double squares = 0, count = 0;

  void add(const survey& s, const std::vector<surveyed_map>& maps) {
    const std::size_t reference = reference_of(s);
    const Eigen::Isometry3d survey_from_grid =
        s.scans[reference].survey_from_scan * truth_of(maps[reference]).inverse();
    for (std::size_t m = 0; m < maps.size(); ++m) {
      if (m == reference) continue;
      const Eigen::Isometry3d& pose = s.scans[m].survey_from_scan;
      const transform_uncertainty& u = *s.scans[m].uncertainty;
      const Eigen::Vector3d off =
          survey_from_grid * (truth_of(maps[m]) * (pose.inverse() * u.center)) - u.center;
      for (int axis = 0; axis < 2; ++axis, ++count)
        squares += off[axis] * off[axis] / u.covariance(axis, axis);
    }
  }
};

double largest_distance(const survey& a, const survey& b) {
  double largest = 0;
  for (std::size_t m = 0; m < a.scans.size(); ++m)
    largest = std::max(
        largest,
        (a.scans[m].survey_from_scan.translation() - b.scans[m].survey_from_scan.translation()).norm());
  return largest;
}

}  // namespace

TEST_CASE("positions that are better than the stems bend a row of scans to where they have it") {
  double bent = 0, moved = 0, bent_height = 0, moved_height = 0;
  normalised_errors normalised;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    random_source random(seed);
    const auto maps = maps_in_a_row(random);
    const auto stems = stems_of(maps);
    REQUIRE(maps.size() > 12);
    const survey without = register_survey(stems);
    REQUIRE(without.components == 1);
    survey_options options;
    for (std::size_t m = 0; m < maps.size(); m += 2)
      options.priors.push_back(measured(maps, m, 0.005, random));
    const survey with = register_survey(stems, options);
    normalised.add(with, maps);
    const rms_error after(with, maps), before(moved_as_a_whole(without, options), maps);
    bent += after.plan, moved += before.plan;
    bent_height += after.height, moved_height += before.height;
  }
  INFO(bent << " " << moved << " " << bent_height << " " << moved_height);
  CHECK(bent < 0.7 * moved);
  CHECK(bent_height < 0.7 * moved_height);
  const double rms = std::sqrt(normalised.squares / normalised.count);
  CHECK(rms > 0.7);
  CHECK(rms < 1.4);
}

TEST_CASE("a position that the stems contradict bends nothing, and is named") {
  random_source random(5);
  const auto maps = maps_in_a_row(random);
  survey_options options;
  for (const std::size_t m : {0u, 5u, 9u}) options.priors.push_back(measured(maps, m, 0.01, random));
  const survey right = register_survey(stems_of(maps), options);
  options.priors.push_back(measured(maps, maps.size() - 1, 0.01, random));
  options.priors.back().position += Eigen::Vector3d(3, 4, 5);
  const survey with_wrong = register_survey(stems_of(maps), options);
  CHECK(largest_distance(with_wrong, right) < 1e-3);
  CHECK(with_wrong.scans.back().prior_deviations > 300);
  CHECK(with_wrong.scans.front().prior_deviations < 5);
  REQUIRE(with_wrong.priors.size() == 4);
  CHECK(with_wrong.priors[3].weight == 0);
  CHECK(with_wrong.priors[3].height_weight == 0);
  CHECK(with_wrong.priors[0].weight > 0.1);
}

TEST_CASE("positions that are worse than the stems leave the scans where they are beside each other") {
  random_source random(6);
  const auto maps = maps_in_a_row(random);
  const survey without = register_survey(stems_of(maps));
  survey_options options;
  for (std::size_t m = 0; m < maps.size(); ++m) options.priors.push_back(measured(maps, m, 20, random));
  const survey with = register_survey(stems_of(maps), options);
  CHECK(with.frames[0].source == survey::frame_source::priors);
  const Eigen::Isometry3d back = without.scans[0].survey_from_scan * with.scans[0].survey_from_scan.inverse();
  for (std::size_t m = 0; m < maps.size(); ++m) {
    const Eigen::Vector3d &center = without.scans[m].uncertainty->center,
                          moved = back * with.scans[m].uncertainty->center;
    CHECK((moved - center).norm() < 0.02);
  }
}

TEST_CASE("beside a fixed scan, which keeps its pose to the bit, positions bend the others") {
  random_source random(7);
  const auto maps = maps_in_a_row(random);
  survey_options options;
  options.fixed = {{0, truth_of(maps[0])}};
  const survey fixed_alone = register_survey(stems_of(maps), options);
  for (std::size_t m = 3; m < maps.size(); m += 3) options.priors.push_back(measured(maps, m, 0.01, random));
  const survey with = register_survey(stems_of(maps), options);
  CHECK(with.scans[0].survey_from_scan.matrix() == options.fixed[0].survey_from_scan.matrix());
  CHECK(with.frames[0].source == survey::frame_source::fixed);
  const rms_error before(fixed_alone, maps), after(with, maps);
  CHECK(after.plan < 0.5 * before.plan);
  CHECK(after.height < 0.5 * before.height);
}

TEST_CASE("a refinement without pairs leaves a survey with priors as it is") {
  random_source random(8);
  const auto maps = maps_in_a_row(random);
  survey_options options;
  for (std::size_t m = 0; m < maps.size(); m += 4) options.priors.push_back(measured(maps, m, 0.01, random));
  const survey before = register_survey(stems_of(maps), options);
  survey after = before;
  apply_refinements(after, {});
  CHECK(largest_distance(after, before) < 1e-6);
  for (std::size_t m = 0; m < maps.size(); ++m)
    CHECK(after.scans[m].uncertainty->covariance.isApprox(before.scans[m].uncertainty->covariance, 1e-2));
}

TEST_CASE("yaws that are measured well turn the scans of a row") {
  random_source random(9);
  const auto maps = maps_in_a_row(random);
  survey_options options;
  double before = 0, after = 0;
  const auto yaw_of = [](const Eigen::Isometry3d& pose) { return std::atan2(pose(1, 0), pose(0, 0)); };
  for (std::size_t m = 0; m < maps.size(); ++m) {
    survey_options::prior p = {.scan = m, .sigma_yaw = 2e-4};
    p.yaw = yaw_of(truth_of(maps[m])) + p.sigma_yaw * random.normal();
    options.priors.push_back(p);
  }
  const survey with = register_survey(stems_of(maps), options),
               moved = moved_as_a_whole(register_survey(stems_of(maps)), options);
  for (std::size_t m = 0; m < maps.size(); ++m) {
    before += std::pow(wrapped(yaw_of(moved.scans[m].survey_from_scan) - options.priors[m].yaw), 2);
    after += std::pow(wrapped(yaw_of(with.scans[m].survey_from_scan) - options.priors[m].yaw), 2);
  }
  INFO(std::sqrt(before) << " " << std::sqrt(after));
  CHECK(after < 0.25 * before);
}

TEST_CASE("beside a fixed scan that leans heights bend heights, and places in plan places") {
  constexpr double lean = 0.005, unknown = std::numeric_limits<double>::quiet_NaN();
  random_source random(7);
  const auto maps = maps_in_a_row(random);
  survey_options options;
  options.fixed = {{0, truth_of(maps[0], lean)}};
  const rms_error before(register_survey(stems_of(maps), options), maps, lean);
  for (const bool has_heights : {true, false}) {
    CAPTURE(has_heights);
    options.priors.clear();
    for (std::size_t m = 3; m < maps.size(); m += 3) {
      options.priors.push_back(measured(maps, m, 0.01, random, lean));
      Eigen::Vector3d& at = options.priors.back().position;
      if (has_heights)
        at.x() = at.y() = unknown;
      else
        at.z() = unknown;
    }
    const rms_error after(register_survey(stems_of(maps), options), maps, lean);
    CHECK((has_heights ? after.height : after.plan) < 0.5 * (has_heights ? before.height : before.plan));
    CHECK((has_heights ? after.plan : after.height) < 1.2 * (has_heights ? before.plan : before.height));
  }
}

TEST_CASE("a scan that targets alone link follows its neighbor in height") {
  random_source random(10);
  const auto maps = maps_in_a_row(random);
  const std::size_t last = maps.size() - 1;
  std::vector<positions> stems = stems_of(maps);
  for (Eigen::Vector3d& p : stems[last]) p.head<2>() = 40 * Eigen::Vector2d(random.normal(), random.normal());
  survey_options options;
  for (int k = 0; k < 4; ++k) {
    const Eigen::Vector3d at =
        maps[last].stand_from_scan.translation() + Eigen::Vector3d(-10, 4 * k - 6, 1 + 0.5 * k);
    for (const std::size_t m : {last - 1, last})
      options.targets.push_back({m, "T" + std::to_string(k),
                                 maps[m].stand_from_scan.inverse() * at + benchmarks::gaussian(random, 0.002),
                                 0.002});
  }
  for (std::size_t m = 0; m < last; ++m) options.priors.push_back(measured(maps, m, 0.003, random));
  const survey s = register_survey(stems, options);
  REQUIRE(s.scans[last].status == survey::status::placed);
  const Eigen::Vector3d off =
      s.scans[last].survey_from_scan.translation() - truth_of(maps[last]).translation();
  CHECK(std::abs(off.z()) < 0.015);
}

TEST_CASE("priors of one component leave another one as it is, to the bit") {
  random_source random(11);
  std::vector<surveyed_map> maps = maps_in_a_row(random);
  const std::size_t first = maps.size();
  for (surveyed_map& m : maps_in_a_row(random)) maps.push_back(std::move(m));
  const survey without = register_survey(stems_of(maps));
  REQUIRE(without.components == 2);
  survey_options options;
  for (std::size_t m = 0; m < first; m += 2) options.priors.push_back(measured(maps, m, 0.01, random));
  const survey with = register_survey(stems_of(maps), options);
  for (std::size_t m = first; m < maps.size(); ++m) {
    CHECK(with.scans[m].survey_from_scan.matrix() == without.scans[m].survey_from_scan.matrix());
    CHECK(with.scans[m].uncertainty->covariance == without.scans[m].uncertainty->covariance);
  }
}

TEST_CASE("standard deviations that say nothing, or all, are believed as far as numbers hold") {
  random_source random(12);
  const auto maps = maps_in_a_row(random);
  survey_options options;
  for (std::size_t m = 0; m < maps.size(); m += 2) options.priors.push_back(measured(maps, m, 0.01, random));
  const rms_error expected(register_survey(stems_of(maps), options), maps);
  for (const double sigma : {std::numeric_limits<double>::infinity(), 1e200, 1e-9}) {
    CAPTURE(sigma);
    survey_options other = options;
    other.priors[2].sigma_plan = other.priors[2].sigma_height = sigma;
    if (sigma < 1) other.priors[2].position = truth_of(maps[other.priors[2].scan]).translation();
    const rms_error error(register_survey(stems_of(maps), other), maps);
    CHECK(error.plan < 2 * expected.plan);
    CHECK(error.height < 2 * expected.height);
  }
}

TEST_CASE("right positions beside a wrong one count") {
  std::size_t right = 0, left_out = 0, wrong_left = 0;
  for (std::uint64_t seed = 20; seed < 28; ++seed) {
    random_source random(seed);
    const auto maps = maps_in_a_row(random);
    survey_options options;
    for (std::size_t m = 0; m < maps.size(); m += 2)
      options.priors.push_back(measured(maps, m, 0.01, random));
    const std::size_t wrong = 1 + seed % (options.priors.size() - 2);
    const double direction = 6.28 * random.uniform();
    options.priors[wrong].position += 0.8 * Eigen::Vector3d(std::cos(direction), std::sin(direction), 0);
    const survey s = register_survey(stems_of(maps), options);
    for (std::size_t i = 0; i < s.priors.size(); ++i) {
      if (i == wrong)
        wrong_left += s.priors[i].weight > 0;
      else
        ++right, left_out += s.priors[i].weight == 0;
    }
  }
  INFO(left_out << " of " << right << " right ones left out, wrong ones that count " << wrong_left);
  CHECK(right > 50);
  CHECK(left_out <= 2);
  CHECK(wrong_left <= 1);
}

TEST_CASE("what is wrong in plan changes nothing of heights that are all off by more than they say") {
  random_source random(15);
  const auto maps = maps_in_a_row(random);
  survey_options options;
  for (std::size_t m = 0; m < maps.size(); ++m) {
    options.priors.push_back(measured(maps, m, 0.01, random));
    options.priors.back().position.z() += 0.09 * random.normal();
  }
  options.priors[6].position.x() += 0.5;
  const survey s = register_survey(stems_of(maps), options);
  CHECK(s.priors[6].weight == 0);
  std::size_t heights = 0;
  for (const survey::adjusted_prior& p : s.priors) {
    heights += p.height_weight > 0;
    CHECK(p.height_weight < 0.1);
  }
  CHECK(heights >= maps.size() - 1);
}

TEST_CASE("each component is adjusted to its own priors, whatever the others have") {
  random_source random(16);
  std::vector<surveyed_map> maps = maps_in_a_row(random);
  const std::size_t first = maps.size();
  for (surveyed_map& m : maps_in_a_row(random)) maps.push_back(std::move(m));
  survey_options options;
  for (std::size_t m = 0; m < first; m += 2) options.priors.push_back(measured(maps, m, 0.01, random));
  options.priors[3].position.y() += 1;
  const survey alone = register_survey(stems_of(maps), options);
  for (std::size_t m = first; m < maps.size(); m += 5) {
    options.priors.push_back(measured(maps, m, 0.01, random));
    options.priors.back().position.head<2>().setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  const survey s = register_survey(stems_of(maps), options);
  REQUIRE(s.components == 2);
  CHECK(s.scans[options.priors[3].scan].prior_deviations > 50);
  for (std::size_t m = 0; m < first; ++m)
    CHECK(s.scans[m].survey_from_scan.matrix() == alone.scans[m].survey_from_scan.matrix());
  CHECK(std::isinf(s.frames[std::size_t(s.scans[first].component)].yaw_sigma));
}

TEST_CASE("standard deviations that are too small on the whole are scaled, and no prior is left out") {
  random_source random(14);
  const auto maps = maps_in_a_row(random);
  survey_options options;
  for (std::size_t m = 0; m < maps.size(); ++m) {
    options.priors.push_back(measured(maps, m, 0.05, random));
    options.priors.back().sigma_plan = options.priors.back().sigma_height = 0.005;
  }
  const survey s = register_survey(stems_of(maps), options);
  for (const survey::adjusted_prior& p : s.priors) {
    CHECK(p.weight > 0.002);
    CHECK(p.weight < 0.05);
    CHECK(p.height_weight > 0.002);
    CHECK(p.height_weight < 0.05);
  }
  const rms_error error(s, maps);
  CHECK(error.plan < 0.05);
  CHECK(error.height < 0.05);
}

TEST_CASE("one position alone gives a frame without a direction, whichever scan has it") {
  random_source random(17);
  const auto maps = maps_in_a_row(random);
  for (std::size_t m = 0; m < maps.size(); ++m) {
    survey_options options;
    options.priors = {measured(maps, m, 0.5, random)};
    const survey s = register_survey(stems_of(maps), options);
    REQUIRE(s.scans[m].component >= 0);
    const survey::frame& frame = s.frames[std::size_t(s.scans[m].component)];
    CHECK(frame.source == survey::frame_source::priors);
    CHECK(std::isinf(frame.yaw_sigma));
    CHECK(s.priors[0].weight == 1);
    CHECK(s.scans[m].prior_deviations < 1e-3);
  }
}

TEST_CASE("priors that say next to nothing leave uncertainties as they are") {
  random_source random(13);
  const auto maps = maps_in_a_row(random);
  survey_options options;
  const survey without = register_survey(stems_of(maps));
  for (std::size_t m = 0; m < maps.size(); ++m) options.priors.push_back(measured(maps, m, 900, random));
  const survey with = register_survey(stems_of(maps), options);
  for (std::size_t m = 0; m < maps.size(); ++m)
    for (int i = 0; i < 4; ++i) {
      const double before = without.scans[m].uncertainty->covariance(i, i),
                   after = with.scans[m].uncertainty->covariance(i, i);
      INFO(m << " " << i << " " << before << " " << after);
      if (i > 1) CHECK(after == Approx(before).epsilon(0.1));
    }
  for (std::size_t m = 0; m < maps.size(); ++m)  // turned with the frame
    CHECK(with.scans[m].uncertainty->covariance.topLeftCorner(2, 2).trace() ==
          Approx(without.scans[m].uncertainty->covariance.topLeftCorner(2, 2).trace()).epsilon(0.1));
}

}  // namespace globalmatch::test_adjust_to_priors
