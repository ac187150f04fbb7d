#include "globalmatch/survey.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "catch.hpp"
#include "made_up_maps.hpp"
#include "position_types.hpp"
#include "rioja_plots.hpp"
#include "support/stem_files.hpp"
#include "survey_layouts.hpp"

namespace globalmatch::test_survey {

using namespace detail;

using benchmarks::plant;
using benchmarks::survey_from;
using benchmarks::survey_layout;
using benchmarks::surveyed_map;
using scenes::positions;
using status = survey::status;

namespace {

/// Of 1.5 cm of noise, so that the errors of all poses are well below 3 cm.
constexpr survey_layout precise = {.noise = 0.015};

/// Maps of a forest of `side` by `side` [m], row by row.
std::vector<surveyed_map> maps_of_forest(double side, random_source& random,
                                         const survey_layout& layout = precise, int stand = 0) {
  const positions trees = plant("spaced", side, side, random);
  return survey_stand(trees, layout, std::numeric_limits<std::size_t>::max(), random, stand);
}

std::vector<positions> stems_of(const std::vector<surveyed_map>& maps) {
  std::vector<positions> stems;
  for (const surveyed_map& m : maps) stems.push_back(m.stems);
  return stems;
}

/// The scan that the frame of a component is that of.
std::size_t reference_of(const survey& result, int component) {
  for (std::size_t m = 0; m < result.scans.size(); ++m)
    if (result.scans[m].component == component && result.scans[m].status == status::placed &&
        result.scans[m].survey_from_scan.matrix() == Eigen::Matrix4d::Identity() &&
        result.scans[m].uncertainty && result.scans[m].uncertainty->covariance(0, 0) == 0)
      return m;
  FAIL("no reference");
  return 0;
}

/// Distance [m] of the scan's origin from where the truth has it, in plan and in height.
struct pose_error {
  double plan = 0, height = 0;
};
pose_error error_of(const survey& result, const std::vector<surveyed_map>& maps, std::size_t m) {
  const surveyed_map& reference = maps[reference_of(result, result.scans[m].component)];
  const Eigen::Isometry3d truth = reference.stand_from_scan.inverse() * maps[m].stand_from_scan;
  const Eigen::Vector3d off = result.scans[m].survey_from_scan.translation() - truth.translation();
  return {off.head<2>().norm(), std::abs(off.z())};
}

/// Every map is placed, in one component, within 3 cm.
void check_all_placed(const survey& result, const std::vector<surveyed_map>& maps) {
  REQUIRE(result.scans.size() == maps.size());
  CHECK(result.components == 1);
  for (std::size_t m = 0; m < maps.size(); ++m) {
    INFO("map " << m << " " << result.scans[m].reason);
    REQUIRE(result.scans[m].status == status::placed);
    CHECK(result.scans[m].component == 0);
    CHECK(result.scans[m].reason.empty());
    const pose_error error = error_of(result, maps, m);
    CHECK(error.plan < 0.03);
    CHECK(error.height < 0.03);
  }
}

/// Whether two surveys are the same bits.
bool are_equal(const survey& a, const survey& b) {
  if (a.scans.size() != b.scans.size() || a.links.size() != b.links.size() ||
      a.trees.size() != b.trees.size() || a.candidates != b.candidates)
    return false;
  bool equal = true;
  for (std::size_t m = 0; m < a.scans.size(); ++m) {
    const auto &s = a.scans[m], &t = b.scans[m];
    equal = equal && s.status == t.status && s.survey_from_scan.matrix() == t.survey_from_scan.matrix() &&
            s.links == t.links && s.uncertainty.has_value() == t.uncertainty.has_value() &&
            (!s.uncertainty || s.uncertainty->covariance == t.uncertainty->covariance);
  }
  for (std::size_t l = 0; l < a.links.size(); ++l)
    equal = equal && a.links[l].source == b.links[l].source && a.links[l].target == b.links[l].target &&
            a.links[l].log10_nfa == b.links[l].log10_nfa && a.links[l].residual == b.links[l].residual;
  for (std::size_t t = 0; t < a.trees.size(); ++t)
    equal = equal && a.trees[t].position == b.trees[t].position &&
            a.trees[t].seen.size() == b.trees[t].seen.size();
  return equal;
}

}  // namespace

TEST_CASE("a survey places every map of a forest within 3 cm") {
  random_source random(1);
  const auto maps = maps_of_forest(90, random);
  const survey result = register_survey(stems_of(maps));
  check_all_placed(result, maps);
  CHECK_FALSE(result.cancelled);
  CHECK(result.candidates >= result.links.size());
  std::vector<std::size_t> links(maps.size());
  std::set<std::pair<std::size_t, std::size_t>> pairs;
  std::size_t closed = 0;  // links
  for (std::size_t l = 0; l < result.links.size(); ++l) {
    const survey::link& link = result.links[l];
    if (l > 0)
      CHECK(std::pair(result.links[l - 1].source, result.links[l - 1].target) <
            std::pair(link.source, link.target));
    CHECK(pairs.insert(std::minmax(link.source, link.target)).second);
    if (!link.used) continue;
    ++links[link.source], ++links[link.target];
    CHECK(link.correspondences >= 4);
    CHECK(link.residual < 0.2);
    CHECK(link.sigma_plan > 5e-4);
    CHECK(link.sigma_plan < 0.05);
    CHECK(link.sigma_yaw > 5e-5);
    CHECK(link.sigma_yaw < 0.01);
    CHECK_FALSE(link.closure > 0.2);
    closed += link.closure < 0.05;
    const Eigen::Isometry3d adjusted =
        result.scans[link.target].survey_from_scan.inverse() * result.scans[link.source].survey_from_scan;
    CHECK((adjusted.inverse() * link.target_from_source).translation().norm() < 1);
  }
  CHECK(2 * closed > result.links.size());
  for (std::size_t m = 0; m < maps.size(); ++m) {
    CHECK(result.scans[m].links == links[m]);
    CHECK(result.scans[m].check_median < 0.08);
    CHECK(result.scans[m].check_worst >= result.scans[m].check_median);
    CHECK(result.scans[m].is_height_known);
  }
}

TEST_CASE("maps that are much noisier than most are placed, and the others are as precise as without them") {
  random_source random(31);
  const positions trees = plant("spaced", 90, 90, random);
  auto maps = survey_stand(trees, precise, 100, random);
  survey_layout noisy = precise;
  noisy.noise = 0.12;
  for (std::size_t m = 1; m < maps.size(); m += 4) {
    const benchmarks::tree_cells cells(trees, noisy.max_range);
    const Eigen::Vector2d station = maps[m].stand_from_scan.translation().head<2>();
    maps[m] = survey_from(trees, cells, station, noisy, random);
  }
  const survey result = register_survey(stems_of(maps));
  for (std::size_t m = 0; m < maps.size(); ++m) {
    INFO("map " << m << " " << result.scans[m].reason);
    REQUIRE(result.scans[m].status == status::placed);
    const pose_error error = error_of(result, maps, m);
    const double sigma = std::sqrt(result.scans[m].uncertainty->covariance(0, 0));
    CHECK(error.plan < (m % 4 == 1 ? 0.12 : 0.03));
    CHECK(sigma < (m % 4 == 1 ? 0.06 : 0.015));
    if (m % 4 == 1) CHECK(sigma > 0.008);
  }
}

TEST_CASE("scans beside extracts of a census that repeat its errors are placed, as well as pair by pair") {
  const std::filesystem::path folder = std::filesystem::path(GLOBALMATCH_SHARED_DATA) / "stem_maps";
  if (!std::filesystem::exists(folder / "rioja_transforms.csv")) {
    WARN("skipped: there is no " << folder.string());
    return;
  }
  const auto references = scenes::read_rioja_transforms(folder / "rioja_transforms.csv");
  std::vector<positions> maps;
  for (const auto& [plot, reference] : references)
    for (const char* const kind : {"_tls.csv", "_field.csv"}) {
      maps.emplace_back();
      for (const support::stem_record& s : support::read_stems(folder / ("rioja_" + plot + kind)).stems)
        maps.back().push_back({s.x, s.y, 0});
    }
  const survey result = register_survey(maps);
  std::size_t scan = 0;
  for (const auto& [plot, reference] : references) {
    INFO("plot " << plot);
    REQUIRE(result.scans[scan].status == status::placed);
    REQUIRE(result.scans[scan + 1].status == status::placed);
    const Eigen::Isometry3d field_from_scan =
        result.scans[scan + 1].survey_from_scan.inverse() * result.scans[scan].survey_from_scan;
    const double yaw = std::atan2(field_from_scan(1, 0), field_from_scan(0, 0));
    CHECK(std::abs(std::remainder(yaw - reference.yaw, 2 * std::numbers::pi)) < std::numbers::pi / 180);
    CHECK((field_from_scan.translation().head<2>() - reference.shift).norm() < 0.3);
    scan += 2;
  }
}

TEST_CASE("trees of a survey are where they are, with their radii, from one stem a scan") {
  random_source random(2);
  const auto maps = maps_of_forest(70, random);
  std::vector<std::vector<benchmarks::measured_stem>> stems(maps.size());
  const auto radius_of = [](std::size_t tree) { return 0.1 + 0.001 * double(tree % 100); };
  for (std::size_t m = 0; m < maps.size(); ++m)
    for (std::size_t i = 0; i < maps[m].stems.size(); ++i) {
      const Eigen::Vector3d& p = maps[m].stems[i];
      const std::size_t tree = maps[m].trees[i];
      stems[m].push_back({p.x(), p.y(), p.z(), tree == benchmarks::no_tree ? 0 : radius_of(tree)});
    }
  const survey result = register_survey(stems);
  check_all_placed(result, maps);
  std::map<std::size_t, positions> seen_at;
  const Eigen::Isometry3d survey_from_stand = maps[reference_of(result, 0)].stand_from_scan.inverse();
  std::set<std::pair<std::size_t, std::size_t>> observations;
  std::size_t wrong = 0, shared = 0, beyond = 0, uncertain = 0;
  for (const survey::tree& t : result.trees) {
    CHECK(t.component == 0);
    std::set<std::size_t> scans, trees;
    Eigen::Vector3d truth = Eigen::Vector3d::Zero();
    for (const survey::observation& o : t.seen) {
      CHECK(scans.insert(o.scan).second);
      CHECK(observations.insert({o.scan, o.stem}).second);
      trees.insert(maps[o.scan].trees[o.stem]);
      truth += survey_from_stand * maps[o.scan].stand_from_scan * maps[o.scan].stems[o.stem] /
               double(t.seen.size());
    }
    if (t.seen.size() < 2) continue;
    ++shared;
    wrong += trees.size() > 1;
    if (trees.size() > 1 || *trees.begin() == benchmarks::no_tree) continue;
    CHECK(t.radius == Approx(radius_of(*trees.begin())));
    CHECK((t.position - truth).norm() < 0.1);
    CHECK(t.sigma < 0.1);
    uncertain += t.sigma > 0.05;  // of stems that hardly agree, which count less
    beyond += (t.position - truth).head<2>().norm() > 3 * t.sigma;
  }
  CHECK(shared > 200);
  CHECK(wrong * 50 < shared);
  CHECK(beyond * 20 < shared);
  CHECK(uncertain * 50 < shared);
}

TEST_CASE("covariances of a survey are calibrated, in plan and in height") {
  double squares = 0, height_squares = 0;
  std::size_t count = 0;
  for (const std::uint64_t seed : {3u, 4u}) {
    random_source random(seed);
    const auto maps = maps_of_forest(165, random, {});
    const survey result = register_survey(stems_of(maps));
    const Eigen::Isometry3d survey_from_stand = maps[reference_of(result, 0)].stand_from_scan.inverse();
    for (std::size_t m = 0; m < maps.size(); ++m) {
      REQUIRE(result.scans[m].status == status::placed);
      const auto& u = *result.scans[m].uncertainty;
      if (u.covariance(0, 0) == 0) continue;
      const Eigen::Isometry3d truth = survey_from_stand * maps[m].stand_from_scan,
                              off = result.scans[m].survey_from_scan * truth.inverse();
      const Eigen::Vector3d shift = off * u.center - u.center;
      const Eigen::Vector3d error(shift.x(), shift.y(), std::atan2(off(1, 0), off(0, 0)));
      Eigen::Matrix3d covariance;
      const Eigen::Index of[] = {0, 1, 3};
      for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r) covariance(r, c) = u.covariance(of[r], of[c]);
      squares += error.dot(covariance.inverse() * error) / 3;
      height_squares += shift.z() * shift.z() / u.covariance(2, 2);
      ++count;
    }
  }
  CHECK(count > 95);
  CHECK(std::sqrt(squares / double(count)) > 0.8);
  CHECK(std::sqrt(squares / double(count)) < 1.25);
  CHECK(std::sqrt(height_squares / double(count)) > 0.7);
  CHECK(std::sqrt(height_squares / double(count)) < 1.3);
}

