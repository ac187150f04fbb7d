#include "globalmatch/detail/matching/likely_causes.hpp"

#include <string>
#include <vector>

#include "catch.hpp"
#include "globalmatch/stem_matching.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_likely_causes {

using namespace detail;

namespace {

using Catch::Contains;
using scenes::positions;

/// Two maps of one stand, of which some 40 of 60 stems are common.
struct two_views {
  positions source, target;
  explicit two_views(std::uint64_t seed) {
    random_source random(seed);
    const positions stems = scenes::random_stems(random, 80, 45, 45);
    source.assign(stems.begin(), stems.begin() + 60);
    const positions seen(stems.begin() + 20, stems.end());
    target = scenes::noisy(scenes::moved(scenes::random_levelled_transform(random), seen), 0.02, random);
  }
};

positions swapped(positions stems) {
  for (Eigen::Vector3d& p : stems) std::swap(p.x(), p.y());
  return stems;
}

positions times(double factor, positions stems) {
  for (Eigen::Vector3d& p : stems) p *= factor;
  return stems;
}

std::string reason_of(const positions& source, const positions& target) {
  const matching result = match_stems(source, target);
  CHECK(result.outcome == outcome::not_registered);
  CHECK_FALSE(result.target_from_source);
  return result.reason;
}

}  // namespace

TEST_CASE("a mirror image is not registered, and named, whichever map is mirrored") {
  for (const std::uint64_t seed : {1u, 2u, 3u, 4u, 5u}) {
    const two_views views(seed);
    CHECK_THAT(reason_of(swapped(views.source), views.target), Contains("mirror image"));
    CHECK(match_stems(swapped(views.source), views.target).probability == 0);
    CHECK_THAT(reason_of(views.source, swapped(views.target)), Contains("are x and y of one map swapped?"));
  }
}

TEST_CASE("the mirror image of a flat map is not taken for the map upside down") {
  two_views views(6);
  for (Eigen::Vector3d& p : views.source) p.z() *= 0.001;
  positions flat = swapped(views.source);
  flat.front().z() += 0.5;  // heights are there
  CHECK_THAT(reason_of(flat, views.source), Contains("mirror image"));
}

TEST_CASE("maps in feet, centimetres and millimetres against metres are named") {
  const two_views views(7);
  CHECK_THAT(reason_of(times(1 / 0.3048, views.source), views.target), Contains("source in feet"));
  CHECK_THAT(reason_of(views.source, times(1 / 0.3048, views.target)), Contains("target in feet"));
  CHECK_THAT(reason_of(times(100, views.source), views.target),
             Contains("source: the stems stand some") && Contains("centimetres"));
  CHECK_THAT(reason_of(views.source, times(1000, views.target)),
             Contains("target: the stems stand some") && Contains("millimetres"));
}

TEST_CASE("degrees are named, in both maps as well") {
  const two_views views(8);
  CHECK_THAT(reason_of(times(1e-5, views.source), views.target), Contains("source") && Contains("degrees"));
  CHECK_THAT(reason_of(times(1e-5, views.source), times(1e-5, views.target)), Contains("degrees"));
}

TEST_CASE("maps that have nothing in common have no likely cause, and those that match none at all") {
  for (std::uint64_t seed = 20; seed < 30; ++seed) {
    random_source random(seed);
    const positions source = scenes::random_stems(random, 50, 40, 40),
                    target = scenes::random_stems(random, 40, 40, 40);
    CHECK_THAT(reason_of(source, target), !Contains("swapped") && !Contains("is source in"));
    const two_views views(seed);
    CHECK(match_stems(views.source, views.target).outcome == outcome::registered);
  }
}

TEST_CASE("plots far from each other in one map are no other unit, and sparse trees are none") {
  random_source random(40);
  positions plots = scenes::random_stems(random, 20, 30, 30);
  for (const Eigen::Vector3d& p : scenes::random_stems(random, 20, 30, 30))
    plots.push_back(p + Eigen::Vector3d(5000, 5000, 0));
  const position_set set = scenes::set_in_order(plots);
  CHECK(describe_wrong_unit(set, set, "source").empty());
  CHECK(spacing_of(set) < 10);
  const position_set sparse = scenes::set_in_order(scenes::random_stems(random, 30, 400, 400));
  CHECK(describe_wrong_unit(sparse, set, "source").empty());
  CHECK_THAT(describe_wrong_unit(scenes::set_in_order(times(1000, plots)), set, "source"),
             Contains("millimetres"));
}

TEST_CASE("centimetres and millimetres are known by the other map, if that is in metres") {
  CHECK(unit_by_spacing(900) == "millimetres");
  CHECK(unit_by_spacing(900, 9) == "centimetres");
  CHECK(unit_by_spacing(9000, 9) == "millimetres");
  CHECK(unit_by_spacing(300, 0.3) == "millimetres");
  CHECK(unit_by_spacing(900, 9000) == "millimetres");
  CHECK(unit_by_spacing(9, 900).empty());
  CHECK(unit_by_spacing(1e-4, 9) == "degrees (of longitude and latitude)");
}

TEST_CASE("the mirror image of a planted stand is named, and neither half of one stand is taken for it") {
  int named = 0, blamed = 0;
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    random_source random(seed);
    const positions rows = scenes::jittered(scenes::lattice(9, 9, 3), 0.4, random);
    const positions source(rows.begin(), rows.begin() + 60), seen(rows.begin() + 20, rows.end());
    const positions target =
        scenes::noisy(scenes::moved(scenes::random_levelled_transform(random), seen), 0.02, random);
    const matching mirrored = match_stems(swapped(source), target);
    CHECK(mirrored.outcome != outcome::registered);
    named += mirrored.reason.find("swapped") != std::string::npos;
    blamed += match_stems(source, target).reason.find("swapped") != std::string::npos;
  }
  CHECK(named >= 8);  // others are ambiguous
  CHECK(blamed == 0);
}

TEST_CASE("a changed map explains what the maps do not only beyond doubt, and by twice the exponent") {
  CHECK(explains_better(-20, 0));
  CHECK(explains_better(-20, -9.9));
  CHECK_FALSE(explains_better(-20, -10.1));
  CHECK_FALSE(explains_better(-5.9, 0));
}

TEST_CASE("the central stems are those nearest to the mean") {
  const position_set stems =
      scenes::set_in_order({{0, 0, 1}, {10, 0, 2}, {0, 10, 3}, {10, 10, 4}, {5, 6, 5}});
  const position_set two = central_stems(stems, 1);
  REQUIRE(two.size() == 1);
  CHECK(two.at[0].z == 5 - stems.frame.origin.z);
  CHECK(central_stems(stems, 99).size() == 5);
}

}  // namespace globalmatch::test_likely_causes
