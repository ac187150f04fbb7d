#include "globalmatch/detail/matching/matching_context.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <tuple>
#include <vector>

#include "catch.hpp"
#include "stem_pairs.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_matching_context {

using namespace detail;

using scenes::four;
using scenes::positions;
using scenes::same_indices;

TEST_CASE("pair_stems pairs one to one, nearest first, strictly within the tolerance") {
  const position_set source = scenes::set_in_order({{0, 0, 0}, {1, 0, 0}, {9, 0, 0}, {20, 0, 0}});
  const position_set target = scenes::set_in_order({{0.75, 0, 0}, {1.5, 0, 0}, {9.5, 0, 0}, {20, 0, 0.25}});
  const matching_context maps(source, target, false, degrees_of_freedom::six);
  const rigid identity;
  CHECK(maps.pair_stems(identity, 0.5) == std::vector<correspondence>{{1, 0}, {3, 3}});
  CHECK(maps.pair_stems(identity, 0.501) == std::vector<correspondence>{{1, 0}, {2, 2}, {3, 3}});
  CHECK(maps.pair_stems(identity, 2) == std::vector<correspondence>{{0, 1}, {1, 0}, {2, 2}, {3, 3}});
}

TEST_CASE("in 4-DoF stems are paired by horizontal distances, whatever their heights") {
  const position_set source = scenes::set_in_order({{0, 0, 0}, {5, 0, 0}, {9, 0, 0}});
  const position_set target = scenes::set_in_order({{0.1, 0, 0.9}, {5.1, 0, -40}, {9.1, 0, 1.1}});
  const rigid identity;
  for (const bool horizontal : {true, false})
    CHECK(matching_context(source, target, horizontal, four).pair_stems(identity, 0.2) == same_indices(3));
  CHECK(matching_context(source, target, false, degrees_of_freedom::six).pair_stems(identity, 0.2).empty());
}

TEST_CASE("stems on top of each other are paired one to one, from a bounded number of candidates") {
  const position_set source = scenes::set_in_order(positions(40, Eigen::Vector3d(3, 1, 0)));
  positions piled(40, Eigen::Vector3d(3, 1, 0));
  piled.push_back({3, 1.05, 0});
  const position_set target = scenes::set_in_order(piled);
  const auto pairs = matching_context(source, target, true, four).pair_stems(rigid{}, 0.3);
  CHECK(pairs.size() == 16);
  for (const correspondence& c : pairs) CHECK(c.target < 40);
}

TEST_CASE("pair_stems of maps without stems pairs none") {
  const position_set none, one = scenes::set_in_order({{0, 0, 0}});
  const rigid identity;
  CHECK(matching_context(none, none, false, four).pair_stems(identity, 1).empty());
  CHECK(matching_context(none, one, false, four).pair_stems(identity, 1).empty());
  CHECK(matching_context(one, none, false, four).pair_stems(identity, 1).empty());
}

TEST_CASE("the height of a 4-DoF transform is the median of what the pairs ask for") {
  for (const std::size_t count : {2u, 3u, 4u, 5u}) {
    const positions corners = {{0, 0, 1}, {6, 0, 4}, {0, 6, 1}, {6, 6, 2}, {3, 9, -7}};
    const std::vector<double> medians = {0, 0, 2.5, 1, 1.5, 1};
    positions flat(count);
    for (std::size_t i = 0; i < count; ++i) flat[i] = {corners[i].x(), corners[i].y(), 0};
    const position_set source = scenes::set_in_order(flat);
    const position_set target = scenes::set_in_order({corners.begin(), corners.begin() + long(count)});
    const auto transform = matching_context(source, target, false, four).fit(same_indices(count));
    REQUIRE(transform);
    CHECK(transform->translation.z == Approx(medians[count]));
    CHECK(transform->translation.xy().norm() == Approx(0).margin(1e-12));
  }
}

TEST_CASE("residuals under a transform are horizontal in 4-DoF and in space in 6-DoF") {
  const position_set source = scenes::set_in_order({{0, 0, 0}, {6, 0, 0}, {0, 6, 0}});
  const position_set target = scenes::set_in_order({{0, 0, 1}, {6, 0, 4}, {0, 6, 1}});
  const auto pairs = same_indices(3);
  const matching_context horizontal_distances(source, target, false, four),
      in_space(source, target, false, degrees_of_freedom::six);
  const scenes::transform_of_scene vertical_offset = scenes::yaw_and_shift(0, {0, 0, 2});
  CHECK(in_space.rms(vertical_offset, pairs) == Approx(std::sqrt(2)));  // 1, 2 and 1 metres
  CHECK(in_space.residual(vertical_offset, pairs[1]) == Approx(2));
  CHECK(horizontal_distances.rms(vertical_offset, pairs) == Approx(0).margin(1e-12));
  CHECK(horizontal_distances.rms(vertical_offset, {}) == 0);
  CHECK_FALSE(horizontal_distances.fit(std::span(pairs).first(1)));
}

