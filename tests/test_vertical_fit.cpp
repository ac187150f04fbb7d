#include "globalmatch/detail/matching/vertical_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "catch.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_vertical_fit {

using namespace detail;

namespace {

using scenes::four;
using scenes::set_in_order;
using scenes::uniform;

constexpr double degree = std::numbers::pi / 180;

/// Two maps of the same stems on rolling ground, and a hypothesis that is right in plan, or nearly so.
struct matched_maps {
  position_set source, target;
  matching_context maps;
  local_hypothesis h;

  matched_maps(const scenes::positions& from, const scenes::positions& to,
               const scenes::transform_of_scene& in_plan)
      : source(set_in_order(from)), target(set_in_order(to)), maps(source, target, true, four) {
    h.target_from_source = in_plan;
    h.inlier_threshold = 0.3;
    for (stem_index i = 0; i < from.size(); ++i) h.correspondences.push_back({i, i});
  }
};

/// Where a transform puts stems, in height on average.
double height_error(const rigid& transform, const Eigen::Isometry3d& truth, const scenes::positions& stems) {
  double sum = 0;
  for (const Eigen::Vector3d& p : stems) sum += (transform * from_eigen(p)).z - (truth * p).z();
  return sum / double(stems.size());
}

const scenes::transform_of_scene truth = scenes::yaw_and_shift(2.1, {30, -20, 4});

scenes::positions stems_of(std::uint64_t seed, std::size_t count = 60) {
  random_source random(seed);
  return scenes::random_stems(random, count, 40, 30);
}

/// The transform in plan, whose height is off.
scenes::transform_of_scene with_wrong_height() {
  scenes::transform_of_scene t = truth;
  t.translation().z() += 2.7;
  return t;
}

}  // namespace

TEST_CASE("level maps give the height of the transform, and how uncertain it is") {
  double squares = 0;
  int level = 0;
  constexpr int trials = 300;
  for (int i = 0; i < trials; ++i) {
    random_source random(std::uint64_t(i + 1));
    const scenes::positions stems = stems_of(std::uint64_t(i + 1), 25);
    scenes::positions target = scenes::noisy(scenes::moved(truth, stems), 0.03, random);
    for (Eigen::Vector3d& p : target) p.z() += 0.1 * random.normal();
    matched_maps pair(stems, target, with_wrong_height());
    const local_vertical_fit result = fit_vertical(pair.h, pair.maps, true);
    CHECK(result.fit.source == vertical_source::stems);
    if (result.fit.kind == vertical_kind::level)
      ++level,
          squares += std::pow(height_error(pair.h.target_from_source, truth, stems) / result.fit.sigma, 2);
  }
  CHECK(level >= 297);
  CHECK(std::sqrt(squares / level) > 0.8);
  CHECK(std::sqrt(squares / level) < 1.25);
}

TEST_CASE("a rotated scan is rotated back, by positions in plan where the ground has relief") {
  for (const double tilt : {1.0, 3.0, 10.0}) {
    random_source random(11);
    const scenes::positions stems = stems_of(11);
    const Eigen::Isometry3d tilted(Eigen::AngleAxisd(tilt * degree, Eigen::Vector3d(2, -1, 0).normalized()));
    const Eigen::Isometry3d all = truth * tilted.inverse();
    matched_maps pair(scenes::moved(tilted, scenes::noisy(stems, 0.005, random)), scenes::moved(truth, stems),
                      truth);
    const local_vertical_fit result = fit_vertical(pair.h, pair.maps, true);
    REQUIRE(result.fit.kind == vertical_kind::rotated);
    CHECK(result.fit.tilt == Approx(tilt * degree).epsilon(0.02));
    REQUIRE(result.covariance);
    double worst = 0;
    for (const Eigen::Vector3d& p : scenes::moved(tilted, stems))
      worst = std::max(
          worst, (pair.h.target_from_source * from_eigen(p) - from_eigen(Eigen::Vector3d(all * p))).norm());
    CHECK(worst < 0.02);
  }
}

