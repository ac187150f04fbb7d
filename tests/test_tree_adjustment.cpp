#include "globalmatch/detail/survey/tree_adjustment.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include <Eigen/Dense>

#include "catch.hpp"
#include "made_up_surveys.hpp"

namespace globalmatch::test_tree_adjustment {

using namespace detail;

using namespace scenes;

namespace {
const auto first_is_fixed = [](std::size_t m) { return m == 0; };

/// Targets in a row through the maps, as those within `range` [m] show them.
target_observations targets_seen_from(const std::vector<plan_pose>& poses, double range, double sigma,
                                      random_source& random) {
  target_observations targets;
  std::uint32_t given = 0;
  for (double x = -3; x < 50; x += 7) {
    const vec2 place = {x, 0.8 * x + 3};
    for (std::uint32_t m = 0; m < poses.size(); ++m) {
      if ((place - poses[m].shift).norm() > range) continue;
      const vec2 at = poses[m].inverse() * place;
      targets.seen.push_back(
          {m, {at.x + sigma * random.normal(), at.y + sigma * random.normal(), 0}, sigma, given++});
    }
    targets.first.push_back(targets.seen.size());
  }
  return targets;
}

/// Poses and places of landmarks by dense least squares, with weights that are given: nothing is eliminated.
struct dense_adjustment {
  std::vector<plan_pose> poses;
  Eigen::MatrixXd inverse;  ///< of the normal equations, poses first

  /// What a map shows of a landmark, and with which information [1/m^2].
  struct observation {
    std::size_t landmark;
    std::uint32_t map;
    vec2 at;
    double information;
  };