TEST_CASE("the reference that was asked for has the identity pose") {
  random_source random(5);
  const auto maps = maps_of_forest(70, random);
  for (const std::size_t reference : {std::size_t(0), maps.size() - 1}) {
    const survey result = register_survey(stems_of(maps), {.reference = reference});
    check_all_placed(result, maps);
    CHECK(result.scans[reference].survey_from_scan.matrix() == Eigen::Matrix4d::Identity());
    CHECK(reference_of(result, 0) == reference);
  }
  CHECK_THROWS_WITH(register_survey(stems_of(maps), {.reference = maps.size()}),
                    Catch::Contains("reference"));
  CHECK_THROWS_AS(register_survey(std::vector<positions>(), {.reference = 0}), std::invalid_argument);
  CHECK_THROWS_WITH(register_survey(stems_of(maps), {.max_nfa = 0}), Catch::Contains("max_nfa"));
}

TEST_CASE("several fixed scans keep their poses, and the others are adjusted between them") {
  random_source random(41);
  const auto maps = maps_of_forest(90, random);
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();  // a national grid
  frame.linear() = Eigen::AngleAxisd(2.5, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  frame.translation() = Eigen::Vector3d(431000, 5621000, 300);
  survey_options options;
  for (const std::size_t m : {std::size_t(0), maps.size() / 2, maps.size() - 1})
    options.fixed.push_back({m, frame * maps[m].stand_from_scan});
  const survey result = register_survey(stems_of(maps), options);
  for (const auto& f : options.fixed) {
    CHECK(result.scans[f.scan].status == status::placed);
    CHECK(result.scans[f.scan].survey_from_scan.matrix() == f.survey_from_scan.matrix());
    CHECK(result.scans[f.scan].uncertainty->covariance.norm() == 0);
  }
  for (std::size_t m = 0; m < maps.size(); ++m) {
    REQUIRE(result.scans[m].status == status::placed);
    const Eigen::Vector3d off =
        result.scans[m].survey_from_scan.translation() - frame * maps[m].stand_from_scan.translation();
    CHECK(off.norm() < 0.03);
  }
  const survey one = register_survey(stems_of(maps), {.fixed = {options.fixed[0]}});
  CHECK(result.scans[maps.size() - 2].uncertainty->covariance(0, 0) <
        one.scans[maps.size() - 2].uncertainty->covariance(0, 0));
}

TEST_CASE(
    "a fixed scan that contradicts others, in plan, height, yaw or tilt, is placed where its stems are") {
  random_source random(42);
  const auto maps = maps_of_forest(90, random);
  const auto turn = [](double angle, const Eigen::Vector3d& axis) {
    return Eigen::Isometry3d(Eigen::AngleAxisd(angle, axis));
  };
  const std::vector<Eigen::Isometry3d> errors = {
      Eigen::Isometry3d(Eigen::Translation3d(0.07, 0, 0)), Eigen::Isometry3d(Eigen::Translation3d(4, 0, 0)),
      Eigen::Isometry3d(Eigen::Translation3d(0, 0, 0.5)), turn(0.1, Eigen::Vector3d::UnitZ()),
      turn(0.05, Eigen::Vector3d::UnitX())};
  for (std::size_t e = 0; e < errors.size(); ++e) {
    survey_options options;
    for (const std::size_t m : {0u, 3u, 9u}) options.fixed.push_back({m, maps[m].stand_from_scan});
    options.fixed[1].survey_from_scan = options.fixed[1].survey_from_scan * errors[e];
    const survey result = register_survey(stems_of(maps), options);
    CHECK(result.scans[3].fixed_distance > 0.05);
    CHECK(std::isnan(result.scans[0].fixed_distance));
    CHECK(std::isnan(result.scans[9].fixed_distance));
    for (std::size_t m = 0; m < maps.size(); ++m) {
      INFO("error " << e << ", map " << m);
      REQUIRE(result.scans[m].status == status::placed);
      const Eigen::Vector3d off =
          result.scans[m].survey_from_scan.translation() - maps[m].stand_from_scan.translation();
      CHECK(off.norm() < 0.03);
    }
  }
}

TEST_CASE("fixed scans, priors and levels that make no sense are refused by name") {
  const std::vector<positions> maps(2, positions{{0, 0, 0}, {3, 0, 0}});
  survey_options options;
  options.fixed = {{2, Eigen::Isometry3d::Identity()}};
  CHECK_THROWS_WITH(register_survey(maps, options), Catch::Contains("fixed"));
  options.fixed = {{1, Eigen::Isometry3d::Identity()}, {1, Eigen::Isometry3d::Identity()}};
  CHECK_THROWS_WITH(register_survey(maps, options), Catch::Contains("fixed"));
  options.fixed = {};
  options.priors = {{.scan = 5}};
  CHECK_THROWS_WITH(register_survey(maps, options), Catch::Contains("priors"));
  options.priors = {{.scan = 1, .sigma_plan = 0}};
  CHECK_THROWS_WITH(register_survey(maps, options), Catch::Contains("priors"));
  options.priors = {};
  for (const std::vector<survey_options::level>& levels : std::vector<std::vector<survey_options::level>>{
           {{.scan = 2}}, {{.scan = 1}, {.scan = 1}}, {{.scan = 1, .sigma = 0}}}) {
    options.levels = levels;
    CHECK_THROWS_WITH(register_survey(maps, options), Catch::Contains("levels"));
  }
}

TEST_CASE("forests that have nothing in common are components of their own, and an alien is not placed") {
  random_source random(6);
  auto maps = maps_of_forest(80, random);
  const std::size_t first = maps.size();
  for (const surveyed_map& m : maps_of_forest(60, random, precise, 1)) maps.push_back(m);
  const std::size_t second = maps.size() - first;
  const positions elsewhere = plant("random", 70, 70, random);
  maps.push_back(survey_from(elsewhere, {elsewhere, 40}, {35, 35}, {}, random));
  maps.back().stand = 2;
  const survey result = register_survey(stems_of(maps));
  CHECK(result.components >= 2);
  REQUIRE(first > second);
  for (std::size_t m = 0; m + 1 < maps.size(); ++m) {
    CHECK(result.scans[m].status == status::placed);
    CHECK(result.scans[m].component == maps[m].stand);
    CHECK(error_of(result, maps, m).plan < 0.03);
  }
  CHECK(result.scans.back().status != status::placed);
  CHECK_FALSE(result.scans.back().reason.empty());
  CHECK_FALSE(result.scans.back().uncertainty);
  for (const survey::tree& t : result.trees)
    for (const survey::observation& o : t.seen) CHECK(result.scans[o.scan].component == t.component);
}

TEST_CASE("scans from one spot do not support each other's chance resemblance to an alien") {
  std::size_t aliens_placed = 0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    random_source random(seed);
    std::vector<positions> stems;
    survey_layout layout;
    layout.max_range = 20;
    const positions trees = plant("random", 60, 60, random);
    for (int i = 0; i < 8; ++i) {
      const Eigen::Vector2d station(30 + random.normal(), 30 + random.normal());
      stems.push_back(survey_from(trees, {trees, 40}, station, layout, random).stems);
    }
    const std::size_t own = stems.size();
    for (int i = 0; i < 12; ++i) {
      const positions others = plant("random", 60, 60, random);
      stems.push_back(survey_from(others, {others, 40}, {30, 30}, layout, random).stems);
    }
    const survey result = register_survey(stems);
    for (std::size_t m = 0; m < stems.size(); ++m)
      if (m < own)
        CHECK(result.scans[m].status == status::placed);
      else
        aliens_placed += result.scans[m].status == status::placed;
  }
  CHECK(aliens_placed == 0);
}