TEST_CASE("pair_stems takes the nearest of all pairs left, by brute force, within a radius or everywhere") {
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    INFO("seed " << seed);
    random_source random(seed);
    const position_set source = scenes::set_in_order(scenes::random_stems(random, 60, 20, 12));
    const position_set target = scenes::set_in_order(scenes::random_stems(random, 50, 20, 12));
    const rigid transform = scenes::yaw_and_shift(0.4, {3, -4, 0.7});
    const vec3 center{4, 7, 0};
    for (const auto dof : {four, degrees_of_freedom::six})
      for (const double radius : {5.0, std::numeric_limits<double>::infinity()}) {
        const matching_context maps(source, target, false, dof);
        std::vector<std::tuple<double, stem_index, stem_index>> near;
        for (stem_index s = 0; s < source.size(); ++s)
          for (stem_index t = 0; t < target.size(); ++t) {
            const vec3 d = transform * source.at[s] - target.at[t];
            const double distance = dof == four ? d.xy().norm() : d.norm();
            if ((source.at[s] - center).xy().norm() < radius && distance < 1.5)
              near.push_back({distance, s, t});
          }
        std::sort(near.begin(), near.end());
        std::vector<bool> source_taken(source.size()), target_taken(target.size());
        std::vector<correspondence> expected;
        for (const auto& [distance, s, t] : near) {
          if (source_taken[s] || target_taken[t]) continue;
          source_taken[s] = target_taken[t] = true;
          expected.push_back({s, t});
        }
        std::sort(expected.begin(), expected.end());
        REQUIRE(expected.size() > 3);
        CHECK(maps.pair_stems(transform, 1.5, center, radius) == expected);
      }
  }
}

TEST_CASE("the context the other way round pairs the same stems, and fits the inverse") {
  random_source random(71);
  const positions stems = scenes::random_stems(random, 30, 20, 20);
  const scenes::transform_of_scene truth = scenes::yaw_and_shift(2.1, {30, -7, 4});
  const position_set source = scenes::set_in_order(stems),
                     target = scenes::set_in_order(scenes::moved(truth, stems));
  for (const auto dof : {four, degrees_of_freedom::six}) {
    const matching_context maps(source, target, false, dof);
    const matching_context back = maps.reversed();
    CHECK(&back.source == &target);
    CHECK(&back.target == &source);
    CHECK(back.source_index == maps.target_index);
    CHECK(back.target_index == maps.source_index);
    CHECK(back.dof == dof);
    CHECK(back.pair_stems(rigid(truth).inverse(), 0.1) == same_indices(30));
    const auto transform = back.fit(same_indices(30));
    REQUIRE(transform);
    CHECK(scenes::max_error(*transform, truth.inverse(), target.at) < 1e-9);
  }
}

TEST_CASE("weights of a fit count as copies, and a displacement is horizontal in 4-DoF") {
  random_source random(72);
  const positions stems = scenes::random_stems(random, 6, 20, 20);
  const position_set source = scenes::set_in_order(stems);
  const position_set target = scenes::set_in_order(scenes::noisy(stems, 0.3, random));
  const matching_context maps(source, target, false, degrees_of_freedom::six),
      level(source, target, false, four);
  std::vector<correspondence> copies = same_indices(6);
  copies.insert(copies.end(), {{1, 1}, {1, 1}, {4, 4}});
  const auto weighted = maps.fit(same_indices(6), std::vector<double>{1, 3, 1, 1, 2, 1}),
             copied = maps.fit(copies);
  REQUIRE((weighted && copied));
  CHECK(scenes::max_error(*weighted, to_eigen(*copied), source.at) < 1e-9);
  CHECK(scenes::max_error(*weighted, to_eigen(*maps.fit(same_indices(6))), source.at) > 1e-3);
  const rigid a, b{mat3::identity(), {0.3, -0.4, 1.2}};
  CHECK(maps.displacement(a, b, 3) == Approx(1.3));
  CHECK(level.displacement(a, b, 3) == Approx(0.5));
}

TEST_CASE("correspondences are sorted by source, then by target") {
  std::vector<correspondence> pairs = {{2, 1}, {0, 9}, {2, 0}, {0, 1}, {1, 5}};
  sort_correspondences(pairs);
  CHECK(pairs == std::vector<correspondence>{{0, 1}, {0, 9}, {1, 5}, {2, 0}, {2, 1}});
  std::vector<correspondence> none;
  sort_correspondences(none);
  CHECK(none.empty());
}

}  // namespace globalmatch::test_matching_context
