#include "globalmatch/detail/matching/lattice_residuals.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "catch.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_lattice_residuals {

using namespace detail;

using scenes::positions;

namespace {

const lattice_shifts jittered_rows{{3, 0}, {0, 3}};

/// Two scans, with 5 cm of noise. Stems keep their order.
struct jittered_scans {
  position_set source, target;
  matching_context maps;

  jittered_scans(const positions& first, const positions& second, random_source& random,
                 bool horizontal = true)
      : source(scenes::set_in_order(scenes::noisy(first, 0.05, random))),
        target(scenes::set_in_order(scenes::noisy(second, 0.05, random))),
        maps(source, target, horizontal, degrees_of_freedom::four) {}
};

rigid shift_of(int columns, int rows) {
  return from_eigen(scenes::yaw_and_shift(0, {3.0 * columns, 3.0 * rows, 0}));
}

/// Trees that were planted 12 cm off their places.
positions planted(int columns, int rows, random_source& random) {
  return scenes::noisy(scenes::lattice(columns, rows, 3), 0.12, random);
}

/// Ground that rolls by some metres, with waves of 12 to 30 m.
positions on_hills(positions stems, random_source& random) {
  const double along_x = scenes::uniform(random, 2, 5), along_y = scenes::uniform(random, 2, 5);
  const double start_x = scenes::uniform(random, -3, 3), start_y = scenes::uniform(random, -3, 3);
  for (Eigen::Vector3d& p : stems)
    p.z() = 2 * std::sin(p.x() / along_x + start_x) + 1.5 * std::cos(p.y() / along_y + start_y);
  return stems;
}

/// Radii that differ by 2 cm, as in most stands.
std::vector<double> any_radii(std::size_t stems, random_source& random) {
  std::vector<double> radii;
  for (std::size_t i = 0; i < stems; ++i) radii.push_back(std::max(0.04, 0.12 + 0.02 * random.normal()));
  return radii;
}

/// The radii as a scan measures them, to 5 mm.
std::vector<double> measured(std::vector<double> radii, random_source& random) {
  for (double& r : radii) r += 0.005 * random.normal();
  return radii;
}

}  // namespace

TEST_CASE(
    "residuals distinguish the true transform from all others of the lattice, wherever the walk starts") {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    CAPTURE(seed);
    random_source random(seed);
    const positions stand = planted(14, 12, random);
    const jittered_scans scans(stand, stand, random);
    for (const rigid& start : {shift_of(0, 0), shift_of(3, -2), shift_of(-8, 5)}) {
      const lattice_residuals residuals(scans.maps, jittered_rows, start);
      CHECK(residuals.score(shift_of(0, 0)).log10_nfa < -5);
      CHECK(residuals.score(shift_of(1, 0)).log10_nfa > -2);
      const auto proposed = residuals.propose(4);
      REQUIRE(!proposed.empty());
      CHECK(proposed.size() <= 4);
      CHECK(proposed.front().correspondences.size() > 150);
      CHECK((to_eigen(proposed.front().target_from_source).matrix() - Eigen::Matrix4d::Identity()).norm() <
            0.1);
    }
  }
}

TEST_CASE("some stems of many are enough") {
  random_source random(1);
  const positions stand = planted(30, 30, random);
  const jittered_scans scans(stand, stand, random);
  const lattice_residuals residuals(scans.maps, jittered_rows, shift_of(4, 1));
  CHECK(residuals.score(shift_of(0, 0)).log10_nfa < -20);
  CHECK(residuals.score(shift_of(1, 0)).log10_nfa > -2);
}

TEST_CASE("residuals of different stands are no evidence") {
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    CAPTURE(seed);
    random_source random(seed);
    const jittered_scans scans(planted(14, 12, random), planted(12, 14, random), random);
    const lattice_residuals residuals(scans.maps, jittered_rows, shift_of(1, 1));
    const auto proposed = residuals.propose(8);
    REQUIRE(proposed.size() == 8);
    for (const local_hypothesis& h : proposed) CHECK(residuals.score(h.target_from_source).log10_nfa > -3);
  }
}

TEST_CASE("rows that bend alike in different stands are no evidence") {
  const auto bent = [](positions stems) {
    for (Eigen::Vector3d& p : stems) p += 0.3 * Eigen::Vector3d(std::sin(p.y() / 9), std::sin(p.x() / 7), 0);
    return stems;
  };
  for (std::uint64_t seed = 1; seed <= 25; ++seed) {
    CAPTURE(seed);
    random_source random(seed);
    const jittered_scans scans(bent(planted(14, 12, random)), bent(planted(12, 14, random)), random);
    const lattice_residuals residuals(scans.maps, jittered_rows, shift_of(1, 1));
    for (const local_hypothesis& h : residuals.propose(8))
      CHECK(residuals.score(h.target_from_source).log10_nfa > -3);
  }
}

TEST_CASE(
    "in perfect rows on level ground the radii determine the true transform, where both maps have them") {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    CAPTURE(seed);
    random_source random(seed);
    const positions stand = scenes::lattice(14, 12, 3);
    const auto radii = any_radii(stand.size(), random);
    jittered_scans scans(stand, stand, random);
    scans.source.radius = measured(radii, random);
    const auto score_of = [&](const rigid& transform) {
      return lattice_residuals(scans.maps, jittered_rows, shift_of(3, -2)).score(transform);
    };
    CHECK(score_of(shift_of(0, 0)).log10_nfa > -2);

    scans.target.radius = measured(radii, random);
    CHECK(score_of(shift_of(0, 0)).log10_nfa < -20);
    CHECK(score_of(shift_of(0, 0)).source == evidence_source::radii);
    CHECK(score_of(shift_of(1, 0)).log10_nfa > -2);
  }
}