TEST_CASE("a map of two places is ambiguous, with both as guesses, and displaces no other") {
  random_source random(16);
  auto maps = maps_of_forest(110, random);
  const std::size_t count = maps.size(), one = 6, other = count - 7;  // neither sees the other
  const auto of_one = maps[one].stand_from_scan, of_other = maps[other].stand_from_scan;
  surveyed_map both = maps[one];
  for (const Eigen::Vector3d& p : maps[other].stems) both.stems.push_back(p);
  maps.push_back(both);
  const survey result = register_survey(stems_of(maps), {.reference = 0});
  for (std::size_t m = 0; m < count; ++m) {
    REQUIRE(result.scans[m].status == status::placed);
    CHECK(error_of(result, maps, m).plan < 0.03);
  }
  const survey::scan& scan = result.scans.back();
  REQUIRE(scan.status == status::ambiguous);
  CHECK(scan.component == -1);
  CHECK_FALSE(scan.uncertainty);
  REQUIRE(scan.alternatives.size() >= 1);
  const Eigen::Isometry3d survey_from_stand = maps[0].stand_from_scan.inverse();
  const auto distance = [&](const Eigen::Isometry3d& guess, const Eigen::Isometry3d& stand_from_scan) {
    return (guess.translation() - (survey_from_stand * stand_from_scan).translation()).norm();
  };
  const double to_one = distance(scan.survey_from_scan, of_one),
               to_other = distance(scan.survey_from_scan, of_other);
  CHECK(std::min(to_one, to_other) < 0.2);
  CHECK(distance(scan.alternatives[0], to_one < to_other ? of_other : of_one) < 0.2);
}

