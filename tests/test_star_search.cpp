#include "globalmatch/detail/matching/star_search.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "catch.hpp"
#include "evidence_scene.hpp"

namespace globalmatch {

using namespace detail;

namespace {

using scenes::positions;

std::vector<std::vector<star_ray>> stars_of(const position_set& stems) {
  std::vector<std::vector<star_ray>> stars;
  for (stem_index k = 0; k < stems.size(); ++k) stars.push_back(star_of(stems, k));
  return stars;
}

}  // namespace

TEST_CASE("a star has a ray to each other stem, the shortest first, with its direction in turns") {
  const position_set stems = scenes::set_in_order({{1, 1, 9}, {1, 4, 2}, {-1, 1, 3}, {1, -3, 0}});
  const auto at = [&](double x, double y) {
    for (stem_index i = 0; i < stems.size(); ++i)
      if ((stems.at[i] + stems.frame.origin - vec3{x, y, 0}).xy().norm() < 1e-9) return i;
    return stem_index(99);
  };
  const std::vector<star_ray> star = star_of(stems, at(1, 1));
  REQUIRE(star.size() == 3);
  CHECK(star[0].to == at(-1, 1));
  CHECK(star[0].distance == 2);
  CHECK(star[0].direction == 0.5f);
  CHECK(star[1].to == at(1, 4));
  CHECK(star[1].distance == 3);
  CHECK(star[1].direction == 0.25f);
  CHECK(star[2].to == at(1, -3));
  CHECK(star[2].direction == 0.75f);
}

TEST_CASE("the peak of two stars is the yaw that brute force finds, with as many votes") {
  random_source random(1);
  for (int trial = 0; trial < 20; ++trial) {
    const positions stems = scenes::random_stems(random, 25, 30, 30);
    const Eigen::Isometry3d truth = scenes::random_levelled_transform(random);
    const position_set source = scenes::set_in_order(stems),
                       target =
                           scenes::set_in_order(scenes::noisy(scenes::moved(truth, stems), 0.01, random));
    // The stem that the truth places nearest to the first one.
    const auto image = [&](stem_index i) {
      const Eigen::Vector3d there = truth * stems[source.original[i]];
      stem_index best = 0;
      double least = 1e9;
      for (stem_index k = 0; k < target.size(); ++k) {
        const vec3 p = target.at[k] + target.frame.origin;
        const double off = std::hypot(p.x - there.x(), p.y - there.y());
        if (off < least) least = off, best = k;
      }
      return best;
    };
    star_votes votes(0.1);
    const auto s = star_of(source, 0), t = star_of(target, image(0));
    const star_peak peak = votes.peak(s, t);
    CHECK(peak.votes >= 22);
    CHECK(peak.votes <= 26);
    const double yaw = std::atan2(truth.linear()(1, 0), truth.linear()(0, 0)) / (2 * std::numbers::pi);
    CHECK(std::abs(std::remainder(double(peak.yaw) / 512 - yaw, 1.0)) < 0.01);
    const auto pairs = votes.pairs_at(peak.yaw, s, t);
    std::size_t right = 0;
    for (const correspondence& c : pairs) right += image(c.source) == c.target;
    CHECK(right >= 22);
    CHECK(votes.peak(s, star_of(target, image(1))).votes < 10);
  }
}

TEST_CASE("votes on either side of a full turn count together") {
  positions source, target;
  for (int k = 0; k < 6; ++k) {
    const double direction = 2 * std::numbers::pi * k / 6, off = k % 2 == 0 ? 0.01 : -0.01;
    source.push_back({(5 + k) * std::cos(direction), (5 + k) * std::sin(direction), 0});
    target.push_back(
        {(5 + k) * std::cos(direction + off / (5 + k)), (5 + k) * std::sin(direction + off / (5 + k)), 0});
  }
  source.push_back({0, 0, 0});
  target.push_back({0, 0, 0});
  const position_set a = scenes::set_in_order(source), b = scenes::set_in_order(target);
  const auto middle = [](const position_set& set) {
    return stem_index(std::find(set.original.begin(), set.original.end(), stem_index(6)) -
                      set.original.begin());
  };
  star_votes votes(0.1);
  const auto s = star_of(a, middle(a)), t = star_of(b, middle(b));
  const star_peak peak = votes.peak(s, t);
  CHECK(peak.votes == 6);
  CHECK(votes.pairs_at(peak.yaw, s, t).size() == 6);
}

TEST_CASE("stars find the transform of maps that share a third of their stems, and as the best hypothesis") {
  for (const std::uint64_t seed : {1u, 2u, 3u, 4u, 5u, 6u}) {
    random_source random(seed);
    const positions stems = scenes::random_stems(random, 75, 60, 40);
    const Eigen::Isometry3d truth = scenes::random_levelled_transform(random);
    const positions source(stems.begin(), stems.begin() + 45),
        target =
            scenes::noisy(scenes::moved(truth, positions(stems.begin() + 30, stems.end())), 0.02, random);
    const scenes::evidence_scene s(source, target);
    const null_model null(s.maps, pairing_thresholds);
    matching_funnel funnel;
    const auto found = match_by_stars(s.maps, stars_of(s.target.stems), 0.1, null, pairing_thresholds,
                                      pairing_thresholds, funnel);
    REQUIRE_FALSE(found.empty());
    CHECK(found.front().log10_nfa < -6);
    CHECK(found.front().correspondences.size() >= 13);
    CHECK(scenes::max_error(found.front().target_from_source, truth, source) < 0.1);
    CHECK(funnel.tested > 0);
  }
}

TEST_CASE("in unrelated maps hardly a star is worth a verification") {
  random_source random(7);
  const scenes::evidence_scene s(scenes::random_stems(random, 60, 40, 40),
                                 scenes::random_stems(random, 60, 40, 40));
  const null_model null(s.maps, pairing_thresholds);
  matching_funnel funnel;
  const std::span<const double> fine(pairing_thresholds, 3);
  for (const local_hypothesis& h :
       match_by_stars(s.maps, stars_of(s.target.stems), 0.05, null, fine, pairing_thresholds, funnel))
    CHECK(h.log10_nfa > -3);
  CHECK(funnel.tested < 60);  // of 3600 stars
}

}  // namespace globalmatch
