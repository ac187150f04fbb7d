#include "globalmatch/detail/survey/find_tilts.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "catch.hpp"
#include "globalmatch/survey.hpp"
#include "made_up_maps.hpp"
#include "position_types.hpp"
#include "survey_layouts.hpp"

namespace globalmatch::test_find_tilts {

using namespace detail;

using benchmarks::plant;
using benchmarks::survey_layout;
using benchmarks::surveyed_map;
using scenes::positions;
using status = survey::status;

namespace {

/// Maps of rolling ground, row by row.
std::vector<surveyed_map> maps_on_relief(std::uint64_t seed) {
  random_source random(seed);
  positions trees = plant("spaced", 80, 80, random);
  for (Eigen::Vector3d& t : trees) t.z() = 2 * std::sin(t.x() / 9) + 1.5 * std::cos(t.y() / 7);
  return survey_stand(trees, survey_layout{.noise = 0.01}, std::numeric_limits<std::size_t>::max(), random);
}

std::vector<positions> stems_of(const std::vector<surveyed_map>& maps) {
  std::vector<positions> stems;
  for (const surveyed_map& m : maps) stems.push_back(m.stems);
  return stems;
}

/// The largest distance [m] between where a survey and the truth place the stems of a scan, in the frame of
/// scan 0. `lean`: by which the scan's stems were turned.
double error_at_stems(const survey& result, const std::vector<surveyed_map>& maps, std::size_t scan,
                      const Eigen::Isometry3d& lean = Eigen::Isometry3d::Identity()) {
  const Eigen::Isometry3d truth = maps[0].stand_from_scan.inverse() * maps[scan].stand_from_scan,
                          found = result.scans[0].survey_from_scan.inverse() *
                                  result.scans[scan].survey_from_scan;
  double worst = 0;
  for (const Eigen::Vector3d& stem : maps[scan].stems)
    worst = std::max(worst, (found * (lean * stem) - truth * stem).norm());
  return worst;
}

}  // namespace

TEST_CASE("scans that lean are placed with their tilt, in whatever direction") {
  auto maps = maps_on_relief(1);
  auto leaning = stems_of(maps);
  std::vector<Eigen::Isometry3d> leans(maps.size(), Eigen::Isometry3d::Identity());
  leans[4] = Eigen::AngleAxisd(0.05, Eigen::Vector3d::UnitX());
  leans[7] = Eigen::AngleAxisd(0.03, Eigen::Vector3d(1, -2, 0).normalized());
  for (std::size_t m = 0; m < maps.size(); ++m)
    for (Eigen::Vector3d& stem : leaning[m]) stem = leans[m] * stem;
  const survey result = register_survey(leaning);
  for (std::size_t m = 0; m < maps.size(); ++m) {
    INFO("map " << m);
    REQUIRE(result.scans[m].status == status::placed);
    CHECK(error_at_stems(result, maps, m, leans[m]) < 0.1);
  }
}

TEST_CASE("a survey whose reference leans is as right as another, in the frame of that scan") {
  auto maps = maps_on_relief(2);
  auto leaning = stems_of(maps);
  const Eigen::Isometry3d lean(Eigen::AngleAxisd(0.06, Eigen::Vector3d::UnitY()));
  for (Eigen::Vector3d& stem : leaning[0]) stem = lean * stem;
  const survey result = register_survey(leaning, {.reference = 0});
  CHECK(result.scans[0].survey_from_scan.matrix().isIdentity(1e-12));
  for (std::size_t m = 1; m < maps.size(); ++m) {
    REQUIRE(result.scans[m].status == status::placed);
    const Eigen::Isometry3d truth = lean * maps[0].stand_from_scan.inverse() * maps[m].stand_from_scan;
    for (const Eigen::Vector3d& stem : maps[m].stems)
      REQUIRE((result.scans[m].survey_from_scan * stem - truth * stem).norm() < 0.1);
  }
}

TEST_CASE(
    "maps that are level are not turned, nor is one whose heights slope while its stems in plan do not") {
  const auto maps = maps_on_relief(3);
  auto stems = stems_of(maps);
  const survey level = register_survey(stems);
  for (const survey::scan& s : level.scans) {
    REQUIRE(s.status == status::placed);
    CHECK(s.survey_from_scan(2, 2) > 1 - 1e-12);
  }
  for (Eigen::Vector3d& stem : stems[5]) stem.z() += 0.05 * stem.x();  // a drift
  const survey drifted = register_survey(stems);
  for (std::size_t m = 0; m < maps.size(); ++m) {
    INFO("map " << m);
    REQUIRE(drifted.scans[m].status == status::placed);
    CHECK(drifted.scans[m].survey_from_scan(2, 2) > 1 - 1e-12);
    const Eigen::Vector3d off =
        drifted.scans[m].survey_from_scan.translation() - level.scans[m].survey_from_scan.translation();
    CHECK(off.head<2>().norm() < 0.03);
  }
}

TEST_CASE("a map turned upright keeps where its stems are in the scan") {
  const auto maps = maps_on_relief(4);
  const prepared_stems map = without_triangles(positions_of(maps[0].stems, "map", {}), true, {});
  const prepared_stems upright = turned_upright(map, {0.03, -0.02}, 1.1);
  for (std::size_t i = 0; i < map.stems.size(); ++i)
    CHECK(
        (upright.stems.frame.to_scan(upright.stems.at[i]) - map.stems.frame.to_scan(map.stems.at[i])).norm() <
        1e-12);
  CHECK(angle_between(vec3{0, 0, 1}, upright.stems.frame.rotation * vec3{0, 0, 1}) ==
        Approx(std::hypot(0.03, 0.02)));
}

TEST_CASE("one scan whose vertical is known turns all others upright, though they lean alike") {
  const auto maps = maps_on_relief(5);
  const std::size_t levelled = 4;
  const Eigen::Matrix3d lean_of_stand =
      Eigen::AngleAxisd(std::numbers::pi / 90, Eigen::Vector3d(2, 1, 0).normalized()).matrix();
  auto leaning = stems_of(maps);
  std::vector<Eigen::Isometry3d> leans(maps.size(), Eigen::Isometry3d::Identity());
  for (std::size_t m = 0; m < maps.size(); ++m) {
    if (m == levelled) continue;
    const Eigen::Matrix3d turn = maps[m].stand_from_scan.linear();
    leans[m].linear() = turn.transpose() * lean_of_stand * turn;
    for (Eigen::Vector3d& stem : leaning[m]) stem = leans[m] * stem;
  }
  const survey by_majority = register_survey(leaning, {.reference = levelled});
  CHECK(by_majority.scans[levelled].uncertainty->up.z() ==
        Approx(std::cos(std::numbers::pi / 90)).margin(1e-4));
  const survey result = register_survey(leaning, {.levels = {{.scan = levelled, .sigma = 0.001}}});
  CHECK(result.scans[levelled].survey_from_scan.matrix().isIdentity(1e-12));
  for (std::size_t m = 0; m < maps.size(); ++m) {
    INFO("map " << m << " " << result.scans[m].reason);
    REQUIRE(result.scans[m].status == status::placed);
    CHECK(result.scans[m].uncertainty->up.z() > 1 - 1e-12);
    const Eigen::Isometry3d truth = maps[levelled].stand_from_scan.inverse() * maps[m].stand_from_scan;
    for (const Eigen::Vector3d& stem : maps[m].stems)
      REQUIRE((result.scans[m].survey_from_scan * (leans[m] * stem) - truth * stem).norm() < 0.1);
  }
}

namespace {

/// Links 0-1, 1-2, 2-3 and 4-5. Map 3 leans against map 2, and map 5 against map 4, by 0.03 rad about x.
struct leaning_chain {
  std::vector<survey_link> links{4};
  std::vector<std::optional<relative_tilt>> tilts;