TEST_CASE("a map of too few stems for a link has its best guess, in the frame of the survey") {
  random_source random(17);
  auto maps = maps_of_forest(70, random, {.noise = 0.005});
  const std::size_t count = maps.size();
  for (std::size_t m = 0; m < count; ++m) {
    surveyed_map few = maps[m];
    few.stems = scenes::noisy(positions(few.stems.begin(), few.stems.begin() + 5), 0.03, random);
    maps.push_back(few);
  }
  const survey result = register_survey(stems_of(maps), {.max_nfa = 1e-12, .reference = 1});
  std::size_t guessed = 0, right = 0;
  for (std::size_t m = 0; m < maps.size(); ++m) {
    const survey::scan& scan = result.scans[m];
    if (m < count) {
      REQUIRE(scan.status == status::placed);
      continue;
    }
    CHECK(scan.status == status::unplaced);
    CHECK_FALSE(scan.reason.empty());
    if (scan.survey_from_scan.matrix() == Eigen::Matrix4d::Identity()) continue;
    ++guessed;
    const Eigen::Isometry3d truth = maps[1].stand_from_scan.inverse() * maps[m].stand_from_scan;
    right += (scan.survey_from_scan.translation() - truth.translation()).norm() < 0.5;
  }
  CHECK(guessed > 0);
  CHECK(2 * right > guessed);
}

