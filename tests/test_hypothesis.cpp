#include "globalmatch/detail/matching/hypotheses.hpp"
#include "globalmatch/detail/matching/verify.hpp"

#include <set>

#include "catch.hpp"
#include "stem_scenes.hpp"

namespace globalmatch {

using namespace detail;

using scenes::positions;

namespace {

using scenes::four;

/// Correspondences of equal indices.
std::vector<correspondence> same_indices(std::size_t count) {
  std::vector<correspondence> pairs;
  for (stem_index i = 0; i < count; ++i) pairs.push_back({i, i});
  return pairs;
}

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

TEST_CASE("pair_stems pairs one to one, nearest first, strictly within the tolerance") {
  const position_set source = scenes::set_in_order({{0, 0, 0}, {1, 0, 0}, {9, 0, 0}, {20, 0, 0}});
  const position_set target = scenes::set_in_order({{0.75, 0, 0}, {1.5, 0, 0}, {9.5, 0, 0}, {20, 0, 0.25}});
  const matching_context maps(source, target, false, degrees_of_freedom::six);
  const rigid identity;
  CHECK(maps.pair_stems(identity, 0.5) == std::vector<correspondence>{{1, 0}, {3, 3}});
  CHECK(maps.pair_stems(identity, 0.501) == std::vector<correspondence>{{1, 0}, {2, 2}, {3, 3}});
  CHECK(maps.pair_stems(identity, 2) == std::vector<correspondence>{{0, 1}, {1, 0}, {2, 2}, {3, 3}});
}

TEST_CASE("pair_stems leaves heights out where they do not count") {
  const position_set source = scenes::set_in_order({{0, 0, 0}, {5, 0, 0}});
  const position_set target = scenes::set_in_order({{0, 0, 40}, {5, 0, -3}});
  const rigid identity;
  CHECK(matching_context(source, target, true, four).pair_stems(identity, 0.1).size() == 2);
  CHECK(matching_context(source, target, false, four).pair_stems(identity, 0.1).empty());
}

TEST_CASE("in 4-DoF stems are paired in plan, unless their heights are too far apart") {
  const position_set source = scenes::set_in_order({{0, 0, 0}, {5, 0, 0}, {9, 0, 0}});
  const position_set target = scenes::set_in_order({{0.1, 0, 0.9}, {5.1, 0, -0.9}, {9.1, 0, 1.1}});
  const rigid identity;
  CHECK(matching_context(source, target, false, four).pair_stems(identity, 0.2) == same_indices(2));
  CHECK(matching_context(source, target, false, four, 0.8).pair_stems(identity, 0.2).empty());
  CHECK(matching_context(source, target, false, degrees_of_freedom::six).pair_stems(identity, 0.2).empty());
}

TEST_CASE("pair_stems of maps without stems pairs none") {
  const position_set none, one = scenes::set_in_order({{0, 0, 0}});
  const rigid identity;
  CHECK(matching_context(none, none, false, four).pair_stems(identity, 1).empty());
  CHECK(matching_context(none, one, false, four).pair_stems(identity, 1).empty());
  CHECK(matching_context(one, none, false, four).pair_stems(identity, 1).empty());
}

TEST_CASE("the height of a 4-DoF motion is the median of what the pairs ask for") {
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

TEST_CASE(
    "matching_context tells the distances that a motion leaves, in plan in 4-DoF and in space in 6-DoF") {
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

TEST_CASE("verify pairs all stems of the overlap from three correspondences, and its pairs stand") {
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

TEST_CASE("verify gives nothing when the correspondences do not determine a motion") {
  const position_set pile = scenes::set_in_order(positions(5, Eigen::Vector3d(1, 2, 3)));
  const matching_context maps(pile, pile, false, four);
  CHECK_FALSE(verify(maps, {}, 0.1));
  CHECK_FALSE(verify(maps, same_indices(1), 0.1));
  CHECK_FALSE(verify(maps, same_indices(5), 0.1));
}

TEST_CASE("verify looks further and further out, and gives up where its motion is not promising") {
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

TEST_CASE("hypotheses differ when they place the stems further apart than the distance, on average") {
  const position_set source = scenes::set_in_order({{0, 0, 0}, {10, 0, 0}, {0, 10, 0}});
  const matching_context maps(source, source, false, four);
  local_hypothesis a, b;
  a.correspondences = b.correspondences = same_indices(3);
  CHECK_FALSE(differ(a, b, maps, 0.1));
  b.target_from_source = scenes::yaw_and_shift(0, {0.0999, 0, 0});
  CHECK_FALSE(differ(a, b, maps, 0.1));
  CHECK_FALSE(differ(b, a, maps, 0.1));
  b.target_from_source = scenes::yaw_and_shift(0, {0, 0.1001, 0});
  CHECK(differ(a, b, maps, 0.1));
  CHECK(differ(b, a, maps, 0.1));
  b.target_from_source = scenes::yaw_and_shift(1, {0, 0, 0});
  CHECK(differ(a, b, maps, 0.1));
}

TEST_CASE("every witness has a name of its own") {
  CHECK(to_string(evidence_source::positions) == "positions");
  CHECK(to_string(evidence_source::gaps) == "gaps");
  CHECK(to_string(evidence_source::residuals) == "residuals");
  CHECK(to_string(evidence_source::heights) == "heights");
  CHECK(to_string(evidence_source::radii) == "radii");
  CHECK(to_string(static_cast<evidence_source>(99)) == "unknown");
}

TEST_CASE("ranks_before puts more pairs first, then nearer ones, then the larger consensus") {
  local_hypothesis best, fewer, farther, lonelier;
  best.correspondences = farther.correspondences = lonelier.correspondences = same_indices(5);
  fewer.correspondences = same_indices(4);
  best.rms = lonelier.rms = 0.02;
  farther.rms = 0.03;
  fewer.rms = 0.01;
  best.consensus = 7;
  lonelier.consensus = 6;
  farther.consensus = fewer.consensus = 100;
  const std::vector<local_hypothesis> ranked = {best, lonelier, farther, fewer};
  for (std::size_t i = 0; i < ranked.size(); ++i)
    for (std::size_t j = 0; j < ranked.size(); ++j) CHECK(ranks_before(ranked[i], ranked[j]) == (i < j));
}

TEST_CASE("rank puts the best first and leaves equal ones as they were") {
  std::vector<local_hypothesis> all(5);
  for (std::size_t i = 0; i < all.size(); ++i) {
    all[i].correspondences = same_indices(i % 2);
    all[i].target_from_source.translation.x = double(i);
  }
  rank(all);
  std::vector<double> order;
  for (const local_hypothesis& h : all) order.push_back(h.target_from_source.translation.x);
  CHECK(order == std::vector<double>{1, 3, 0, 2, 4});
  keep_best(all, 7);
  CHECK(all.size() == 5);
  keep_best(all, 2);
  REQUIRE(all.size() == 2);
  CHECK(all[1].target_from_source.translation.x == 3);
}

TEST_CASE("ranks_before is a strict weak order") {
  random_source random(60);
  std::vector<local_hypothesis> all(40);
  for (local_hypothesis& h : all) {
    h.correspondences = same_indices(random.below(3));
    h.rms = random.below(3) * 0.01;
    h.consensus = random.below(3);
  }
  const auto equivalent = [](const local_hypothesis& a, const local_hypothesis& b) {
    return !ranks_before(a, b) && !ranks_before(b, a);
  };
  bool transitive = true, equivalence_transitive = true;
  for (const local_hypothesis& a : all) {
    CHECK_FALSE(ranks_before(a, a));
    for (const local_hypothesis& b : all) {
      CHECK_FALSE((ranks_before(a, b) && ranks_before(b, a)));
      for (const local_hypothesis& c : all) {
        transitive = transitive && (!ranks_before(a, b) || !ranks_before(b, c) || ranks_before(a, c));
        equivalence_transitive =
            equivalence_transitive && (!equivalent(a, b) || !equivalent(b, c) || equivalent(a, c));
      }
    }
  }
  CHECK(transitive);
  CHECK(equivalence_transitive);
}

}  // namespace globalmatch
