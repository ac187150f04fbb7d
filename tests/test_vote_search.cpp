#include "globalmatch/detail/matching/vote_search.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <optional>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "globalmatch/detail/matching/position_evidence.hpp"
#include "globalmatch/detail/matching/prepared_stems.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_vote_search {

using namespace detail;

namespace {

using scenes::positions;

/// Two maps of which the first `common` stems are the same, in one order.
struct part_in_common {
  position_set source, target;
  Eigen::Isometry3d truth;
  std::size_t common;
  std::shared_ptr<position_index> source_index, target_index;

  part_in_common(std::uint64_t seed, std::size_t in_both, std::size_t others, double noise)
      : common(in_both) {
    random_source random(seed);
    truth = scenes::random_levelled_transform(random);
    const double side = 3.5 * std::sqrt(double(common + others));
    positions a = scenes::random_stems(random, common, side / 3, side / 3);  // all in a corner
    positions b = scenes::moved(truth, a);
    for (const Eigen::Vector3d& p : scenes::random_stems(random, others, side, side)) a.push_back(p);
    for (const Eigen::Vector3d& p : scenes::random_stems(random, others, side, side))
      b.push_back(truth * Eigen::Vector3d(p.x() - side * 0.6, p.y(), p.z()));
    source = scenes::set_in_order(scenes::noisy(a, noise, random));
    target = scenes::set_in_order(scenes::noisy(b, noise, random));
    source_index = std::make_shared<position_index>(source);
    target_index = std::make_shared<position_index>(target);
  }

  matching_context context(std::optional<local_prior> prior = {}) const {
    return {source, target, source_index, target_index, true, degrees_of_freedom::four, default_execution(),
            prior};
  }
  triangle_index triangles() const { return {target, *target_index, true, target_neighbors}; }
};

std::size_t right_pairs(const std::vector<correspondence>& pairs, std::size_t common) {
  return std::size_t(std::count_if(pairs.begin(), pairs.end(), [&](const correspondence& c) {
    return c.source == c.target && c.source < common;
  }));
}

}  // namespace

TEST_CASE("the cell of most votes is that of the stems that both maps have") {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const part_in_common maps(seed, 25, 100, 0.01);
    const matching_context context = maps.context();
    matching_funnel funnel;
    block_votes votes = collect_votes(context, maps.triangles(), 0.05, vote_neighbors, funnel);
    CHECK(votes.size() == funnel.local_pairs);
    const auto peaks = votes.peaks(5);
    REQUIRE_FALSE(peaks.empty());
    CHECK(peaks.size() <= 5);
    CHECK(right_pairs(peaks[0], maps.common) == peaks[0].size());
  }
}

TEST_CASE("triangles that place a block at one place with one yaw vote for one cell, and others do not") {
  random_source random(4);
  for (int trial = 0; trial < 20; ++trial) {
    const Eigen::Isometry3d truth = scenes::random_levelled_transform(random);
    const positions stems = scenes::random_stems(random, 12, 8, 8);
    const position_set source = scenes::set_in_order(stems),
                       target = scenes::set_in_order(scenes::moved(truth, stems));
    const matching_context context(source, target, true, degrees_of_freedom::four);
    block_votes votes(context, 0.05);
    for (stem_index i = 0; i < 4; ++i)
      votes.vote({3 * i, 3 * i + 1, 3 * i + 2}, {3 * i, 3 * i + 1, 3 * i + 2});
    votes.vote({0, 1, 2}, {4, 5, 3});
    const auto peaks = votes.peaks(10);
    REQUIRE_FALSE(peaks.empty());
    CHECK(peaks[0].size() >= 6);
    CHECK(right_pairs(peaks[0], 12) == peaks[0].size());
  }
}

TEST_CASE("votes find few common stems among many, at any yaw, and say what they looked at") {
  int found = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const part_in_common maps(seed, 14, 150, 0.02);
    const matching_context context = maps.context();
    const null_model null(context, pairing_thresholds);
    matching_funnel funnel;
    const auto hypotheses =
        match_by_votes(context, maps.triangles(), 0.1, null, pairing_thresholds, vote_neighbors, funnel);
    CHECK(hypotheses.size() <= max_hypotheses);
    CHECK(funnel.source_triangles > 0);
    CHECK(funnel.tested > 0);
    found += !hypotheses.empty() && right_pairs(hypotheses[0].correspondences, maps.common) >= 10;
  }
  CHECK(found >= 11);
}

TEST_CASE("what a prior does not allow is neither looked at nor returned") {
  const part_in_common maps(5, 30, 60, 0.02);
  transform_prior given;
  given.target_from_source = Eigen::Translation3d(40, 0, 0) * maps.truth;
  given.sigma_position = 2;
  const matching_context context = maps.context(local_prior(given, maps.source, maps.target));
  std::vector<neighbor<double>> nearest;
  const std::vector<correspondence> right = {{0, 0}, {1, 1}, {2, 2}};
  CHECK(count_around(maps.context(), right, 0.1, nearest) >= 10);
  CHECK(count_around(context, right, 0.1, nearest) == 0);
  const null_model null(context, pairing_thresholds);
  matching_funnel funnel;
  for (const local_hypothesis& h :
       match_by_votes(context, maps.triangles(), 0.1, null, pairing_thresholds, vote_neighbors, funnel))
    CHECK(context.allows(h.target_from_source));
}

TEST_CASE("votes of maps without triangles, or with stems at one place, are none and no exception") {
  for (const positions& stems :
       {positions{}, positions{{0, 0, 0}, {1, 0, 0}}, positions(6, Eigen::Vector3d(1, 2, 3))}) {
    const position_set set = scenes::set_in_order(stems);
    const auto index = std::make_shared<position_index>(set);
    const matching_context context(set, set, index, index, true, degrees_of_freedom::four);
    const null_model null(context, pairing_thresholds);
    matching_funnel funnel;
    CHECK(match_by_votes(context, triangle_index(set, *index, true, 5), 0.1, null, pairing_thresholds,
                         vote_neighbors, funnel)
              .empty());
  }
}

}  // namespace globalmatch::test_vote_search