TEST_CASE("surveys of few maps, of small ones and of copies have an answer") {
  random_source random(7);
  const survey none = register_survey(std::vector<positions>());
  CHECK((none.scans.empty() && none.links.empty() && none.trees.empty()));
  CHECK(none.components == 0);

  const positions stems = scenes::random_stems(random, 40, 30, 30);
  const survey one = register_survey(std::vector<positions>{stems});
  REQUIRE(one.scans.size() == 1);
  CHECK(one.scans[0].status == status::placed_alone);
  CHECK(one.scans[0].component == 0);
  CHECK(one.components == 1);

  std::vector<positions> small(6);
  for (std::size_t count = 0; count < 4; ++count)
    small[count].assign(stems.begin(), stems.begin() + long(count));
  small[4] = small[5] = stems;
  const survey few = register_survey(small);
  CHECK(few.scans[0].status == status::no_stems);
  for (const std::size_t m : {1u, 2u, 3u}) {
    CHECK(few.scans[m].status == status::unplaced);
    CHECK(few.scans[m].reason.find(std::to_string(m) + " stems, at least 4") == 0);
    CHECK(few.scans[m].component == -1);
  }
  for (const std::size_t m : {4u, 5u}) {
    CHECK(few.scans[m].status == status::placed);
    CHECK(few.scans[m].survey_from_scan.matrix().isApprox(Eigen::Matrix4d::Identity(), 1e-9));
  }

  const survey copies = register_survey(std::vector<positions>(7, stems));
  CHECK(copies.components == 1);
  CHECK(copies.trees.size() == stems.size());
  for (const auto& scan : copies.scans) {
    REQUIRE(scan.status == status::placed);
    CHECK(scan.survey_from_scan.matrix().isApprox(Eigen::Matrix4d::Identity(), 1e-9));
    CHECK(scan.check_worst < 1e-9);
    for (Eigen::Index i = 0; i < 4; ++i) CHECK(scan.uncertainty->covariance(i, i) >= 0);
  }
  CHECK(register_survey(std::vector<positions>(3)).components == 0);
}

