#include "globalmatch/detail/survey/split_check.hpp"

#include "catch.hpp"
#include "made_up_surveys.hpp"

namespace globalmatch::test_split_check {

using namespace detail;

namespace {

/// Stems of a map, and where others see their trees, with noise of both.
std::vector<shared_stem> shared(std::size_t count, double noise, random_source& random) {
  const plan_pose pose = {{30, -7}, 2};
  std::vector<shared_stem> stems;
  for (const Eigen::Vector3d& p : scenes::random_stems(random, count, 30, 30)) {
    const vec2 at = pose * vec2{p.x(), p.y()};
    stems.push_back(
        {{p.x() + noise * random.normal(), p.y() + noise * random.normal(), p.z()}, {at.x, at.y, 0}});
  }
  return stems;
}

}  // namespace

TEST_CASE("halves of a map place each other as well as its stems are known") {
  random_source random(1);
  const split_check exact = check_by_halves(shared(60, 0, random)),
                    noisy = check_by_halves(shared(60, 0.03, random));
  CHECK(exact.worst < 1e-9);
  CHECK(noisy.median > 0.02);
  CHECK(noisy.median < 0.06);
  CHECK(noisy.worst < 0.2);
}

TEST_CASE("the check shows a stem that is off, and needs eight") {
  random_source random(2);
  auto stems = shared(20, 0.01, random);
  stems[7].tree.x += 0.4;
  const split_check check = check_by_halves(stems);
  CHECK(check.worst > 0.3);
  CHECK(check.median < 0.1);
  CHECK(std::isnan(check_by_halves(shared(7, 0.01, random)).median));
  CHECK(std::isnan(check_by_halves(shared(7, 0.01, random)).worst));
  CHECK(std::isnan(check_by_halves({}).median));
  CHECK(check_by_halves(shared(8, 0.01, random)).median > 0);
}

TEST_CASE("stems at one place have no check that is wrong") {
  const std::vector<shared_stem> stems(12, {{1, 2, 3}, {4, 5, 0}});
  const split_check check = check_by_halves(stems);
  CHECK((std::isnan(check.worst) || check.worst < 1e-9));
}

TEST_CASE("shared stems are those whose tree others see, at the place where these see it") {
  random_source random(3);
  const auto poses = scenes::grid_of_maps(3, random);
  const auto forest = scenes::forest_around_grid(3, 200, random);
  const auto seen = scenes::see_from(poses, forest, 20, 0, random);
  const tree_observations trees = find_trees(seen.maps, std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5, 6, 7, 8},
                                             poses, scenes::tree_radii(9));
  std::vector<double> weights(trees.stems.size(), 1);
  const auto all = shared_stems(seen.maps, poses, trees, weights);
  REQUIRE(all.size() == 9);
  std::size_t expected = 0, count = 0;
  for (std::size_t t = 0; t < trees.size(); ++t)
    if (trees.of(t).size() > 1) expected += trees.of(t).size();
  for (std::size_t m = 0; m < 9; ++m)
    for (const shared_stem& s : all[m]) {
      ++count;
      CHECK((poses[m] * s.stem.xy() - s.tree.xy()).norm() < 1e-9);
    }
  CHECK(count == expected);
  weights.assign(weights.size(), 0);
  for (const auto& of_map : shared_stems(seen.maps, poses, trees, weights)) CHECK(of_map.empty());
}

}  // namespace globalmatch::test_split_check