  leaning_chain() {
    const std::uint32_t ends[][2] = {{0, 1}, {1, 2}, {3, 2}, {5, 4}};
    for (std::size_t i = 0; i < 4; ++i) {
      links[i].source = ends[i][0];
      links[i].target = ends[i][1];
      const bool is_rotated = i >= 2;
      tilts.push_back(relative_tilt{is_rotated, {is_rotated ? 0.03 : 0, 0}, 1e-6, 0});
    }
  }
  std::vector<vec2> found(const std::vector<survey_options::level>& levels) const {
    return find_tilts(links, tilts, std::vector<std::uint32_t>{0, 0, 0, 0, 1, 1}, levels);
  }
};

}  // namespace

TEST_CASE(
    "verticals are those of most maps, or the weighted mean of the known ones that links compare them with") {
  const leaning_chain chain;
  const auto by_majority = chain.found({});
  for (std::size_t m = 0; m < 3; ++m) CHECK(by_majority[m].norm() == 0);
  CHECK(by_majority[3].x == Approx(0.03).margin(1e-4));
  const auto by_one = chain.found({{.scan = 3, .sigma = 0.001}});
  for (std::size_t m = 0; m < 3; ++m) CHECK(by_one[m].x == Approx(-0.03).margin(1e-4));
  CHECK(by_one[3].norm() == 0);
  CHECK(by_one[4].x == by_majority[4].x);
  CHECK(by_one[5].x == by_majority[5].x);
  const auto by_two = chain.found({{.scan = 3, .sigma = 0.002}, {.scan = 0, .sigma = 0.001}});
  for (std::size_t m = 0; m < 3; ++m) CHECK(by_two[m].x == Approx(-0.006).margin(1e-4));
  CHECK(by_two[3].x == Approx(0.024).margin(1e-4));
}

}  // namespace globalmatch::test_find_tilts
