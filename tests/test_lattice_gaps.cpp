#include "globalmatch/detail/matching/lattice_gaps.hpp"

#include <cmath>

#include "catch.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_lattice_gaps {

using namespace detail;

using scenes::positions;

namespace {

/// A stand 3 m by 3 m of which a share is missing.
positions with_gaps(int columns, int rows, double missing, random_source& random) {
  positions stems = scenes::lattice(columns, rows, 3);
  std::erase_if(stems, [&](const Eigen::Vector3d&) { return random.uniform() < missing; });
  return stems;
}

/// Two scans of a stand, each of which misses 2 %.
struct two_scans {
  position_set source, target;
  matching_context maps;

  two_scans(const positions& first, const positions& second, random_source& random)
      : source(seen(first, random)),
        target(seen(second, random)),
        maps(source, target, true, degrees_of_freedom::four) {}

  static position_set seen(positions stems, random_source& random) {
    std::erase_if(stems, [&](const Eigen::Vector3d&) { return random.uniform() < 0.02; });
    return scenes::set_in_order(scenes::noisy(stems, 0.02, random));
  }
};

/// The source shifted by so many columns and rows.
local_hypothesis shifted(int columns, int rows) {
  local_hypothesis h;
  h.target_from_source.translation = vec3{3.0 * columns, 3.0 * rows, 0};
  h.inlier_threshold = 0.1;
  return h;
}

const lattice_shifts rows_3m{{3, 0}, {0, 3}};

}  // namespace

TEST_CASE("gaps distinguish the true transform from all others of the lattice, wherever the search starts") {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    random_source random(seed);
    const positions stand = with_gaps(16, 14, 0.1, random);
    const two_scans scans(stand, stand, random);
    for (const local_hypothesis& start : {shifted(0, 0), shifted(3, -2)}) {
      const lattice_gaps gaps(scans.maps, rows_3m, start.target_from_source);
      CHECK(gaps.score(shifted(0, 0).target_from_source).log10_nfa < -5);
      CHECK(gaps.score(shifted(1, 0).target_from_source).log10_nfa > -2);
      const auto proposed = gaps.propose(4);
      REQUIRE(!proposed.empty());
      CHECK(proposed.size() <= 4);
      CHECK(proposed.front().correspondences.size() > 150);
      CHECK((to_eigen(proposed.front().target_from_source).matrix() - Eigen::Matrix4d::Identity()).norm() <
            0.05);
    }
  }
}

TEST_CASE("gaps of different stands are no evidence") {
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    CAPTURE(seed);
    random_source random(seed);
    const two_scans scans(with_gaps(16, 14, 0.1, random), with_gaps(14, 16, 0.15, random), random);
    const lattice_gaps gaps(scans.maps, rows_3m, shifted(1, 1).target_from_source);
    for (const local_hypothesis& h : gaps.propose(8)) CHECK(gaps.score(h.target_from_source).log10_nfa > -3);
  }
}

TEST_CASE("a lattice without gaps has no evidence of gaps") {
  random_source random(1);
  const position_set stand = scenes::set_in_order(scenes::lattice(10, 10, 3));
  const matching_context maps(stand, stand, true, degrees_of_freedom::four);
  const lattice_gaps gaps(maps, rows_3m, shifted(0, 0).target_from_source);
  CHECK(gaps.propose(8).empty());
  CHECK(gaps.score(rigid{}).log10_nfa > 0);
}

}  // namespace globalmatch::test_lattice_gaps