TEST_CASE(
    "radii that are larger by as much in one map are the same evidence, and unknown ones are left out") {
  random_source random(1);
  const positions stand = scenes::lattice(14, 12, 3);
  const auto radii = any_radii(stand.size(), random);
  jittered_scans scans(stand, stand, random);
  scans.source.radius = measured(radii, random);
  scans.target.radius = measured(radii, random);
  const auto alarms = [&] {
    return lattice_residuals(scans.maps, jittered_rows, shift_of(3, -2)).score(shift_of(0, 0)).log10_nfa;
  };
  const double before = alarms();
  for (double& r : scans.target.radius) r += 0.03;
  CHECK(alarms() == Approx(before).margin(0.01));

  for (double& r : scans.source.radius)
    if (random.uniform() < 0.5) r = 0;
  CHECK(alarms() < -10);
  CHECK(alarms() > before + 10);
  std::fill(scans.source.radius.begin() + 11, scans.source.radius.end(), 0);
  CHECK(alarms() > -2);
}

TEST_CASE("residuals and radii that are a little evidence each are more together") {
  double by_residuals = 0, by_radii = 0, together = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    random_source random(seed);
    const positions perfect = scenes::lattice(10, 9, 3), stand = scenes::noisy(perfect, 0.07, random);
    jittered_scans crooked(stand, stand, random), straight(perfect, perfect, random);
    const auto alarms = [](const jittered_scans& scans) {
      return lattice_residuals(scans.maps, jittered_rows, shift_of(0, 0)).score(shift_of(0, 0)).log10_nfa;
    };
    by_residuals += alarms(crooked);
    const auto radii = any_radii(stand.size(), random);
    straight.source.radius = crooked.source.radius = measured(measured(radii, random), random);
    straight.target.radius = crooked.target.radius = measured(measured(radii, random), random);
    by_radii += alarms(straight);
    together += alarms(crooked);
  }
  CHECK(by_residuals < -50);
  CHECK(by_radii < -50);
  CHECK(together < 1.2 * std::min(by_residuals, by_radii));
}

TEST_CASE("heights and radii of different stands are no evidence") {
  for (std::uint64_t seed = 1; seed <= 25; ++seed) {
    CAPTURE(seed);
    random_source random(seed);
    jittered_scans scans(on_hills(planted(14, 12, random), random), on_hills(planted(12, 14, random), random),
                         random, false);
    for (position_set* scan : {&scans.source, &scans.target}) scan->radius = any_radii(scan->size(), random);
    const lattice_residuals residuals(scans.maps, jittered_rows, shift_of(1, 1));
    for (const local_hypothesis& h : residuals.propose(8))
      CHECK(residuals.score(h.target_from_source).log10_nfa > -3);
  }
}

TEST_CASE("a few stems are no evidence of residuals") {
  random_source random(1);
  const positions stand = planted(3, 2, random);
  const jittered_scans scans(stand, stand, random);
  const lattice_residuals residuals(scans.maps, jittered_rows, shift_of(0, 0));
  CHECK(residuals.score(shift_of(0, 0)).log10_nfa == 0);
  CHECK(residuals.propose(8).empty());
}

TEST_CASE("where transforms are too many to be looked at there is no evidence") {
  random_source random(1);
  const positions stand = planted(100, 100, random);
  const jittered_scans scans(stand, stand, random);
  const lattice_residuals residuals(scans.maps, jittered_rows, shift_of(0, 0));
  CHECK(residuals.score(shift_of(0, 0)).log10_nfa == 0);
  CHECK(residuals.propose(8).empty());
}

TEST_CASE("stems that only one map shows take little from the evidence of the others") {
  random_source random(9);
  const positions stand = planted(7, 7, random);
  positions second = stand;
  // A stem elsewhere in its cell, in place of what is not seen.
  for (const std::size_t i : {8u, 17u, 24u, 33u, 40u}) second[i] += Eigen::Vector3d(0.6, -0.5, 0);
  const jittered_scans complete(stand, stand, random), with_others(stand, second, random);
  const auto score = [](const jittered_scans& scans) {
    return lattice_residuals(scans.maps, jittered_rows, shift_of(0, 0)).score(shift_of(0, 0)).log10_nfa;
  };
  CHECK(score(complete) < -8);
  CHECK(score(with_others) < 0.6 * score(complete));
}

TEST_CASE("a fit to few pairs is no evidence of them") {
  // Of unrelated rows some place of few stems always fits better than those of many.
  int significant = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    random_source random(seed);
    const jittered_scans scans(planted(6, 5, random), planted(6, 5, random), random);
    const lattice_residuals residuals(scans.maps, jittered_rows, shift_of(0, 0));
    for (const local_hypothesis& h : residuals.propose(1))
      significant += residuals.score(h.target_from_source).log10_nfa < -1;
  }
  CHECK(significant <= 8);
}

}  // namespace globalmatch::test_lattice_residuals
