#include "globalmatch/detail/survey/survey_frames.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"

namespace globalmatch::test_survey_frames {

using namespace detail;

namespace {

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

Eigen::Isometry3d pose_of(double x, double y, double z, double yaw) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  pose.translation() = Eigen::Vector3d(x, y, z);
  return pose;
}

/// A component of scans in a row of 20 m, with a tree; the second component is one scan.
survey survey_of(std::size_t scans) {
  survey s;
  s.components = 2;
  for (std::size_t i = 0; i <= scans; ++i) {
    survey::scan scan;
    scan.status = i < scans ? survey::status::placed : survey::status::placed_alone;
    scan.component = i < scans ? 0 : 1;
    scan.is_height_known = true;
    if (i < scans)
      scan.survey_from_scan =
          pose_of(20.0 * double(i), 3.0 * double(i % 2), 0.5 * double(i), 0.3 * double(i));
    if (i < scans)
      scan.uncertainty = transform_uncertainty{scan.survey_from_scan.translation() + Eigen::Vector3d(1, 2, 3),
                                               Eigen::Vector3d::UnitZ(), Eigen::Matrix4d::Identity() * 1e-4};
    s.scans.push_back(scan);
  }
  s.trees.push_back({.position = {5, 6, 7}, .component = 0, .seen = {}});
  return s;
}

/// Priors that a transform of the survey's frame has, with noise.
std::vector<survey_options::prior> priors_under(const survey& s, const Eigen::Isometry3d& truth, double sigma,
                                                random_source& random) {
  std::vector<survey_options::prior> priors;
  for (std::size_t i = 0; i < s.scans.size(); ++i) {
    survey_options::prior p;
    p.scan = i;
    p.position = truth * s.scans[i].survey_from_scan.translation() +
                 sigma * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
    p.sigma_plan = p.sigma_height = std::max(sigma, 0.01);
    priors.push_back(p);
  }
  return priors;
}

const auto none_is_fixed = [](int) { return std::optional<std::size_t>(); };

double plan_error(const survey& s, const survey& before, const Eigen::Isometry3d& truth) {
  double worst = 0;
  for (std::size_t i = 0; i < s.scans.size(); ++i)
    if (s.scans[i].component == 0)
      worst = std::max(worst, (s.scans[i].survey_from_scan.translation() -
                               truth * before.scans[i].survey_from_scan.translation())
                                  .head<2>()
                                  .norm());
  return worst;
}

}  // namespace

TEST_CASE("a prior is as uncertain as it says, and as its scan is in its component, thrice") {
  survey s = survey_of(2);
  s.scans[1].uncertainty->center = s.scans[1].survey_from_scan.translation();
  s.scans[1].uncertainty->covariance = Eigen::Vector4d(0.04, 0.04, 0.09, 1e-4).asDiagonal();
  survey_options::prior given;
  given.scan = 1;
  given.position = {3, 4, 5};
  given.sigma_plan = 0.1, given.sigma_height = 0.2, given.yaw = 1, given.sigma_yaw = 0.02;
  const auto priors = priors_of(s, 0, std::vector{given}, Eigen::Isometry3d::Identity());
  REQUIRE(priors.size() == 1);
  CHECK(priors[0].plan_variance == Approx(0.01 + 9 * 0.04));
  CHECK(priors[0].height_variance == Approx(0.04 + 9 * 0.09));
  CHECK(priors[0].yaw_variance == Approx(0.0004 + 9 * 1e-4));
  s.scans[1].uncertainty.reset();
  CHECK(priors_of(s, 0, std::vector{given}, Eigen::Isometry3d::Identity())[0].plan_variance == Approx(0.01));
}

TEST_CASE("exact positions give the frame exactly, with all that is in it") {
  random_source random(1);
  const survey before = survey_of(5);
  const Eigen::Isometry3d truth = pose_of(431000, 5621000, 312, 2.2);
  survey s = before;
  survey_options options;
  options.priors = priors_under(s, truth, 0, random);
  options.priors.pop_back();
  use_known_frames(s, options, none_is_fixed);
  for (std::size_t i = 0; i < 5; ++i) {
    CHECK(s.scans[i].survey_from_scan.isApprox(truth * before.scans[i].survey_from_scan, 1e-12));
    CHECK(s.scans[i].prior_deviations < 1e-3);
  }
  CHECK((s.trees[0].position - truth * before.trees[0].position).norm() < 1e-6);
  CHECK((s.scans[0].uncertainty->center - truth * before.scans[0].uncertainty->center).norm() < 1e-6);
  CHECK(s.scans[5].survey_from_scan.matrix() == Eigen::Matrix4d::Identity());
  CHECK(std::isnan(s.scans[5].prior_deviations));
}

TEST_CASE("noise averages out, and what disagrees with most priors has no say and is named") {
  random_source random(2);
  const survey before = survey_of(12);
  const Eigen::Isometry3d truth = pose_of(100, -40, 7, -1.1);
  survey s = before;
  survey_options options;
  options.priors = priors_under(s, truth, 1.0, random);
  options.priors.pop_back();
  options.priors[3].position += Eigen::Vector3d(60, -25, 80);
  options.priors[7].position = -options.priors[7].position;
  use_known_frames(s, options, none_is_fixed);
  CHECK(plan_error(s, before, truth) < 1.5);
  CHECK(s.frames[0].yaw_sigma == Approx(0.0045).epsilon(0.3));  // 10 places in a row of 20 m
  for (std::size_t i = 0; i < 12; ++i) {
    INFO("scan " << i);
    CHECK((s.scans[i].prior_deviations > 10) == (i == 3 || i == 7));
  }
}

