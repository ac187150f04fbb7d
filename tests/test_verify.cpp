#include "globalmatch/detail/matching/verify.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <set>
#include <vector>

#include "catch.hpp"
#include "stem_pairs.hpp"
#include "stem_scenes.hpp"
#include "uneven_stems.hpp"

namespace globalmatch::test_verify {

using namespace detail;

using scenes::four;
using scenes::positions;
using scenes::same_indices;

namespace {

/// Checks what the members of a hypothesis promise.
void require_sound(const local_hypothesis& h, const matching_context& maps, double inlier_threshold) {
  CHECK(h.inlier_threshold == inlier_threshold);
  CHECK(std::is_sorted(h.correspondences.begin(), h.correspondences.end()));
  std::set<stem_index> sources, targets;
  double squares = 0;
  for (const correspondence& c : h.correspondences) {
    CHECK(sources.insert(c.source).second);
    CHECK(targets.insert(c.target).second);
    const double distance = stem_distance(h.target_from_source * maps.source.at[c.source],
                                          maps.target.at[c.target], maps.horizontal_distances());
    CHECK(distance < inlier_threshold);
    squares += distance * distance;
  }
  CHECK(h.rms == Approx(std::sqrt(squares / double(h.correspondences.size()))).margin(1e-12));
}

}  // namespace

TEST_CASE(
    "verify pairs all stems of the overlap from three correspondences, and its pairs are those of its "
    "transform") {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    INFO("seed " << seed);
    random_source random(seed);
    const positions stems = scenes::random_stems(random, 40, 30, 30);
    const scenes::transform_of_scene truth = scenes::random_levelled_transform(random);
    const position_set source = scenes::set_in_order(scenes::noisy(stems, 0.005, random));
    const position_set target =
        scenes::set_in_order(scenes::moved(truth, scenes::noisy(stems, 0.005, random)));
    for (const auto dof : {four, degrees_of_freedom::six}) {
      const matching_context maps(source, target, false, dof);
      const auto h = verify(maps, same_indices(40), 0.1);
      REQUIRE(h);
      CHECK(h->correspondences == same_indices(40));
      CHECK(maps.pair_stems(h->target_from_source, 0.1) == h->correspondences);
      CHECK(scenes::max_error(h->target_from_source, truth, source.at) < 0.02);
      require_sound(*h, maps, 0.1);
    }
    const matching_context maps(source, target, false, four);
    const auto grown = verify(maps, std::vector<correspondence>{{2, 2}, {7, 7}, {21, 21}}, 0.2);
    REQUIRE(grown);
    CHECK(grown->correspondences == same_indices(40));
  }
}

TEST_CASE("verify drops a wrong correspondence that the others outvote") {
  random_source random(31);
  const positions stems = scenes::random_stems(random, 20, 30, 30);
  const position_set source = scenes::set_in_order(stems), target = scenes::set_in_order(stems);
  std::vector<correspondence> start = same_indices(20);
  start[4].target = 40;
  position_set with_decoy = target;
  with_decoy.at.resize(41, {-50, -50, 0});
  with_decoy.at[40] = from_eigen(stems[4]) + vec3{0.8, 0, 0};
  const auto h = verify(matching_context(source, with_decoy, false, four), start, 0.3);
  REQUIRE(h);
  CHECK(h->correspondences == same_indices(20));
}

TEST_CASE("whatever verify starts from, the stems it pairs lie within the tolerance") {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    INFO("seed " << seed);
    random_source random(seed);
    const position_set source = scenes::set_in_order(scenes::random_stems(random, 20, 20, 20));
    const position_set target = scenes::set_in_order(scenes::random_stems(random, 20, 20, 20));
    const auto order = scenes::random_order(20, random);
    std::vector<correspondence> start;
    for (stem_index i = 0; i < 5; ++i) start.push_back({i, static_cast<stem_index>(order[i])});
    const double inlier_threshold = seed % 2 == 0 ? 0.05 : 1.0;
    const matching_context maps(source, target, false, four);
    if (const auto h = verify(maps, start, inlier_threshold)) require_sound(*h, maps, inlier_threshold);
  }
}

TEST_CASE("verify gives nothing when the correspondences do not determine a transform") {
  const position_set pile = scenes::set_in_order(positions(5, Eigen::Vector3d(1, 2, 3)));
  const matching_context maps(pile, pile, false, four);
  CHECK_FALSE(verify(maps, {}, 0.1));
  CHECK_FALSE(verify(maps, same_indices(1), 0.1));
  CHECK_FALSE(verify(maps, same_indices(5), 0.1));
}

TEST_CASE("verify looks further and further out, and gives up where its transform is not promising") {
  random_source random(8);
  const position_set stems = scenes::set_in_order(scenes::random_stems(random, 2000, 150, 150));
  const matching_context maps(stems, stems, true, degrees_of_freedom::four);
  const std::vector<correspondence> start = {{0, 0}, {1, 1}, {2, 2}};
  double extent = 0;
  for (const vec3& a : stems.at) extent = std::max(extent, (a - stems.at[0]).xy().norm());
  std::vector<double> radii;
  const auto all = verify(maps, start, 0.05, [&](const auto&, const auto&, double radius) {
    radii.push_back(radius);
    return true;
  });
  REQUIRE(all);
  CHECK(all->correspondences.size() == stems.size());
  CHECK(std::is_sorted(radii.begin(), radii.end()));
  for (const double radius : radii) CHECK(radius < 2 * extent);
  std::vector<neighbor<double>> nearest;
  maps.source_index->nearest(0, 2, nearest);
  std::vector<correspondence> near_by = {{0, 0}};
  for (const auto& n : nearest) near_by.push_back({n.index, n.index});
  CHECK_FALSE(verify(maps, near_by, 0.05, [](const auto&...) { return false; }));
}

TEST_CASE(
    "the displacement of two transforms holds their turn, and no point within the radius moves farther") {
  random_source random(111);
  const vec3 center{50, -30, 2};
  const rigid a = scenes::some_transform();
  for (int i = 0; i < 50; ++i) {
    const rigid b = shifted_after(a, {random.normal(), random.normal(), 0}) *
                    rigid::turn_about(center, 0.3 * random.normal());
    const double bound = displacement(a, b, center, 20);
    double largest = 0;
    for (int k = 0; k < 360; ++k) {
      const double angle = k * std::numbers::pi / 180;
      const vec3 p = center + 20 * vec3{std::cos(angle), std::sin(angle), 0};
      largest = std::max(largest, (a * p - b * p).norm());
    }
    CHECK(bound >= largest * (1 - 1e-9));
    CHECK(bound < 1.5 * largest + 0.5);
  }
}

TEST_CASE("the worst correspondences are dropped one after the other, until all are within the threshold") {
  const position_set source = scenes::set_in_order({{0, 0, 0}, {8, 1, 0}, {3, 9, 0}, {11, 7, 0}, {5, 4, 0}});
  position_set target = scenes::set_in_order(
      scenes::moved(scenes::yaw_and_shift(0.7, {5, -2, 1}), scenes::to_positions(source.at)));
  target.at[3] += vec3{3, -2, 0};
  const matching_context maps(source, target, false, four);
  const std::vector<correspondence> start = {{0, 0}, {1, 1}, {2, 2}, {3, 3}, {4, 4}};
  CHECK(drop_outliers(maps, start, 0.1) == std::vector<correspondence>{{0, 0}, {1, 1}, {2, 2}, {4, 4}});
  CHECK(drop_outliers(maps, start, 5) == start);
  CHECK(drop_outliers(maps, {}, 0.1).empty());
}

}  // namespace globalmatch::test_verify