TEST_CASE("a rotated scan whose stems know their heights badly has no known height") {
  const scenes::positions stems = stems_of(11);
  const Eigen::Isometry3d tilted(Eigen::AngleAxisd(3 * degree, Eigen::Vector3d(2, -1, 0).normalized()));
  const auto fit_with = [&](double height_sigma) {
    random_source random(11);
    matched_maps pair(scenes::moved(tilted, scenes::noisy(stems, 0.005, random)), scenes::moved(truth, stems),
                      truth);
    pair.source.height_sigma.assign(stems.size(), height_sigma);
    const local_vertical_fit result = fit_vertical(pair.h, pair.maps, true);
    REQUIRE(result.fit.kind == vertical_kind::rotated);
    REQUIRE(result.covariance);
    return result;
  };
  const local_vertical_fit sure = fit_with(0.02), unsure = fit_with(0.5), unknown = fit_with(5);
  CHECK(sure.fit.is_known());
  CHECK(unsure.fit.is_known());
  CHECK(unsure.fit.sigma ==
        Approx(std::sqrt(0.1) * 0.5).epsilon(0.05));  // the share that stems have in common
  CHECK((*unsure.covariance)(2, 2) == Approx(unsure.fit.sigma * unsure.fit.sigma));
  CHECK_FALSE(unknown.fit.is_known());
  CHECK(unknown.fit.sigma == std::numeric_limits<double>::infinity());
  CHECK_FALSE(unknown.fit.reason.empty());
  CHECK((*unknown.covariance)(2, 2) == Approx(1e6));
}

TEST_CASE("a 6-DoF hypothesis has the uncertainty that its stems' heights have in common") {
  const scenes::positions stems = stems_of(11);
  const auto fit_with = [&](double height_sigma) {
    matched_maps pair(stems, scenes::moved(truth, stems), truth);
    pair.target.height_sigma.assign(stems.size(), height_sigma);
    return fit_of_rotated(pair.h, pair.maps).fit;
  };
  CHECK(fit_with(0).is_known());
  CHECK(fit_with(0).sigma == 0);
  CHECK(fit_with(0.5).is_known());
  CHECK(fit_with(0.5).sigma == Approx(std::sqrt(0.1) * 0.5));
  CHECK_FALSE(fit_with(2).is_known());
  CHECK(fit_with(2).kind == vertical_kind::rotated);
}

TEST_CASE("heights that slope while stems fit in plan are wrong heights") {
  random_source random(12);
  const scenes::positions stems = stems_of(12);
  scenes::positions drifting = scenes::noisy(stems, 0.01, random);
  for (Eigen::Vector3d& p : drifting) p.z() += std::tan(3 * degree) * (p.y() - 12);
  matched_maps pair(drifting, scenes::moved(truth, stems), with_wrong_height());
  const rigid before = pair.h.target_from_source;
  const local_vertical_fit result = fit_vertical(pair.h, pair.maps, true);
  CHECK(result.fit.kind == vertical_kind::sloping);
  CHECK(result.fit.tilt == Approx(3 * degree).epsilon(0.05));
  CHECK(rotation_angle(transpose_times(before.rotation, pair.h.target_from_source.rotation)) == 0);
  CHECK(height_error(pair.h.target_from_source, truth, drifting) == Approx(0).margin(3 * result.fit.sigma));
  CHECK(result.fit.sigma > 0.1);  // the slope is in it
}

TEST_CASE("a slope within what heights over the same ground have in common is none") {
  random_source random(22);
  const scenes::positions stems = stems_of(22);
  const auto kind_of = [&](double slope, double sigma) {
    scenes::positions drifting = scenes::noisy(stems, 0.005, random);
    for (Eigen::Vector3d& p : drifting) p.z() += std::tan(slope) * (p.y() - 12);
    matched_maps pair(drifting, scenes::moved(truth, stems), with_wrong_height());
    for (position_set* set : {&pair.source, &pair.target}) set->height_sigma.assign(stems.size(), sigma);
    return fit_vertical(pair.h, pair.maps, true).fit.kind;
  };
  CHECK(kind_of(0.15 * degree, 0) == vertical_kind::sloping);  // 2 cm at the stems
  CHECK(kind_of(0.15 * degree, 0.1) == vertical_kind::level);  // 4.5 cm in common
  CHECK(kind_of(2 * degree, 0.1) == vertical_kind::sloping);
}

