#include "globalmatch/detail/survey/adjust_links.hpp"

#include <Eigen/Dense>

#include <set>

#include "catch.hpp"
#include "globalmatch/detail/survey/initial_poses.hpp"
#include "made_up_surveys.hpp"

namespace globalmatch::test_adjust_links {

using namespace detail;

using scenes::uniform;

namespace {

const auto first_is_fixed = [](std::size_t m) { return m == 0; };

/// Poses off by up to `shift` [m] and a twentieth of that [rad]; the first one is not.
std::vector<plan_pose> disturbed(std::vector<plan_pose> poses, double shift, random_source& random) {
  for (std::size_t m = 1; m < poses.size(); ++m) {
    poses[m].shift += {uniform(random, -shift, shift), uniform(random, -shift, shift)};
    poses[m].yaw += uniform(random, -shift, shift) / 20;
  }
  return poses;
}

/// Residuals of a link in standard deviations, by poses alone.
Eigen::Vector3d whitened(const survey_link& l, const std::vector<plan_pose>& poses) {
  const vec2 off = poses[l.target].inverse() * (poses[l.source] * l.center_in_source()) - l.center;
  const double turn = wrapped(poses[l.source].yaw - poses[l.target].yaw - l.target_from_source.yaw);
  Eigen::Matrix3d covariance;
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r) covariance(r, c) = l.covariance(r, c);
  return covariance.llt().matrixL().solve(Eigen::Vector3d(off.x, off.y, turn));
}

/// One step of dense Gauss-Newton, by numerical derivatives: the largest shift [m] that it would make.
double step_of_gauss_newton(const std::vector<survey_link>& links, std::vector<plan_pose> poses,
                            const std::vector<double>& weights) {
  constexpr double small = 1e-6;
  const auto unknowns = Eigen::Index(poses.size() - 1) * 3, rows = Eigen::Index(links.size()) * 3;
  const auto residuals = [&] {
    Eigen::VectorXd r(rows);
    for (std::size_t l = 0; l < links.size(); ++l)
      r.segment<3>(Eigen::Index(l) * 3) = std::sqrt(weights[l]) * whitened(links[l], poses);
    return r;
  };
  const Eigen::VectorXd at = residuals();
  Eigen::MatrixXd jacobian(rows, unknowns);
  for (Eigen::Index u = 0; u < unknowns; ++u) {
    plan_pose& pose = poses[std::size_t(u / 3 + 1)];
    const plan_pose before = pose;
    (u % 3 == 0 ? pose.shift.x : u % 3 == 1 ? pose.shift.y : pose.yaw) += small;
    jacobian.col(u) = (residuals() - at) / small;
    pose = before;
  }
  const Eigen::VectorXd step = jacobian.colPivHouseholderQr().solve(-at);
  double largest = 0;
  for (Eigen::Index u = 0; u < unknowns; u += 3) largest = std::max(largest, step.segment<2>(u).norm());
  return largest;
}

}  // namespace

TEST_CASE("links without noise give the poses exactly, from any beginning near them") {
  random_source random(1);
  const auto truth = scenes::grid_of_maps(6, random);
  auto links = scenes::links_within(35, truth, {}, random);
  const unknown_poses unknowns(truth.size(), first_is_fixed);
  CHECK(unknowns.count == truth.size() - 1);
  auto poses = disturbed(truth, 2, random);
  REQUIRE(adjust_links(poses, unknowns, links));
  CHECK(scenes::max_pose_error(poses, truth) < 1e-6);
  for (const survey_link& l : links) CHECK(l.used);
}

TEST_CASE("adjusted poses are where a dense Gauss-Newton step no longer moves them") {
  random_source random(2);
  const auto truth = scenes::grid_of_maps(4, random);
  auto links = scenes::links_within(35, truth, {0.02, 0.002}, random);
  for (survey_link& l : links) {  // covariances along other axes than those of the maps
    const mat3 skewed = mat3::rows_of({2, 0.5, 0.02}, {0.3, 1, -0.01}, {0, 0, 1});
    l.covariance = skewed * l.covariance * skewed.transpose();
  }
  auto poses = disturbed(truth, 0.5, random);
  REQUIRE(adjust_links(poses, unknown_poses(truth.size(), first_is_fixed), links));
  std::vector<double> weights;
  for (const survey_link& l : links)
    weights.push_back(
        tukey_weight(squared_deviations(l, link_residual(l, poses[l.source], poses[l.target])) / 25));
  CHECK(step_of_gauss_newton(links, poses, weights) < 1e-4);
  CHECK(step_of_gauss_newton(links, disturbed(poses, 0.1, random), weights) > 1e-2);
}

TEST_CASE("of links of which 30 % are wrong those are no longer used, and the poses are right") {
  for (const std::uint64_t seed : {3u, 4u, 5u}) {
    random_source random(seed);
    const auto truth = scenes::grid_of_maps(8, random);
    auto links = scenes::links_within(45, truth, {0.01, 0.0003}, random);
    std::set<std::size_t> wrong;
    for (std::size_t l = 0; l < links.size(); ++l)
      if (random.uniform() < 0.3) scenes::make_wrong(links[l], random), wrong.insert(l);
    use_supported_links(links, truth.size(), -10);
    const link_graph graph(truth.size(), links, [](const survey_link& l) { return l.used; });
    const components parts = find_components(graph, 0);
    REQUIRE(parts.count() == 1);
    auto poses = initial_poses(links, parts);
    REQUIRE(adjust_links(poses, unknown_poses(truth.size(), first_is_fixed), links));
    CHECK(scenes::max_pose_error(poses, truth) < 0.2);
    for (std::size_t l = 0; l < links.size(); ++l) CHECK(links[l].used == !wrong.count(l));
  }
}

TEST_CASE("fixed poses stay, and several may be fixed") {
  random_source random(6);
  const auto truth = scenes::grid_of_maps(4, random);
  auto links = scenes::links_within(35, truth, {0.02, 0.001}, random);
  const unknown_poses unknowns(truth.size(), [](std::size_t m) { return m == 3 || m == 12; });
  auto poses = truth;
  poses[5].shift += {0.3, -0.2};
  REQUIRE(adjust_links(poses, unknowns, links));
  for (const std::size_t m : {3u, 12u}) {
    CHECK(poses[m].shift == truth[m].shift);
    CHECK(poses[m].yaw == truth[m].yaw);
  }
  CHECK(scenes::max_pose_error(poses, truth) < 0.1);
}

TEST_CASE("links that are perfect, or that claim to be, can be adjusted to") {
  random_source random(7);
  const auto truth = scenes::grid_of_maps(3, random);
  auto links = scenes::links_within(35, truth, {}, random);
  for (survey_link& l : links) l.covariance = mat3::diagonal_of({2.5e-7, 2.5e-7, 2.5e-9});
  scenes::make_wrong(links[3], random);
  auto poses = disturbed(truth, 0.1, random);
  REQUIRE(adjust_links(poses, unknown_poses(truth.size(), first_is_fixed), links));
  CHECK(scenes::max_pose_error(poses, truth) < 1e-4);
  CHECK_FALSE(links[3].used);
}

TEST_CASE("without links, or without maps, there is nothing to adjust") {
  std::vector<survey_link> links;
  std::vector<plan_pose> poses;
  CHECK(adjust_links(poses, unknown_poses(0, first_is_fixed), links));
  poses.resize(1);
  CHECK(adjust_links(poses, unknown_poses(1, first_is_fixed), links));
  poses.resize(2);
  CHECK_FALSE(adjust_links(poses, unknown_poses(2, first_is_fixed), links));
}

}  // namespace globalmatch::test_adjust_links
