#include "globalmatch/survey_refinement.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/survey/adjust_to_pairs.hpp"
#include "globalmatch/survey.hpp"
#include "made_up_maps.hpp"

namespace globalmatch::test_survey_refinement {

using namespace detail;

using scenes::positions;

namespace {

/// Maps of one stand, each in a frame of its own: positions of stems are off by noise, samples by a
/// millimetre.
struct surveyed_stand {
  std::vector<Eigen::Isometry3d> scan_from_stand;
  std::vector<stem_map> maps;

  surveyed_stand(std::size_t count, random_source& random) {
    const positions stems = scenes::random_stems(random, 30, 25, 25);
    const stem_map truth = scenes::made_up_map(stems);
    for (std::size_t m = 0; m < count; ++m) {
      scan_from_stand.push_back(scenes::random_levelled_transform(random));
      stem_map map = truth;
      for (std::size_t i = 0; i < stems.size(); ++i)
        map.stems[i].position =
            scan_from_stand[m] *
            (stems[i] + 0.01 * Eigen::Vector3d(random.normal(), random.normal(), 4 * random.normal()));
      for (auto* samples : {&map.stem_samples, &map.ground_samples}) {
        *samples = scenes::moved(scan_from_stand[m], *samples);
        for (Eigen::Vector3d& p : *samples)
          p += 0.001 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
      }
      maps.push_back(std::move(map));
    }
  }

  auto loader() const {
    return [this](std::size_t m) { return maps[m]; };
  }
};

std::size_t reference_of(const survey& s) {
  for (std::size_t m = 0; m < s.scans.size(); ++m)
    if (s.scans[m].component == 0 && s.scans[m].survey_from_scan.matrix().isIdentity(0)) return m;
  FAIL("no reference");
  return 0;
}

/// Largest errors [m] of poses, at the centroid of the stems.
struct pose_errors {
  double plan = 0, height = 0;