TEST_CASE("axes tell the rotation where the ground is flat") {
  random_source random(13);
  scenes::positions flat;
  for (int i = 0; i < 40; ++i)
    flat.push_back({uniform(random, 0, 40), uniform(random, 0, 30), 0.01 * random.normal()});
  const Eigen::Isometry3d tilted(Eigen::AngleAxisd(0.8 * degree, Eigen::Vector3d(1, 3, 0).normalized()));
  matched_maps pair(scenes::noisy(scenes::moved(tilted, flat), 0.01, random), scenes::moved(truth, flat),
                    truth);
  for (std::size_t i = 0; i < flat.size(); ++i) {
    const Eigen::Vector3d axis =
        Eigen::Vector3d(0.05 * random.normal(), 0.05 * random.normal(), 1).normalized();
    const Eigen::Vector3d seen =
        (axis + 0.005 * Eigen::Vector3d(random.normal(), random.normal(), 0)).normalized();
    pair.source.axis.push_back(from_eigen(Eigen::Vector3d(tilted * seen)));
    pair.target.axis.push_back(from_eigen(Eigen::Vector3d(truth.linear() * axis)));
  }
  local_hypothesis without_axes = pair.h;
  const local_vertical_fit result = fit_vertical(pair.h, pair.maps, true);
  CHECK(result.fit.kind == vertical_kind::rotated);
  CHECK(result.fit.tilt == Approx(0.8 * degree).epsilon(0.1));
  // and where they are parallel, heights that slope are wrong
  for (std::size_t i = 0; i < flat.size(); ++i)
    pair.target.axis[i] = from_eigen(Eigen::Vector3d(truth.linear() * to_eigen(pair.source.axis[i])));
  CHECK(fit_vertical(without_axes, pair.maps, true).fit.kind == vertical_kind::sloping);
}

TEST_CASE("axes that heights contradict, or heights of no ground, are no rotation") {
  random_source random(18);
  const Eigen::Isometry3d tilted(Eigen::AngleAxisd(3 * degree, Eigen::Vector3d(1, 2, 0).normalized()));
  const auto give_axes = [&](matched_maps& pair, const Eigen::Isometry3d& source_from_level) {
    for (std::size_t i = 0; i < pair.h.correspondences.size(); ++i) {
      const Eigen::Vector3d axis =
          Eigen::Vector3d(0.02 * random.normal(), 0.02 * random.normal(), 1).normalized();
      pair.source.axis.push_back(from_eigen(Eigen::Vector3d(source_from_level.linear() * axis)));
      pair.target.axis.push_back(from_eigen(Eigen::Vector3d(truth.linear() * axis)));
    }
  };
  scenes::positions flat;
  for (int i = 0; i < 40; ++i)
    flat.push_back({uniform(random, 0, 40), uniform(random, 0, 30), 0.02 * random.normal()});
  matched_maps level(scenes::noisy(flat, 0.01, random), scenes::moved(truth, flat), truth);
  give_axes(level, tilted);
  const local_vertical_fit by_heights = fit_vertical(level.h, level.maps, true);
  CHECK(by_heights.fit.kind == vertical_kind::level);
  CHECK(by_heights.fit.is_known());

  const Eigen::Isometry3d more_tilted(Eigen::AngleAxisd(10 * degree, Eigen::Vector3d(1, 2, 0).normalized()));
  for (int k = 0; k < 8; ++k) {  // by chance the heights of some agree better when turned
    scenes::positions of_trees = scenes::moved(more_tilted, flat);
    for (Eigen::Vector3d& p : of_trees) p.z() += uniform(random, 12, 30);
    matched_maps trees(of_trees, scenes::moved(truth, flat), truth);
    give_axes(trees, more_tilted);
    const local_vertical_fit by_axes = fit_vertical(trees.h, trees.maps, true);
    CHECK_FALSE(by_axes.fit.is_known());
    CHECK(by_axes.fit.kind == vertical_kind::level);
  }
}