TEST_CASE("a map among others may be there twice") {
  random_source random(8);
  auto maps = maps_of_forest(80, random);
  for (const std::size_t m : {4u, 4u, 0u}) maps.push_back(maps[m]);
  check_all_placed(register_survey(stems_of(maps)), maps);
}

TEST_CASE("stems at one place, or in one line, crash nothing and are not placed at random") {
  random_source random(9);
  std::vector<positions> stems(4);
  stems[0].assign(50, {1, 2, 3});
  for (int i = 0; i < 20; ++i) stems[1].push_back({1.7 * i, 0, 0}), stems[2].push_back({0, 1.7 * i, 0});
  for (int i = 0; i < 20; ++i) stems[3].push_back({0.3 * i * i, 0.1 * i * i, 0});
  const survey result = register_survey(stems);
  for (const std::size_t m : {0u, 1u, 2u, 3u}) CHECK(result.scans[m].status != status::placed);
}

TEST_CASE("positions that are not finite are refused with the number of their map") {
  random_source random(10);
  std::vector<positions> stems(3, scenes::random_stems(random, 10, 20, 20));
  stems[2][4].y() = std::nan("");
  CHECK_THROWS_WITH(register_survey(stems), Catch::Contains("map 2") && Catch::Contains("position 4"));
  stems[2][4].y() = std::numeric_limits<double>::infinity();
  CHECK_THROWS_AS(register_survey(stems), std::invalid_argument);
}

