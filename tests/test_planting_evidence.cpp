#include "globalmatch/detail/matching/planting_evidence.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "catch.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_planting_evidence {

using namespace detail;

using scenes::four;
using scenes::positions;

namespace {

const lattice_shifts rows_3m{{3, 0}, {0, 3}};

/// A stand 3 m by 3 m with gaps, planted 10 cm off its places, that two scans saw; the second from elsewhere.
struct planted_scans {
  scenes::transform_of_scene truth = scenes::yaw_and_shift(0.5, {20, -9, 1});
  position_set source, target;
  matching_context maps;
  lattice_shifts lattice;

  explicit planted_scans(random_source& random) : maps(source, target, true, four), lattice(turned(rows_3m)) {
    positions stand = scenes::noisy(scenes::lattice(16, 13, 3), 0.1, random);
    std::erase_if(stand, [&](const Eigen::Vector3d&) { return random.uniform() < 0.1; });
    source = scenes::set_in_order(scenes::noisy(stand, 0.02, random));
    target = scenes::set_in_order(scenes::moved(truth, scenes::noisy(stand, 0.02, random)));
  }
  planted_scans(const planted_scans&) = delete;

  lattice_shifts turned(const lattice_shifts& l) const {
    const mat2 turn = rotation_in_2d(0.5);
    return {turn * l.first, turn * l.second};
  }
  matching_context context() const { return {source, target, true, four}; }
  /// The truth, shifted by so many columns and rows.
  local_hypothesis shifted(int columns, int rows) const {
    local_hypothesis h;
    h.target_from_source = rigid(truth) * rigid{mat3::identity(), {3.0 * columns, 3.0 * rows, 0}};
    h.inlier_threshold = 0.3;
    h.correspondences = context().pair_stems(h.target_from_source, 0.3);
    return h;
  }
};

}  // namespace

TEST_CASE("evidence of a plantation is that of its gaps at first, and of residuals once asked for") {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    CAPTURE(seed);
    random_source random(seed);
    const planted_scans scans(random);
    const matching_context maps = scans.context();
    const std::vector<local_hypothesis> start = {scans.shifted(2, -1), scans.shifted(-3, 0)};
    planting_evidence planting(maps, rows_3m, scans.lattice, start);
    const rigid initial = align_lattices(maps, rows_3m, scans.lattice, start);
    const lattice_gaps gaps(maps, scans.lattice, initial);
    const lattice_residuals residuals(maps, scans.lattice, initial);
    for (const auto& [columns, rows] : {std::pair(0, 0), {1, 0}, {0, -2}}) {
      const local_hypothesis h = scans.shifted(columns, rows);
      const evidence_score score = planting.score(h);
      CHECK(score.source == evidence_source::gaps);
      CHECK(score.log10_nfa == gaps.score(h.target_from_source).log10_nfa);
      CHECK((score.log10_nfa < -5) == (columns == 0 && rows == 0));
    }
    const auto by_gaps = planting.propose(3);
    REQUIRE_FALSE(by_gaps.empty());
    CHECK(by_gaps.size() <= 3);
    CHECK(scenes::max_error(by_gaps.front().target_from_source, scans.truth, scans.source.at) < 0.1);

    planting.use_residuals(start);
    for (const int columns : {0, 1}) {
      const local_hypothesis h = scans.shifted(columns, 0);
      const evidence_score score = planting.score(h), expected = residuals.score(h.target_from_source);
      CHECK(score.source == expected.source);
      CHECK(score.source != evidence_source::gaps);
      CHECK(score.log10_nfa == expected.log10_nfa);
      CHECK((score.log10_nfa < -3) == (columns == 0));
    }
    const auto by_residuals = planting.propose(3);
    REQUIRE_FALSE(by_residuals.empty());
    CHECK(by_residuals.size() <= 3);
    CHECK(scenes::max_error(by_residuals.front().target_from_source, scans.truth, scans.source.at) < 0.1);
  }
}

TEST_CASE(
    "the lattices are aligned by themselves where no hypothesis does, and not without the source's own") {
  random_source random(7);
  const planted_scans scans(random);
  const matching_context maps = scans.context();
  local_hypothesis off = scans.shifted(0, 0);
  off.target_from_source = off.target_from_source * rigid{mat3::identity(), {1.5, 1.4, 0}};
  off.correspondences.clear();
  const planting_evidence with_own(maps, rows_3m, scans.lattice, std::vector{off});
  const auto found = with_own.propose(1);
  REQUIRE(found.size() == 1);
  CHECK(scenes::max_error(found.front().target_from_source, scans.truth, scans.source.at) < 0.1);
  const planting_evidence without_own(maps, std::nullopt, scans.lattice, std::vector{off});
  const lattice_gaps as_it_is(maps, scans.lattice, off.target_from_source);
  CHECK(without_own.score(scans.shifted(0, 0)).log10_nfa ==
        as_it_is.score(scans.shifted(0, 0).target_from_source).log10_nfa);
}

}  // namespace globalmatch::test_planting_evidence