TEST_CASE("what stems have in common of the uncertainty of their heights does not average out") {
  const scenes::positions stems = stems_of(19);
  matched_maps pair(stems, scenes::moved(truth, stems), with_wrong_height());
  pair.source.height_sigma.assign(stems.size(), 0.5);
  const local_vertical_fit result = fit_vertical(pair.h, pair.maps, true);
  CHECK(result.fit.kind == vertical_kind::level);
  CHECK(result.fit.sigma == Approx(std::sqrt(0.1) * 0.5).epsilon(0.05));
}

TEST_CASE("the height of a map that slopes is as uncertain as the slope makes it at the stems") {
  random_source random(20);
  scenes::positions along;  // a band from south-west to north-east
  for (int i = 0; i < 40; ++i) {
    const double s = uniform(random, 0, 40);
    along.push_back({s + uniform(random, -2, 2), s + uniform(random, -2, 2), uniform(random, -1, 1)});
  }
  for (const double direction : {1.0, -1.0}) {
    scenes::positions drifting = along;
    for (Eigen::Vector3d& p : drifting)
      p.z() += std::tan(3 * degree) * (p.x() + direction * p.y()) / std::sqrt(2);
    matched_maps pair(drifting, along, scenes::transform_of_scene::Identity());
    const local_vertical_fit result = fit_vertical(pair.h, pair.maps, true);
    REQUIRE(result.fit.kind == vertical_kind::sloping);
    // Stems are 16 m from the middle along the band, 1.2 m across it (root mean squares).
    CHECK(result.fit.sigma == Approx(std::tan(3 * degree) * (direction > 0 ? 16 : 1.2)).epsilon(0.3));
  }
}

TEST_CASE("a caller who forces four degrees of freedom gets no rotation") {
  const scenes::positions stems = stems_of(14);
  const Eigen::Isometry3d tilted(Eigen::AngleAxisd(4 * degree, Eigen::Vector3d::UnitX()));
  matched_maps pair(scenes::moved(tilted, stems), scenes::moved(truth, stems), truth);
  CHECK(fit_vertical(pair.h, pair.maps, false).fit.kind == vertical_kind::sloping);
  CHECK(pair.h.target_from_source.rotation(2, 2) == Approx(1));
}

TEST_CASE("heights of trees, missing heights and ignored ones leave the height unknown") {
  const scenes::positions stems = stems_of(15);
  const auto expect_unknown = [&](const matched_maps& pair, bool ignored) {
    local_hypothesis h = pair.h;
    const local_vertical_fit result = fit_vertical(h, pair.maps, true, ignored);
    CHECK(result.fit.source == vertical_source::none);
    CHECK_FALSE(result.fit.is_known());
    CHECK_FALSE(result.fit.reason.empty());
    CHECK(result.fit.sigma == std::numeric_limits<double>::infinity());
  };
  random_source random(16);
  scenes::positions of_trees = stems;
  for (Eigen::Vector3d& p : of_trees) p.z() = uniform(random, 12, 30);
  expect_unknown({of_trees, scenes::moved(truth, stems), truth}, false);
  matched_maps missing(stems, scenes::moved(truth, stems), truth);
  missing.source.has_heights = false;
  expect_unknown(missing, false);
  expect_unknown({stems, scenes::moved(truth, stems), truth}, true);
}

TEST_CASE("stems whose heights are less certain count less") {
  const scenes::positions stems = stems_of(17, 12);
  scenes::positions target = scenes::moved(truth, stems);
  matched_maps pair(stems, target, with_wrong_height());
  random_source random(17);
  for (std::size_t i = 0; i < stems.size(); ++i) {
    const bool hidden = i % 2 == 0;
    pair.source.height_sigma.push_back(hidden ? 0.5 : 0.01);
    pair.target.at[i].z += hidden ? 0.4 : 0.01 * random.normal();
  }
  fit_vertical(pair.h, pair.maps, true);
  CHECK(std::abs(height_error(pair.h.target_from_source, truth, stems)) < 0.15);
}

}  // namespace globalmatch::test_vertical_fit