TEST_CASE("a survey is cancelled by the progress callback at any of its calls") {
  random_source random(11);
  const auto stems = stems_of(maps_of_forest(50, random));
  std::size_t calls = 0;
  std::set<std::string> stages;
  const survey whole = register_survey(stems, {}, {.threads = 1, .on_progress = [&](const progress& p) {
                                                     ++calls;
                                                     stages.insert(std::string(p.stage));
                                                     return true;
                                                   }});
  CHECK_FALSE(whole.cancelled);
  CHECK(stages.size() >= 4);
  for (std::size_t last = 0; last < calls; last += std::max<std::size_t>(1, calls / 25)) {
    std::size_t left = last;
    const survey result = register_survey(
        stems, {}, {.threads = 1, .on_progress = [&](const progress&) { return left-- > 0; }});
    if (!result.cancelled) continue;  // polls go by the clock
    CHECK((result.scans.empty() && result.links.empty() && result.trees.empty()));
    CHECK(result.components == 0);
  }
  for (const std::string& stage : stages) {
    const survey result = register_survey(
        stems, {}, {.threads = 2, .on_progress = [&](const progress& p) { return p.stage != stage; }});
    CHECK(result.cancelled);
    CHECK(result.scans.empty());
  }
}

TEST_CASE("a survey has the same bits for any number of threads, and any order of the stems") {
  random_source random(12);
  const auto maps = maps_of_forest(70, random);
  const survey expected = register_survey(stems_of(maps), {}, {.threads = 1});
  for (const int threads : {2, 4})
    CHECK(are_equal(register_survey(stems_of(maps), {}, {.threads = threads}), expected));
  std::vector<positions> reordered;
  for (const surveyed_map& m : maps)
    reordered.push_back(scenes::reordered(m.stems, scenes::random_order(m.stems.size(), random)));
  CHECK(are_equal(register_survey(reordered), expected));
}

TEST_CASE("a survey has the same bits in 1, 2 and 7 parts, in any order, also where some are missing") {
  random_source random(18);
  auto stems = stems_of(maps_of_forest(70, random));
  stems.push_back({{1, 2, 0}});  // too few stems to ask
  const survey expected = register_survey(stems, {}, {.threads = 1});
  for (const std::size_t parts : {1u, 2u, 7u, 40u}) {
    std::vector<survey_matches> matches;
    for (std::size_t i = parts; i-- > 0;) {
      std::stringstream file;
      write_survey_matches(file, match_survey(stems, {i, parts}, {}, {.threads = i % 2 == 0 ? 2 : 1}));
      matches.push_back(read_survey_matches(file));
    }
    CHECK(are_equal(solve_survey(stems, matches), expected));
    std::rotate(matches.begin(), matches.begin() + 1, matches.end());
    matches.pop_back();
    CHECK(are_equal(solve_survey(stems, matches), expected));
  }
  std::vector<survey_matches> overlapping = {match_survey(stems, {1, 2}), match_survey(stems, {1, 3}),
                                             match_survey(stems, {1, 3})};
  CHECK(are_equal(solve_survey(stems, overlapping), expected));
}

TEST_CASE("matches are taken for what they say, and those of other maps or options are refused") {
  random_source random(19);
  auto stems = stems_of(maps_of_forest(50, random));
  std::vector<survey_matches> matches = {match_survey(stems, {0, 2}), match_survey(stems, {1, 2})};
  const survey expected = register_survey(stems);
  CHECK_FALSE(expected.links.empty());
  auto other = matches;
  for (survey_matches& m : other)
    for (std::string& links : m.links) links.assign(16, '\0');  // none was tried, none was found
  const survey unlinked = solve_survey(stems, other);
  CHECK(unlinked.candidates != expected.candidates);
  CHECK_THROWS_WITH(solve_survey(stems, matches, {.max_nfa = 1e-4}), Catch::Contains("options"));
  other[1].links[0].pop_back();
  CHECK_THROWS_AS(solve_survey(stems, other), std::invalid_argument);
  stems[0].pop_back();
  CHECK_THROWS_WITH(solve_survey(stems, matches), Catch::Contains("other maps"));
  CHECK_THROWS_WITH(match_survey(stems, {2, 2}), Catch::Contains("part"));
  CHECK_THROWS_WITH(match_survey(stems, {0, 1}, {.max_nfa = 0}), Catch::Contains("max_nfa"));
  CHECK(match_survey(stems, {0, 1}, {}, {.on_progress = [](const progress&) { return false; }}).cancelled);
}

