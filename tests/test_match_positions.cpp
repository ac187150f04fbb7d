#include "globalmatch/stem_matching.hpp"

#include <cmath>
#include <vector>

#include "catch.hpp"
#include "stem_scenes.hpp"
#include "support/message_of.hpp"

// The functions that detail/verbs/match_positions.hpp defines, where the headers declare them: in both modes.
namespace globalmatch {

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

}  // namespace globalmatch
