#include "globalmatch/detail/matching/refine_threshold.hpp"

#include <cstdint>

#include "catch.hpp"
#include "evidence_scene.hpp"

namespace globalmatch::test_refine_threshold {

using namespace detail;

namespace {

using scenes::positions;

/// Stems of which some fit closely 0.5 m aside of where the others fit to a decimetre.
struct held_off {
  positions source, target;
  Eigen::Isometry3d truth;
  static constexpr std::size_t aside = 12;

  explicit held_off(std::uint64_t seed) {
    random_source random(seed);
    source = scenes::random_stems(random, 70, 60, 60);
    truth = scenes::random_levelled_transform(random);
    for (std::size_t i = 0; i < source.size(); ++i) {
      const Eigen::Vector3d noise(0.07 * random.normal(), 0.07 * random.normal(), 0);
      target.push_back(truth * source[i] + (i < aside ? Eigen::Vector3d(0.5, 0, 0) : noise));
    }
  }
};

/// The hypothesis that places stems `aside` [m] of the truth, at a threshold [m].
local_hypothesis off_by(const scenes::evidence_scene& s, const Eigen::Isometry3d& truth,
                        const Eigen::Vector3d& aside, double inlier_threshold) {
  local_hypothesis h;
  h.target_from_source = from_eigen(Eigen::Isometry3d(Eigen::Translation3d(aside) * truth));
  h.inlier_threshold = inlier_threshold;
  h.correspondences = s.maps.pair_stems(h.target_from_source, inlier_threshold);
  h.log10_nfa = s.positions_of.score(h).log10_nfa;
  return h;
}

}  // namespace

TEST_CASE("a few stems that fit closely do not hold the transform off the place where many more fit") {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const held_off maps(seed);
    const scenes::evidence_scene s(maps.source, maps.target);
    local_hypothesis h = off_by(s, maps.truth, {0.5, 0, 0}, 0.02);
    REQUIRE(h.correspondences.size() == held_off::aside);
    const double before = h.log10_nfa;
    refine_threshold(h, s.positions_of, s.maps);
    CHECK(h.log10_nfa < before);
    CHECK(h.correspondences.size() >= 50);
    CHECK(h.inlier_threshold > 0.1);
    CHECK(scenes::max_error(h.target_from_source, maps.truth, maps.source) < 0.2);  // of 0.5
  }
}

TEST_CASE("stems that are paired wrongly at a coarse threshold do not hold off those that fit closely") {
  random_source random(4);
  const positions source = scenes::random_stems(random, 40, 40, 40);
  const Eigen::Isometry3d truth = scenes::random_levelled_transform(random);
  positions target;
  for (std::size_t i = 0; i < source.size(); ++i)  // a third is off to one side
    target.push_back(truth * source[i] + Eigen::Vector3d(i % 3 == 0 ? 0.7 : 0.002 * random.normal(), 0, 0));
  const scenes::evidence_scene s(source, target);
  local_hypothesis h = off_by(s, truth, {0.25, 0, 0}, 0.9);
  refine_threshold(h, s.positions_of, s.maps);
  CHECK(h.inlier_threshold < 0.05);
  CHECK(scenes::max_error(h.target_from_source, truth, source) < 0.005);
}

TEST_CASE("a hypothesis that fits best as it is stays, to the bit") {
  random_source random(5);
  const positions source = scenes::random_stems(random, 40, 40, 40);
  const Eigen::Isometry3d truth = scenes::random_levelled_transform(random);
  const scenes::evidence_scene s(source, scenes::moved(truth, source));
  local_hypothesis h = off_by(s, truth, {0, 0, 0}, pairing_thresholds[0]);
  const rigid before = h.target_from_source;
  refine_threshold(h, s.positions_of, s.maps);
  CHECK(h.target_from_source.translation == before.translation);
  CHECK(h.inlier_threshold == pairing_thresholds[0]);
  CHECK(h.correspondences.size() == source.size());
}

}  // namespace globalmatch::test_refine_threshold
