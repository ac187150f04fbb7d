#include "globalmatch/lattice_misfits.hpp"

#include <cmath>

#include "catch.hpp"
#include "stem_scenes.hpp"

namespace globalmatch {

using scenes::positions;

namespace {

const lattice rows_3m{{3, 0}, {0, 3}};

/// Two scans, with 5 cm of noise.
struct two_scans {
  position_set source, target;
  map_pair maps;

  two_scans(const positions& first, const positions& second, random_source& random)
      : source(scenes::set_in_order(scenes::noisy(first, 0.05, random))),
        target(scenes::set_in_order(scenes::noisy(second, 0.05, random))),
        maps(source, target, true, degrees_of_freedom::four) {}
};

Eigen::Isometry3d shifted(int columns, int rows) {
  return scenes::yaw_and_shift(0, {3.0 * columns, 3.0 * rows, 0});
}

/// Trees that were planted 12 cm off their places.
positions planted(int columns, int rows, random_source& random) {
  return scenes::noisy(scenes::lattice(columns, rows, 3), 0.12, random);
}

}  // namespace

TEST_CASE("misfits tell the true motion from all others of the lattice, wherever the walk starts") {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    CAPTURE(seed);
    random_source random(seed);
    const positions stand = planted(14, 12, random);
    const two_scans scans(stand, stand, random);
    for (const Eigen::Isometry3d& start : {shifted(0, 0), shifted(3, -2), shifted(-8, 5)}) {
      const lattice_misfits misfits(scans.maps, rows_3m, start);
      CHECK(misfits.testimony_of(shifted(0, 0)).log10_false_alarms < -5);
      CHECK(misfits.testimony_of(shifted(1, 0)).log10_false_alarms > -2);
      const auto proposed = misfits.propose(4);
      REQUIRE(!proposed.empty());
      CHECK(proposed.size() <= 4);
      CHECK(proposed.front().correspondences.size() > 150);
      CHECK((proposed.front().target_from_source.matrix() - Eigen::Matrix4d::Identity()).norm() < 0.1);
    }
  }
}

TEST_CASE("some stems of many are enough") {
  random_source random(1);
  const positions stand = planted(30, 30, random);
  const two_scans scans(stand, stand, random);
  const lattice_misfits misfits(scans.maps, rows_3m, shifted(4, 1));
  CHECK(misfits.testimony_of(shifted(0, 0)).log10_false_alarms < -20);
  CHECK(misfits.testimony_of(shifted(1, 0)).log10_false_alarms > -2);
}

TEST_CASE("misfits of different stands are no evidence") {
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    CAPTURE(seed);
    random_source random(seed);
    const two_scans scans(planted(14, 12, random), planted(12, 14, random), random);
    const lattice_misfits misfits(scans.maps, rows_3m, shifted(1, 1));
    const auto proposed = misfits.propose(8);
    REQUIRE(proposed.size() == 8);
    for (const hypothesis& h : proposed)
      CHECK(misfits.testimony_of(h.target_from_source).log10_false_alarms > -3);
  }
}

TEST_CASE("rows that bend alike in different stands are no evidence") {
  const auto bent = [](positions stems) {
    for (Eigen::Vector3d& p : stems) p += 0.3 * Eigen::Vector3d(std::sin(p.y() / 9), std::sin(p.x() / 7), 0);
    return stems;
  };
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    CAPTURE(seed);
    random_source random(seed);
    const two_scans scans(bent(planted(14, 12, random)), bent(planted(12, 14, random)), random);
    const lattice_misfits misfits(scans.maps, rows_3m, shifted(1, 1));
    for (const hypothesis& h : misfits.propose(8))
      CHECK(misfits.testimony_of(h.target_from_source).log10_false_alarms > -3);
  }
}

TEST_CASE("a few stems are told apart by nothing") {
  random_source random(1);
  const positions stand = planted(4, 4, random);
  const two_scans scans(stand, stand, random);
  const lattice_misfits misfits(scans.maps, rows_3m, shifted(0, 0));
  CHECK(misfits.testimony_of(shifted(0, 0)).log10_false_alarms == 0);
  CHECK(misfits.propose(8).empty());
}

TEST_CASE("where motions are too many to be looked at nothing is told") {
  random_source random(1);
  const positions stand = planted(100, 100, random);
  const two_scans scans(stand, stand, random);
  const lattice_misfits misfits(scans.maps, rows_3m, shifted(0, 0));
  CHECK(misfits.testimony_of(shifted(0, 0)).log10_false_alarms == 0);
  CHECK(misfits.propose(8).empty());
}

}  // namespace globalmatch