  dense_adjustment(std::vector<plan_pose> start, const std::vector<observation>& seen, std::size_t landmarks)
      : poses(std::move(start)) {
    const auto unknowns = Eigen::Index(3 * (poses.size() - 1));
    std::vector<vec2> places(landmarks);
    std::vector<double> count(landmarks, 0);
    for (const observation& o : seen) places[o.landmark] += poses[o.map] * o.at, ++count[o.landmark];
    for (std::size_t l = 0; l < landmarks; ++l) places[l] = places[l] / std::max(1.0, count[l]);
    for (int iteration = 0; iteration < 4; ++iteration) {
      const Eigen::Index size = unknowns + 2 * Eigen::Index(landmarks);
      Eigen::MatrixXd normal = 1e-9 * Eigen::MatrixXd::Identity(size, size);
      Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
      for (const observation& o : seen) {
        const vec2 placed = poses[o.map] * o.at, lever = quarter_turned(placed - poses[o.map].shift);
        Eigen::Matrix<double, 2, 5> j;
        j << 1, 0, lever.x, -1, 0, 0, 1, lever.y, 0, -1;
        const vec2 off = placed - places[o.landmark];
        const Eigen::Matrix<double, 5, 1> summand =
            o.information * j.transpose() * Eigen::Vector2d(off.x, off.y);
        const Eigen::Matrix<double, 5, 5> product = o.information * j.transpose() * j;
        const Eigen::Index pose = 3 * (Eigen::Index(o.map) - 1),
                           place = unknowns + 2 * Eigen::Index(o.landmark);
        const Eigen::Index of[5] = {pose, pose + 1, pose + 2, place, place + 1};
        for (int r = o.map > 0 ? 0 : 3; r < 5; ++r) {
          right[of[r]] -= summand[r];
          for (int c = o.map > 0 ? 0 : 3; c < 5; ++c) normal(of[r], of[c]) += product(r, c);
        }
      }
      inverse = normal.inverse();
      const Eigen::VectorXd step = inverse * right;
      for (std::size_t m = 1; m < poses.size(); ++m) {
        const Eigen::Index at = 3 * Eigen::Index(m - 1);
        poses[m].shift += {step[at], step[at + 1]};
        poses[m].yaw += step[at + 2];
      }
      for (std::size_t l = 0; l < landmarks; ++l)
        places[l] += {step[unknowns + 2 * Eigen::Index(l)], step[unknowns + 2 * Eigen::Index(l) + 1]};
    }
  }
};

}  // namespace

TEST_CASE("trees without noise give the poses exactly") {
  random_source random(3);
  const nine_maps s(0, random);
  const tree_observations trees = find_trees(s.seen.maps, all_of(9), s.truth, tree_radii(9));
  const unknown_poses unknowns(9, first_is_fixed);
  tree_adjustment adjustment(s.seen.maps, trees, s.links, unknowns, std::vector<double>(9, 0.02));
  auto poses = s.disturbed(0.1, random);
  REQUIRE(adjustment.adjust(poses));
  CHECK(scenes::max_pose_error(poses, s.truth) < 1e-6);
  CHECK(adjustment.covariances()[0] == mat3{});
}

TEST_CASE("stems that are off lose their weight, and displace no map") {
  random_source random(4);
  nine_maps s(0.01, random);
  std::set<std::pair<std::uint32_t, std::uint32_t>> off;
  for (std::uint32_t m = 0; m < 9; ++m)
    for (std::uint32_t i = 0; i < s.seen.maps[m].stems.size(); ++i)
      if (random.uniform() < 0.1) {
        s.seen.maps[m].stems.at[i].x += 0.2;
        off.insert({m, i});
      }
  const tree_observations trees = find_trees(s.seen.maps, all_of(9), s.truth, tree_radii(9));
  const unknown_poses unknowns(9, first_is_fixed);
  tree_adjustment adjustment(s.seen.maps, trees, s.links, unknowns, std::vector<double>(9, 0.02));
  auto poses = s.disturbed(0.02, random);
  REQUIRE(adjustment.adjust(poses));
  CHECK(scenes::max_pose_error(poses, s.truth) < 0.03);
  const std::vector<double> weights = adjustment.weights();
  double weight_of_off = 0;
  std::size_t outvoted = 0;
  for (std::size_t t = 0; t < trees.size(); ++t) {
    const auto is_off = [&](const stem_of_map& o) { return off.count({o.map, o.stem}) > 0; };
    const auto seen = trees.of(t);
    if (2 * std::size_t(std::count_if(seen.begin(), seen.end(), is_off)) >= seen.size()) continue;
    for (std::size_t i = trees.first[t]; i < trees.first[t + 1]; ++i)
      if (is_off(trees.stems[i])) weight_of_off = std::max(weight_of_off, weights[i]), ++outvoted;
  }
  CHECK(outvoted > 4);
  CHECK(weight_of_off < 0.5);
}

TEST_CASE("targets count by their precision, as in dense least squares with all landmarks as unknowns") {
  constexpr double stem_sigma = 0.02, target_sigma = 0.002;  // [m]
  random_source random(7);
  const nine_maps s(stem_sigma, random);
  const tree_observations trees = find_trees(s.seen.maps, all_of(9), s.truth, tree_radii(9));
  const target_observations targets = targets_seen_from(s.truth, 18, target_sigma, random);
  const unknown_poses unknowns(9, first_is_fixed);
  const std::vector<double> deviations(9, stem_sigma);
  tree_adjustment adjustment(s.seen.maps, trees, {}, unknowns, deviations, targets);
  auto poses = s.disturbed(0.05, random);
  REQUIRE(adjustment.adjust(poses));

  const std::vector<double> weights = adjustment.weights(), target_weights = adjustment.target_weights();
  std::vector<dense_adjustment::observation> seen;
  for (std::size_t t = 0; t < trees.size(); ++t)
    for (std::size_t i = trees.first[t]; i < trees.first[t + 1]; ++i)
      seen.push_back({t, trees.stems[i].map,
                      s.seen.maps[trees.stems[i].map].stems.at[trees.stems[i].stem].xy(),
                      weights[i] / (stem_sigma * stem_sigma)});
  for (std::size_t t = 0; t < targets.size(); ++t)
    for (std::size_t i = targets.first[t]; i < targets.first[t + 1]; ++i)
      seen.push_back({trees.size() + t, targets.seen[i].map, targets.seen[i].at.xy(),
                      target_weights[i] / (target_sigma * target_sigma)});
  const dense_adjustment dense(s.truth, seen, trees.size() + targets.size());
  CHECK(scenes::max_pose_error(poses, dense.poses) < 1e-4);  // weights follow residuals until convergence
  const auto covariances = adjustment.covariances();
  std::size_t compared = 0;
  for (std::size_t m = 1; m < 9; ++m)
    for (int i = 0; i < 3; ++i, ++compared) {
      const auto k = 3 * Eigen::Index(m - 1) + i;
      CHECK(covariances[m](i, i) == Approx(dense.inverse(k, k)).epsilon(0.01));
    }
  CHECK(compared == 24);

  tree_adjustment without(s.seen.maps, trees, {}, unknowns, deviations);
  auto by_trees = s.disturbed(0.05, random);
  REQUIRE(without.adjust(by_trees));
  CHECK(covariances[4](0, 0) < 0.5 * without.covariances()[4](0, 0));
}

TEST_CASE("targets of Gaussian errors hardly ever lose their weight") {
  std::size_t observations = 0, left_out = 0;
  for (int survey = 0; survey < 20; ++survey) {
    random_source random(std::uint64_t(40 + survey));
    const nine_maps s(0.02, random);
    const tree_observations trees = find_trees(s.seen.maps, all_of(9), s.truth, tree_radii(9));
    const target_observations targets = targets_seen_from(s.truth, 30, 0.003, random);
    const unknown_poses unknowns(9, first_is_fixed);
    tree_adjustment adjustment(s.seen.maps, trees, {}, unknowns, std::vector<double>(9, 0.02), targets);
    auto poses = s.disturbed(0.05, random);
    REQUIRE(adjustment.adjust(poses));
    for (const double w : adjustment.target_weights()) ++observations, left_out += w < 0.01;
  }
  CHECK(observations > 500);
  CHECK(400 * left_out < observations);
}

TEST_CASE("targets hold maps together that have no trees in common, and one that is wrong displaces none") {
  random_source random(8);
  const auto truth = grid_of_maps(2, random);
  const maps_in_plan seen{std::vector<prepared_stems>(4), {}, {}};
  for (const bool is_wrong : {false, true}) {
    target_observations targets = targets_seen_from(truth, 40, 0.002, random);
    if (is_wrong) targets.seen[targets.first[3] + 1].at.y += 0.4;
    const unknown_poses unknowns(4, first_is_fixed);
    tree_adjustment adjustment(seen.maps, {}, {}, unknowns, std::vector<double>(4, 0.03), targets);
    auto poses = truth;
    for (std::size_t m = 1; m < 4; ++m) poses[m].shift += {0.1, -0.1};
    REQUIRE(adjustment.adjust(poses));
    CHECK(scenes::max_pose_error(poses, truth) < 0.01);
    const std::vector<double> weights = adjustment.target_weights();
    for (std::size_t i = 0; i < weights.size(); ++i)
      CHECK((weights[i] < 0.01) == (is_wrong && i == targets.first[3] + 1));
  }
}

TEST_CASE("covariances are calibrated also where two maps share few trees") {
  double squares = 0;
  constexpr int surveys = 300;
  for (int survey = 0; survey < surveys; ++survey) {
    random_source random(std::uint64_t(100 + survey));
    const std::vector<plan_pose> truth = {{{0, 0}, 0}, {{4, 3}, scenes::any_yaw(random)}};
    const positions forest = scenes::forest_around_grid(1, 12, random);
    const maps_in_plan seen = scenes::see_from(truth, forest, 100, 0.03, random);
    const tree_observations trees = find_trees(seen.maps, all_of(2), truth, tree_radii(2));
    const unknown_poses unknowns(2, first_is_fixed);
    tree_adjustment adjustment(seen.maps, trees, {}, unknowns, std::vector<double>(2, 0.03));
    auto poses = truth;
    REQUIRE(adjustment.adjust(poses));
    const mat3 covariance = adjustment.covariances()[1];
    const vec3 error = {poses[1].shift.x - truth[1].shift.x, poses[1].shift.y - truth[1].shift.y,
                        wrapped(poses[1].yaw - truth[1].yaw)};
    squares += error.dot(covariance.inverse() * error) / 3;
  }
  CHECK(std::sqrt(squares / surveys) > 0.8);
  CHECK(std::sqrt(squares / surveys) < 1.4);  // as of Student's t
}

}  // namespace globalmatch::test_tree_adjustment