  pose_errors(const survey& s, const surveyed_stand& stand) {
    const std::size_t reference = reference_of(s);
    for (std::size_t m = 0; m < s.scans.size(); ++m) {
      if (!s.scans[m].uncertainty || s.scans[m].component != 0) continue;
      const Eigen::Isometry3d truth = stand.scan_from_stand[reference] * stand.scan_from_stand[m].inverse();
      const Eigen::Vector3d center = truth.inverse() * s.scans[m].uncertainty->center,
                            off = s.scans[m].survey_from_scan * center - truth * center;
      plan = std::max(plan, off.head<2>().norm());
      if (s.scans[m].is_height_known) height = std::max(height, std::abs(off.z()));
    }
  }
};

/// Whether two surveys have the same bits.
bool are_equal(const survey& a, const survey& b) {
  bool equal = a.scans.size() == b.scans.size() && a.trees.size() == b.trees.size();
  for (std::size_t m = 0; m < a.scans.size() && equal; ++m)
    equal =
        a.scans[m].survey_from_scan.matrix() == b.scans[m].survey_from_scan.matrix() &&
        a.scans[m].uncertainty.has_value() == b.scans[m].uncertainty.has_value() &&
        (!a.scans[m].uncertainty || a.scans[m].uncertainty->covariance == b.scans[m].uncertainty->covariance);
  for (std::size_t t = 0; t < a.trees.size() && equal; ++t)
    equal = a.trees[t].position == b.trees[t].position && a.trees[t].sigma == b.trees[t].sigma;
  return equal;
}

std::string bytes_of(const refined_pair& pair) {
  std::ostringstream out;
  write_refined_pair(out, pair);
  return std::move(out).str();
}

}  // namespace

TEST_CASE("refined poses are nearer to the truth, in plan and in height, and know it") {
  for (const auto metric : {icp_metric::point_to_plane, icp_metric::point_to_point}) {
    random_source random(1);
    const surveyed_stand stand(5, random);
    survey s = register_survey(stand.maps);
    const survey before = s;
    const pose_errors start(s, stand);
    refinement_options options;
    options.icp.metric = metric;
    const auto pairs = refine_survey(s, stand.loader(), options);
    const pose_errors refined(s, stand);
    CHECK(start.plan > 0.002);
    CHECK(start.height > 0.005);
    CHECK(refined.plan < 0.0015);
    CHECK(refined.height < 0.0015);
    for (const refined_pair& p : pairs) {
      CHECK(p.is_refined);
      CHECK(p.is_height_refined);
      CHECK(p.reason.empty());
      CHECK(p.samples > 1000);
    }
    const std::size_t reference = reference_of(s);
    for (std::size_t m = 0; m < 5; ++m) {
      const auto &u = s.scans[m].uncertainty->covariance, &v = before.scans[m].uncertainty->covariance;
      if (m == reference) CHECK(u == v);
      if (m != reference) CHECK(u(0, 0) < v(0, 0));
      if (m != reference) CHECK(u(2, 2) < v(2, 2));
    }
  }
}

TEST_CASE("targets hold two stands together while each is refined") {
  random_source random(21);
  const surveyed_stand first(3, random), second(3, random);
  std::vector<stem_map> maps = first.maps;
  maps.insert(maps.end(), second.maps.begin(), second.maps.end());
  std::vector<Eigen::Isometry3d> scan_from_world = first.scan_from_stand;
  for (const Eigen::Isometry3d& t : second.scan_from_stand)
    scan_from_world.push_back(t * Eigen::Translation3d(-60, 0, 0));
  survey_options options;
  const Eigen::Vector3d places[] = {{29, 2, 1}, {33, 10, 3}, {28, 22, 2}};
  for (std::size_t t = 0; t < 3; ++t)
    for (std::size_t m = 0; m < 6; ++m)
      options.targets.push_back(
          {m, "T" + std::to_string(t),
           scan_from_world[m] * places[t] +
               0.001 * Eigen::Vector3d(random.normal(), random.normal(), random.normal()),
           0.001});
  survey s = register_survey(maps, options);
  REQUIRE(s.components == 1);
  refine_survey(s, [&](std::size_t m) { return maps[m]; });
  for (const std::size_t begin : {0u, 3u})
    for (std::size_t m = begin + 1; m < begin + 3; ++m) {
      const Eigen::Isometry3d found = s.scans[begin].survey_from_scan.inverse() * s.scans[m].survey_from_scan,
                              truth = scan_from_world[begin] * scan_from_world[m].inverse();
      const Eigen::Vector3d center = scan_from_world[m] * Eigen::Vector3d(begin == 0 ? 12 : 72, 12, 0);
      CHECK((found * center - truth * center).norm() < 0.002);
    }
  REQUIRE(s.targets.size() == 3);
  for (std::size_t t = 0; t < 3; ++t) {
    std::size_t fitting = 0;
    for (const survey::target_observation& o : s.targets[t].seen) {
      CHECK(o.residual < 0.005);
      fitting += o.weight > 0.2 && o.height_weight > 0.2;
    }
    CHECK(fitting >= 5);
  }
  for (const survey::link& l : s.links)
    if (l.targets > 0) CHECK(l.residual < 0.004);
}

TEST_CASE("trees count by their weight, and targets as much as they are more certain than stems") {
  survey s;
  s.scans.resize(2);
  survey::tree tree;
  tree.seen = {{.scan = 0, .stem = 3, .weight = 0.7}, {.scan = 1, .stem = 4, .weight = 0.9}};
  s.trees = {tree};
  survey::target target;
  target.seen = {{.scan = 0, .sigma = 0.01, .weight = 0.5}, {.scan = 1, .sigma = 0.02, .weight = 1}};
  s.targets = {target};
  const seen_trees seen = levelled_landmarks(s, levelled_survey(s), 0.04);
  REQUIRE(seen.weights.size() == 4);
  CHECK(seen.weights[0] == Approx(0.7));
  CHECK(seen.weights[1] == Approx(0.9));
  CHECK(seen.weights[2] == Approx(8));
  CHECK(seen.weights[3] == Approx(4));
}

TEST_CASE("without icp the ground gives heights, and poses in plan stay") {
  random_source random(2);
  const surveyed_stand stand(4, random);
  survey s = register_survey(stand.maps);
  const survey before = s;
  refinement_options options;
  options.icp.metric = icp_metric::none;
  refine_survey(s, stand.loader(), options);
  CHECK(pose_errors(s, stand).height < 0.003);
  for (std::size_t m = 0; m < 4; ++m) {
    const Eigen::Isometry3d change = s.scans[m].survey_from_scan * before.scans[m].survey_from_scan.inverse();
    CHECK(change.linear().isIdentity(1e-12));
    CHECK((change * s.scans[m].uncertainty->center - s.scans[m].uncertainty->center).head<2>().norm() < 1e-9);
    CHECK(s.scans[m].uncertainty->covariance(0, 0) ==
          Approx(before.scans[m].uncertainty->covariance(0, 0)).margin(1e-15));
  }
}

TEST_CASE("trees and residuals of links follow the poses") {
  random_source random(3);
  const surveyed_stand stand(4, random);
  survey s = register_survey(stand.maps);
  for (survey::scan& scan : s.scans)  // as if the start was off
    if (!scan.survey_from_scan.matrix().isIdentity(0)) scan.uncertainty->covariance *= 100;
  const survey before = s;
  refine_survey(s, stand.loader());
  REQUIRE(s.trees.size() == before.trees.size());
  const std::size_t reference = reference_of(s);
  double start = 0, refined = 0;
  for (std::size_t t = 0; t < s.trees.size(); ++t) {
    const survey::observation& o = s.trees[t].seen[0];
    const Eigen::Vector3d stem = stand.maps[o.scan].stems[o.stem].position;
    Eigen::Vector3d moved = Eigen::Vector3d::Zero();
    for (const survey::observation& seen : s.trees[t].seen)
      moved +=
          (s.scans[seen.scan].survey_from_scan.matrix() - before.scans[seen.scan].survey_from_scan.matrix())
              .topRows<3>() *
          stand.maps[seen.scan].stems[seen.stem].position.homogeneous() / double(s.trees[t].seen.size());
    CHECK(moved.norm() > 1e-4);
    CHECK((s.trees[t].position - before.trees[t].position - moved).norm() < 1e-4);
    const Eigen::Isometry3d truth =
        stand.scan_from_stand[reference] * stand.scan_from_stand[o.scan].inverse();
    start = std::max(start, (before.trees[t].position - truth * stem).head<2>().norm());
    refined = std::max(refined, (s.trees[t].position - truth * stem).head<2>().norm());
  }
  CHECK(refined < 0.04);
  CHECK(start < 0.05);
  for (std::size_t l = 0; l < s.links.size(); ++l) {
    CHECK(s.links[l].residual > 0);
    CHECK(s.links[l].residual < 0.02);
    CHECK(s.links[l].residual != before.links[l].residual);
  }
}

TEST_CASE("a pair that is refined wrongly loses its weight") {
  random_source random(4);
  const surveyed_stand stand(6, random);
  survey s = register_survey(stand.maps);
  survey start = s;
  auto pairs = refine_survey(s, stand.loader());
  refined_pair& wrong = pairs[pairs.size() / 2];
  wrong.target_from_source.pretranslate(Eigen::Vector3d(0.2, -0.1, 0.3));
  apply_refinements(start, pairs);
  const pose_errors errors(start, stand);
  CHECK(errors.plan < 0.002);
  CHECK(errors.height < 0.002);
}

TEST_CASE("icp that moves further than the stems allow is not followed") {
  random_source random(8);
  surveyed_stand stand(5, random);
  for (Eigen::Vector3d& p : stand.maps[1].stem_samples) p.x() += 0.05;
  survey s = register_survey(stand.maps);
  const auto pairs = refine_survey(s, stand.loader());
  for (const refined_pair& p : pairs) {
    const bool is_off = p.start.source == 1 || p.start.target == 1;
    CHECK(p.is_refined == !is_off);
    CHECK(p.is_height_refined);
    if (is_off) CHECK_THAT(p.reason, Catch::Contains("further than the stems allow"));
  }
  CHECK(pose_errors(s, stand).plan < 0.01);
}

TEST_CASE("a scan without ground keeps an unknown height, and the others have theirs") {
  random_source random(6);
  surveyed_stand stand(5, random);
  stand.maps[2].terrain.status = ground_status::none;
  survey s = register_survey(stand.maps, {.reference = 0});
  refine_survey(s, stand.loader());
  for (std::size_t m = 0; m < 5; ++m) CHECK(s.scans[m].is_height_known == (m != 2));
  CHECK(s.scans[2].uncertainty->covariance(2, 2) > 1e5);
  const pose_errors errors(s, stand);
  CHECK(errors.plan < 0.002);
  CHECK(errors.height < 0.002);
}

TEST_CASE("scans whose verticals are those of stems are turned about all axes") {
  random_source random(12);
  surveyed_stand stand(5, random);
  for (std::size_t m = 1; m < 5; ++m) {  // off their verticals by some tenths of a degree
    const Eigen::Isometry3d tilt(
        Eigen::AngleAxisd(0.004, Eigen::Vector3d(random.normal(), random.normal(), 0).normalized()));
    stem_map& map = stand.maps[m];
    Eigen::Vector3d center = Eigen::Vector3d::Zero();
    for (const stem& t : map.stems) center += t.position / double(map.stems.size());
    const Eigen::Isometry3d turn = Eigen::Translation3d(center) * tilt * Eigen::Translation3d(-center);
    for (stem& t : map.stems) t.position = turn * t.position;
    for (auto* samples : {&map.stem_samples, &map.ground_samples}) *samples = scenes::moved(turn, *samples);
    stand.scan_from_stand[m] = turn * stand.scan_from_stand[m];
    map.up_by_stems = true;
  }
  survey s = register_survey(stand.maps, {.reference = 0});
  const auto max_corner_error = [&] {
    double largest = 0;
    for (std::size_t m = 1; m < 5; ++m)
      for (const stem& t : stand.maps[m].stems)
        largest =
            std::max(largest, (s.scans[m].survey_from_scan * t.position -
                               stand.scan_from_stand[0] * stand.scan_from_stand[m].inverse() * t.position)
                                  .norm());
    return largest;
  };
  CHECK(max_corner_error() > 0.04);
  const auto pairs = refine_survey(s, stand.loader());
  for (const refined_pair& p : pairs) CHECK(p.tilt_sigma > 0);
  CHECK(max_corner_error() < 0.006);
}

TEST_CASE("a height that the stems do not determine is that of the ground") {
  random_source random(7);
  surveyed_stand stand(4, random);
  for (stem& t : stand.maps[3].stems) t.position.z() += 0.6;  // of ground that shrubs hide
  survey s = register_survey(stand.maps, {.reference = 0});
  CHECK(pose_errors(s, stand).height > 0.5);
  refine_survey(s, stand.loader());
  CHECK(pose_errors(s, stand).height < 0.002);
}

TEST_CASE(
    "a refinement has the same bits whatever the number of threads, and the same poses in other orders") {
  random_source random(8);
  surveyed_stand stand(5, random);
  survey one = register_survey(stand.maps, {.reference = 0}), four = one;
  refine_survey(one, stand.loader(), {}, {.threads = 1});
  refine_survey(four, stand.loader(), {}, {.threads = 4});
  CHECK(are_equal(one, four));
  std::reverse(stand.maps.begin(), stand.maps.end());
  survey reversed = register_survey(stand.maps, {.reference = 4});
  refine_survey(reversed, stand.loader());
  for (std::size_t m = 0; m < 5; ++m)  // ICP of a pair is not that of the pair the other way
    CHECK((reversed.scans[4 - m].survey_from_scan.matrix() - one.scans[m].survey_from_scan.matrix()).norm() <
          0.003);
}

TEST_CASE("one scan, two, maps without stems, and maps without samples are refined as far as they can be") {
  random_source random(9);
  surveyed_stand stand(2, random);
  survey alone = register_survey(std::vector<stem_map>{stand.maps[0]});
  CHECK(refine_survey(alone, stand.loader()).empty());
  survey none = register_survey(std::vector<stem_map>());
  CHECK(refine_survey(none, stand.loader()).empty());

  survey two = register_survey(stand.maps);
  CHECK(refine_survey(two, stand.loader()).size() == 1);
  CHECK(pose_errors(two, stand).height < 0.003);

  stand.maps.emplace_back();
  survey with_empty = register_survey(stand.maps);
  CHECK(refine_survey(with_empty, stand.loader()).size() == 1);
  CHECK(with_empty.scans[2].status == survey::status::no_stems);

  for (stem_map& map : stand.maps)
    map.stem_samples.clear(), map.stem_normals.clear(), map.ground_samples.clear();
  survey bare = register_survey(stand.maps);
  const survey before = bare;
  const auto pairs = refine_survey(bare, stand.loader());
  REQUIRE(pairs.size() == 1);
  CHECK_FALSE(pairs[0].is_refined);
  CHECK_FALSE(pairs[0].is_height_refined);
  CHECK_FALSE(pairs[0].reason.empty());
  for (std::size_t m = 0; m < 3; ++m)
    CHECK(bare.scans[m].survey_from_scan.isApprox(before.scans[m].survey_from_scan, 1e-12));
}

TEST_CASE("a refined pair that is written and read is the same, and a damaged one is refused") {
  random_source random(10);
  const surveyed_stand stand(3, random);
  survey s = register_survey(stand.maps);
  survey copy = s;
  auto pairs = refine_survey(s, stand.loader());
  pairs[0].provenance = "of these maps";
  std::vector<refined_pair> read;
  for (const refined_pair& p : pairs) {
    std::istringstream in(bytes_of(p));
    read.push_back(read_refined_pair(in));
    CHECK(bytes_of(read.back()) == bytes_of(p));
  }
  CHECK(read[0].provenance == "of these maps");
  apply_refinements(copy, read);
  CHECK(are_equal(copy, s));
  const std::string bytes = bytes_of(pairs[0]);
  for (const std::size_t at : {std::size_t(3), std::size_t(20), bytes.size() - 1}) {
    std::string damaged = bytes;
    damaged[at] = char(damaged[at] ^ 1);
    std::istringstream in(damaged), cut(bytes.substr(0, at));
    CHECK_THROWS_AS(read_refined_pair(in), std::runtime_error);
    CHECK_THROWS_AS(read_refined_pair(cut), std::runtime_error);
  }
}

TEST_CASE("a refinement that is cancelled leaves the survey as it was, and bad options and pairs throw") {
  random_source random(11);
  const surveyed_stand stand(3, random);
  survey s = register_survey(stand.maps);
  const survey before = s;
  execution exec;
  exec.on_progress = [](const progress&) { return false; };
  CHECK(refine_survey(s, stand.loader(), {}, exec).empty());
  CHECK(s.cancelled);
  CHECK(are_equal(s, before));
  CHECK_THROWS_AS(pairs_to_refine(before, {.pairs_per_scan = 0}), std::invalid_argument);
  refinement_options options;
  options.icp.max_iterations = 0;
  CHECK_THROWS_AS(refine_pair(stand.maps[0], stand.maps[1], {}, options), std::invalid_argument);
  std::vector<refined_pair> pairs(1);
  pairs[0].start.source = 7;
  CHECK_THROWS_AS(apply_refinements(s, pairs), std::invalid_argument);
  pairs[0].start.source = 1;
  CHECK_THROWS_WITH(apply_refinements(s, pairs), Catch::Contains("4 x 4"));
  CHECK_THROWS_WITH(refine_pair(stand.maps[0], stand.maps[1], {}), Catch::Contains("4 x 4"));
}

TEST_CASE("components are refined each by itself") {
  random_source random(13);
  const surveyed_stand one(4, random), other(3, random);
  std::vector<stem_map> maps = one.maps;
  maps.insert(maps.end(), other.maps.begin(), other.maps.end());
  survey s = register_survey(maps), alone = register_survey(one.maps);
  REQUIRE(s.components == 2);
  refine_survey(s, [&](std::size_t m) { return maps[m]; });
  refine_survey(alone, one.loader());
  for (std::size_t m = 0; m < 4; ++m)
    CHECK(s.scans[m].survey_from_scan.isApprox(alone.scans[m].survey_from_scan, 1e-6));
  CHECK(pose_errors(s, one).height < 0.002);
}

}  // namespace globalmatch::test_survey_refinement
