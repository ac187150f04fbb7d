#include "globalmatch/stem_matching.hpp"

#include <cmath>
#include <vector>

#include "catch.hpp"
#include "stem_scenes.hpp"
#include "support/message_of.hpp"

// The functions that detail/verbs/match_positions.hpp defines, where the headers declare them: in both modes.
namespace globalmatch::test_match_positions {

using namespace detail;

namespace {

using scenes::positions;

const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();

position_set imported(const positions& stems) {
  return import_positions(stems, up, "stems");
}

}  // namespace

TEST_CASE("sets of positions match as the caller's stems do, and a prepared set as the set itself") {
  random_source random(1);
  const positions stems = scenes::random_stems(random, 60, 40, 40);
  const Eigen::Isometry3d truth = scenes::random_levelled_transform(random);
  const positions source(stems.begin(), stems.begin() + 40),
      target = scenes::noisy(scenes::moved(truth, stems), 0.01, random);
  const matching_options options;
  const matching by_stems = match_stems(source, target);
  const auto prepared = prepare_positions(imported(target), true, {});
  for (const matching& result : {match_positions(imported(source), imported(target), options, {}),
                                 match_positions(imported(source), *prepared, options, {})}) {
    REQUIRE(result.outcome == outcome::registered);
    CHECK(scenes::max_error(*result.target_from_source, truth, source) < 0.02);
    CHECK(result.target_from_source->matrix() == by_stems.target_from_source->matrix());
    CHECK(result.hypotheses.front().correspondences == by_stems.hypotheses.front().correspondences);
  }
}

TEST_CASE("scans that are rotated by so much that nothing fits in plan are matched in space") {
  random_source random(2);
  positions stems = scenes::random_stems(random, 60, 40, 40);
  for (Eigen::Vector3d& p : stems) p.z() *= 4;  // relief, by which the plan changes
  const Eigen::Isometry3d truth(Eigen::AngleAxisd(0.9, Eigen::Vector3d(1, 3, 0).normalized()));
  const position_set source = imported(stems), target = imported(scenes::moved(truth, stems));
  const matching result = match_positions(source, target, {}, {});
  REQUIRE(result.outcome == outcome::registered);
  CHECK(result.vertical->kind == vertical_kind::rotated);
  CHECK(scenes::max_error(*result.target_from_source, truth, stems) < 0.01);
  CHECK(match_positions(source, target, {.inlier_threshold = 0.3}, {}).outcome == outcome::registered);
  CHECK(match_positions(source, target, {.dof = degrees_of_freedom::four}, {}).outcome !=
        outcome::registered);
  CHECK(match_positions(source, target, {.horizontal = true}, {}).outcome != outcome::registered);
}

TEST_CASE("a set that was prepared for other distances is refused, and so are options that make no sense") {
  random_source random(6);
  const position_set stems = imported(scenes::random_stems(random, 20, 30, 30));
  const auto horizontal = prepare_positions(stems, true, {});
  const matching_options six{.dof = degrees_of_freedom::six};
  CHECK_THAT(support::message_of([&] { match_positions(stems, *horizontal, six, {}); }),
             Catch::Contains("prepare it with dof six"));
  CHECK_THAT(support::message_of([&] { match_positions(stems, stems, {.inlier_threshold = -1}, {}); }),
             Catch::Contains("inlier_threshold"));
}

TEST_CASE("an exact lattice is ambiguous on another one, whatever its size, its yaw and the proposal") {
  random_source random(31);
  for (const int size : {6, 10, 14, 36})
    for (const proposal by : {proposal::triangle_index, proposal::algorithm_1}) {
      if (by == proposal::algorithm_1 && size > 14) continue;
      const positions lattice = scenes::lattice(size, size, 2.5);
      const Eigen::Isometry3d moved = scenes::random_levelled_transform(random),
                              in_place = Eigen::Isometry3d::Identity();
      for (const Eigen::Isometry3d& truth : {moved, in_place}) {
        const matching result =
            match_positions(imported(lattice), imported(scenes::moved(truth, lattice)), {.proposal = by}, {});
        CAPTURE(size, result.reason);
        CHECK(result.outcome == outcome::ambiguous);
        CHECK_FALSE(result.target_from_source);
        CHECK(result.probability <= 0.5);
        CHECK_THAT(result.reason, !Catch::Contains("swapped"));
      }
    }
}

TEST_CASE("lattices of different spacings are not registered, and not called ambiguous") {
  const matching result =
      match_positions(imported(scenes::lattice(36, 36, 2)), imported(scenes::lattice(36, 36, 3.1)), {}, {});
  CHECK(result.outcome == outcome::not_registered);
}

TEST_CASE("what matches upside down in space is not registered unless six degrees of freedom are asked for") {
  random_source random(32);
  positions stems = scenes::random_stems(random, 50, 40, 40);
  for (Eigen::Vector3d& p : stems) p.z() *= 4;
  const Eigen::Isometry3d upside_down(Eigen::AngleAxisd(3.1, Eigen::Vector3d(1, 2, 0).normalized()));
  const position_set source = imported(stems), target = imported(scenes::moved(upside_down, stems));
  CHECK(match_positions(source, target, {}, {}).outcome == outcome::not_registered);
  const matching forced = match_positions(source, target, {.dof = degrees_of_freedom::six}, {});
  REQUIRE(forced.outcome == outcome::registered);
  CHECK(scenes::max_error(*forced.target_from_source, upside_down, stems) < 0.01);
}

TEST_CASE("stems at the place of others neither count nor disturb, and the funnel says how many they are") {
  random_source random(33);
  const positions stems = scenes::random_stems(random, 60, 40, 40);
  const Eigen::Isometry3d truth = scenes::random_levelled_transform(random);
  positions source(stems.begin(), stems.begin() + 45),
      target = scenes::noisy(scenes::moved(truth, positions(stems.begin() + 10, stems.end())), 0.01, random);
  for (std::size_t i = 0; i < 45; ++i) source.push_back(source[i]);
  for (std::size_t i = 0; i < 50; ++i) target.push_back(target[i]);
  for (int i = 0; i < 10; ++i) target.push_back({0, 0, 0});
  const matching result = match_positions(imported(source), imported(target), {}, {});
  REQUIRE(result.outcome == outcome::registered);
  CHECK(scenes::max_error(*result.target_from_source, truth, stems) < 0.02);
  CHECK(result.hypotheses.front().correspondences.size() == 35);
  CHECK(result.funnel.source_stems == 90);
  CHECK(result.funnel.source_coincident == 45);
  CHECK(result.funnel.target_stems == 110);
  CHECK(result.funnel.target_coincident == 59);
}

}  // namespace globalmatch::test_match_positions