TEST_CASE("yaws alone turn, a position alone shifts, and both together place a scan that stands alone") {
  survey s = survey_of(2);
  survey_options options;
  options.priors = {
      {.scan = 0, .yaw = 1.0}, {.scan = 1, .yaw = 1.3}, {.scan = 2, .position = {9, 8, 7}, .yaw = -3.0}};
  use_known_frames(s, options, none_is_fixed);
  CHECK(s.scans[0].survey_from_scan.isApprox(pose_of(0, 0, 0, 1.0), 1e-9));
  CHECK(s.scans[2].survey_from_scan.isApprox(pose_of(9, 8, 7, -3.0), 1e-9));
  survey shifted = survey_of(2);
  options.priors = {{.scan = 1, .position = {100, 200, unknown}}};
  use_known_frames(shifted, options, none_is_fixed);
  CHECK(shifted.scans[1].survey_from_scan.isApprox(pose_of(100, 200, 0.5, 0.3), 1e-9));
  CHECK(shifted.scans[0].survey_from_scan.isApprox(pose_of(80, 197, 0, 0), 1e-9));
}

TEST_CASE("a place alone gives no direction, and heights that are guesses do not raise the frame") {
  survey s = survey_of(3);
  survey_options options;
  options.priors = {{.scan = 1, .position = {431000.123, 5621000.456, 10}},
                    {.scan = 2, .position = {unknown, unknown, 900}}};
  s.scans[2].is_height_known = false;
  use_known_frames(s, options, none_is_fixed);
  CHECK(s.scans[0].survey_from_scan.linear().isIdentity(1e-12));
  REQUIRE(s.frames.size() == 2);
  CHECK(s.frames[0].source == survey::frame_source::priors);
  CHECK(std::isinf(s.frames[0].yaw_sigma));
  CHECK(s.frames[1].source == survey::frame_source::reference);
  CHECK(s.scans[1].survey_from_scan.translation().z() == Approx(10));
  CHECK(s.scans[2].prior_deviations == 0);
}

TEST_CASE("of several priors of a scan the one that is most off is told") {
  survey s = survey_of(4);
  random_source random(6);
  survey_options options;
  options.priors = priors_under(s, pose_of(1, 2, 3, 1), 0, random);
  options.priors.insert(options.priors.begin(), {.scan = 1, .position = {900, 0, 0}});
  use_known_frames(s, options, none_is_fixed);
  CHECK(s.scans[1].prior_deviations > 500);
}

TEST_CASE("a compass that is off is outvoted by two that agree") {
  survey s = survey_of(3);
  survey_options options;
  options.priors = {{.scan = 0, .yaw = 0.5}, {.scan = 1, .yaw = 3.0}, {.scan = 2, .yaw = 1.1}};
  use_known_frames(s, options, none_is_fixed);
  CHECK(s.scans[0].survey_from_scan.isApprox(pose_of(0, 0, 0, 0.5), 1e-6));
  CHECK(s.scans[1].prior_deviations > 20);
  CHECK(s.scans[2].prior_deviations < 0.1);
}

TEST_CASE("a component whose reference leans is turned upright") {
  random_source random(4);
  const Eigen::Isometry3d lean(Eigen::AngleAxisd(0.1, Eigen::Vector3d(1, 2, 0).normalized()));
  const survey level = survey_of(5);
  survey s = level;
  move_component(s, 0, lean);
  const Eigen::Isometry3d truth = pose_of(10, 20, 30, 0.7);
  survey_options options;
  options.priors = priors_under(level, truth, 0, random);
  options.priors.pop_back();
  use_known_frames(s, options, none_is_fixed);
  for (std::size_t i = 0; i < 5; ++i)
    CHECK((s.scans[i].survey_from_scan.translation() - truth * level.scans[i].survey_from_scan.translation())
              .norm() < 1e-6);
}

TEST_CASE("fixed scans have their poses to the bit, and priors beside them are only compared") {
  random_source random(5);
  survey s = survey_of(4);
  const Eigen::Isometry3d truth = pose_of(5, 6, 7, 0.5);
  survey_options options;
  options.priors = priors_under(s, truth, 0, random);
  options.priors[1].position.x() += 1;
  for (const std::size_t held : {0u, 2u}) s.scans[held].uncertainty->covariance.setZero();
  options.fixed = {{2, truth * s.scans[2].survey_from_scan}, {0, truth * s.scans[0].survey_from_scan}};
  use_known_frames(s, options, [](int component) {
    return component == 0 ? std::optional<std::size_t>(2) : std::nullopt;
  });
  CHECK(s.scans[2].survey_from_scan.matrix() == options.fixed[0].survey_from_scan.matrix());
  CHECK(s.scans[0].survey_from_scan.matrix() == options.fixed[1].survey_from_scan.matrix());
  CHECK(s.scans[1].prior_deviations == Approx(100));
  CHECK(s.scans[3].prior_deviations < 1e-3);
}

}  // namespace globalmatch::test_survey_frames