TEST_CASE("a survey takes positions in any container, whose heights may be unknown") {
  random_source random(13);
  const auto maps = maps_of_forest(60, random);
  const survey expected = register_survey(stems_of(maps));
  check_all_placed(expected, maps);
  const auto check_like = [&](const auto& convert) {
    std::vector<decltype(convert(maps[0].stems))> all;
    for (const surveyed_map& m : maps) all.push_back(convert(m.stems));
    return register_survey(all);
  };
  const auto as_trees = [](const positions& stems) {
    std::vector<scenes::tree> trees;
    for (const auto& p : stems) trees.push_back({p.x(), p.y(), p.z(), "beech"});
    return trees;
  };
  const auto as_arrays = [](const positions& stems) {
    std::vector<std::array<double, 3>> arrays;
    for (const auto& p : stems) arrays.push_back({p.x(), p.y(), p.z()});
    return arrays;
  };
  CHECK(are_equal(check_like(as_trees), expected));
  CHECK(are_equal(check_like(as_arrays), expected));
  const survey flat = check_like([](const positions& stems) {
    std::vector<Eigen::Vector2d> plane;
    for (const auto& p : stems) plane.push_back(p.head<2>());
    return plane;
  });
  REQUIRE(flat.scans.size() == maps.size());
  for (std::size_t m = 0; m < maps.size(); ++m) {
    REQUIRE(flat.scans[m].status == status::placed);
    CHECK_FALSE(flat.scans[m].is_height_known);
    CHECK(flat.scans[m].survey_from_scan.translation().z() == 0);
    CHECK(flat.scans[m].uncertainty->covariance(2, 2) > 1e5);
    CHECK(error_of(flat, maps, m).plan < 0.03);
  }
  for (const survey::tree& t : flat.trees) CHECK(std::isinf(t.height_sigma));
}

TEST_CASE("large coordinates lose nothing") {
  random_source random(14);
  auto maps = maps_of_forest(70, random);
  const survey expected = register_survey(stems_of(maps));
  const Eigen::Vector3d far(5e5, 5e6, 300);
  for (surveyed_map& m : maps) {
    for (Eigen::Vector3d& p : m.stems) p += far;
    m.stand_from_scan = m.stand_from_scan * Eigen::Translation3d(-far);
  }
  const survey result = register_survey(stems_of(maps));
  const Eigen::Isometry3d survey_from_stand = maps[reference_of(result, 0)].stand_from_scan.inverse();
  REQUIRE(result.scans.size() == maps.size());
  REQUIRE(result.trees.size() == expected.trees.size());
  for (std::size_t m = 0; m < maps.size(); ++m) {
    REQUIRE(result.scans[m].status == status::placed);
    const Eigen::Isometry3d truth = survey_from_stand * maps[m].stand_from_scan;
    CHECK((result.scans[m].survey_from_scan * maps[m].stems[0] - truth * maps[m].stems[0]).norm() < 0.2);
    CHECK(result.scans[m].uncertainty->covariance.isApprox(expected.scans[m].uncertainty->covariance, 1e-4));
  }
  for (std::size_t t = 0; t < result.trees.size(); ++t)
    CHECK((result.trees[t].position - far - expected.trees[t].position).norm() < 1e-4);
}

TEST_CASE("stem maps whose up is not z are registered about it, those without ground at unknown heights") {
  random_source random(15);
  auto maps = maps_of_forest(70, random);
  std::vector<stem_map> tilted;
  const std::size_t groundless = 1;
  for (std::size_t m = 0; m < maps.size(); ++m) {
    const Eigen::Isometry3d tilt(Eigen::AngleAxisd(0.02 * double(m), Eigen::Vector3d(2, 1, 0).normalized()));
    maps[m].stems = scenes::moved(tilt, maps[m].stems);
    maps[m].stand_from_scan = maps[m].stand_from_scan * tilt.inverse();
    stem_map map;
    for (const Eigen::Vector3d& p : maps[m].stems) {
      stem s;
      s.position = p;
      s.radius = 0.15;
      map.stems.push_back(s);
    }
    map.up = tilt.linear() * Eigen::Vector3d::UnitZ();
    if (m == groundless) map.terrain.status = ground_status::none;
    tilted.push_back(map);
  }
  for (const std::size_t reference : {std::size_t(4), groundless}) {
    const survey result = register_survey(tilted, {.reference = reference});
    for (std::size_t m = 0; m < maps.size(); ++m) {
      REQUIRE(result.scans[m].status == status::placed);
      const Eigen::Isometry3d truth = maps[reference].stand_from_scan.inverse() * maps[m].stand_from_scan;
      const Eigen::Vector3d off =
          tilted[reference].up.cross(result.scans[m].survey_from_scan.translation() - truth.translation());
      CHECK(off.norm() < 0.03);
      CHECK(result.scans[m].survey_from_scan.linear().isApprox(truth.linear(), 0.003));
      CHECK(result.scans[m].is_height_known == (m != groundless));
      CHECK(result.scans[m].uncertainty->up.isApprox(tilted[reference].up, 1e-9));
      if (reference == groundless) continue;
      const double above =
          tilted[reference].up.dot(result.scans[m].survey_from_scan.translation() - truth.translation());
      if (m != groundless) CHECK(std::abs(above) < 0.03);
    }
    for (const survey::tree& t : result.trees) CHECK(t.radius == 0.15);
  }
}

}  // namespace globalmatch::test_survey
