#include "globalmatch/detail/matching/lattice_alignment.hpp"

#include <cmath>
#include <vector>

#include "catch.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_lattice_alignment {

using namespace detail;

namespace {

/// How far [m] a transform places the places of a lattice 3 m by 3 m off it, at most.
double farthest_off(const Eigen::Isometry3d& transform, const scenes::positions& places) {
  double most = 0;
  for (const Eigen::Vector3d& p : places) {
    const Eigen::Vector3d transformed = transform * p;
    most = std::max(
        {most, std::abs(std::remainder(transformed.x(), 3)), std::abs(std::remainder(transformed.y(), 3))});
  }
  return most;
}

}  // namespace

TEST_CASE("lattices are aligned though no hypothesis aligns them") {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    random_source random(seed);
    const scenes::positions stand = scenes::lattice(12, 10, 3);
    const scenes::transform_of_scene truth = scenes::random_levelled_transform(random);
    const position_set source =
        scenes::set_in_order(scenes::moved(truth.inverse(), scenes::noisy(stand, 0.05, random)));
    const position_set target = scenes::set_in_order(scenes::noisy(stand, 0.05, random));
    const matching_context maps(source, target, true, degrees_of_freedom::four);
    const auto rows = find_lattice(*maps.target_index);
    REQUIRE(rows);
    const std::vector<local_hypothesis> wrong(1);
    const scenes::transform_of_scene transformed =
        align_lattices(maps, find_lattice(*maps.source_index), *rows, wrong);
    CHECK(farthest_off(transformed * truth.inverse(), stand) < 0.9);
  }
}

TEST_CASE("of hypotheses the one that places most stems near others is as good as the lattice") {
  random_source random(1);
  const position_set stems = scenes::set_in_order(scenes::random_stems(random, 50, 30, 30));
  const matching_context maps(stems, stems, true, degrees_of_freedom::four);
  std::vector<local_hypothesis> hypotheses(2);
  hypotheses[0].target_from_source = from_eigen(scenes::yaw_and_shift(1, {5, 5, 0}));
  const lattice_shifts any{{3, 0}, {0, 3}};
  CHECK(
      to_eigen(align_lattices(maps, std::nullopt, any, hypotheses)).isApprox(Eigen::Isometry3d::Identity()));
}

}  // namespace globalmatch::test_lattice_alignment
