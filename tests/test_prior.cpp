#include "globalmatch/detail/matching/prior.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "globalmatch/stem_matching.hpp"
#include "position_types.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_prior {

using namespace detail;

namespace {

using scenes::positions;

constexpr double degree = std::numbers::pi / 180;
const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();

Eigen::Vector3d centroid(const positions& stems) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : stems) mean += p / double(stems.size());
  return mean;
}

/// `truth`, whose place of the centroid is shifted and which is turned about it.
Eigen::Isometry3d displaced(const Eigen::Isometry3d& truth, const positions& source, double along_x,
                            double along_y, double turn) {
  const Eigen::Vector3d place = truth * centroid(source);
  return Eigen::Translation3d(place + Eigen::Vector3d(along_x, along_y, 0)) * Eigen::AngleAxisd(turn, up) *
         Eigen::Translation3d(-place) * truth;
}

/// A stand seen from two places: what is seen from both is a part of each map.
struct seen_twice {
  positions source, target;
  Eigen::Isometry3d truth;
};

seen_twice few_in_common(random_source& random, std::size_t common, std::size_t others, double noise) {
  const positions stand = scenes::random_stems(random, common + 2 * others, 40, 30);
  seen_twice maps;
  maps.truth = scenes::random_levelled_transform(random);
  const auto last = stand.begin() + std::ptrdiff_t(common + others);
  maps.source = scenes::noisy(positions(stand.begin(), last), noise, random);
  positions of_target(stand.begin(), stand.begin() + std::ptrdiff_t(common));
  of_target.insert(of_target.end(), last, stand.end());
  maps.target = scenes::noisy(scenes::moved(maps.truth, of_target), noise, random);
  return maps;
}

position_set imported(const positions& stems) {
  return import_positions(stems, up, "stems");
}

rigid between_local_frames(const Eigen::Isometry3d& t, const position_set& source,
                           const position_set& target) {
  return target.frame.local_from_scan() * from_eigen(t) * source.frame.local_from_scan().inverse();
}

}  // namespace

TEST_CASE("a transform differs from the prior at the centroid of the source, whichever map comes first") {
  random_source random(1);
  const positions stems = scenes::random_stems(random, 30, 40, 30);
  const Eigen::Isometry3d truth = scenes::random_levelled_transform(random);
  const positions moved = scenes::moved(truth, stems);
  const position_set source = imported(stems), target = imported(moved);
  const local_prior prior({truth, 2, 10 * degree}, source, target);
  const Eigen::Isometry3d other = displaced(truth, stems, 3, -4, 7 * degree);
  const rigid local = between_local_frames(other, source, target);
  for (const prior_deviation& d : {prior.deviation(local), prior.reversed().deviation(local.inverse())}) {
    CHECK(d.distance == Approx(5));
    CHECK(d.turn == Approx(7 * degree));
    CHECK(d.sigmas == Approx(std::hypot(5 / 2.0, 0.7)).epsilon(0.01));
  }
  CHECK(prior.deviation(prior.transform()).sigmas == Approx(0).margin(1e-9));
  CHECK(prior.reversed().deviation(prior.reversed().transform()).sigmas == Approx(0).margin(1e-9));
  CHECK(wrapped(prior.reversed().yaw() - yaw_of(prior.reversed().transform().rotation)) ==
        Approx(0).margin(1e-9));
}

TEST_CASE("a prior allows four standard deviations of place and turn, each, and not more") {
  random_source random(2);
  const positions stems = scenes::random_stems(random, 30, 40, 30);
  const Eigen::Isometry3d truth = scenes::random_levelled_transform(random);
  const position_set source = imported(stems), target = imported(scenes::moved(truth, stems));
  const local_prior prior({truth, 2, 5 * degree}, source, target);
  const auto allows = [&](double along_x, double turn) {
    const rigid local = between_local_frames(displaced(truth, stems, along_x, 0, turn), source, target);
    CHECK(prior.allows(local) == prior.reversed().allows(local.inverse()));
    return prior.allows(local);
  };
  CHECK(allows(7.9, -19.8 * degree));
  CHECK_FALSE(allows(8.2, 0));
  CHECK_FALSE(allows(0, 21 * degree));
}

TEST_CASE("a prior may place a stem wherever a transform that it allows places it") {
  random_source random(3);
  const positions stems = scenes::random_stems(random, 30, 40, 30);
  const Eigen::Isometry3d truth = scenes::random_levelled_transform(random);
  const position_set source = imported(stems), target = imported(scenes::moved(truth, stems));
  const local_prior prior({truth, 1, 5 * degree}, source, target);
  std::size_t beyond = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const Eigen::Isometry3d other =
        displaced(truth, stems, scenes::uniform(random, -3, 3), scenes::uniform(random, -2.5, 2.5),
                  scenes::uniform(random, -20, 20) * degree);
    const rigid local = between_local_frames(other, source, target);
    REQUIRE(prior.allows(local));
    const vec3& stem = source.at[random.below(30)];
    CHECK(prior.may_place(stem, local * stem));
    CHECK(prior.reversed().may_place(local * stem, stem));
    const vec3 far = local * stem + vec3{30, 0, 0};
    beyond += !prior.may_place(stem, far) && !prior.reversed().may_place(far, stem);
  }
  CHECK(beyond == 200);
}

TEST_CASE("a prior separates shifts that are longer than all that it allows is wide, if it fixes the yaw") {
  random_source random(8);
  const position_set stems = imported(scenes::random_stems(random, 30, 40, 30));
  const local_prior prior({Eigen::Isometry3d::Identity(), 0.3, 5 * degree}, stems, stems);
  CHECK(prior.separates(2.6));  // eight times 0.316 m
  CHECK_FALSE(prior.separates(2.5));
  CHECK_FALSE(local_prior({Eigen::Isometry3d::Identity(), 0.3, 8 * degree}, stems, stems).separates(2.6));
}

TEST_CASE("a certain prior leaves room for the noise of the stems") {
  random_source random(4);
  const positions stems = scenes::random_stems(random, 30, 40, 30);
  const position_set source = imported(stems);
  const local_prior prior({Eigen::Isometry3d::Identity(), 0, 0}, source, source);
  CHECK(prior.allows(
      between_local_frames(displaced(Eigen::Isometry3d::Identity(), stems, 0.3, 0, 0.01), source, source)));
  CHECK_FALSE(prior.allows(
      between_local_frames(displaced(Eigen::Isometry3d::Identity(), stems, 0.5, 0, 0), source, source)));
}

TEST_CASE("with a prior five stems of thirty-five are enough") {
  int with = 0, without = 0;
  for (int seed = 1; seed <= 20; ++seed) {
    random_source random{std::uint64_t(seed)};
    const seen_twice maps = few_in_common(random, 5, 30, 0.02);
    matching_options options;
    without += match_stems(maps.source, maps.target, options).outcome == outcome::registered;
    options.prior = {displaced(maps.truth, maps.source, 1, -0.5, 3 * degree), 1, 4 * degree};
    const matching result = match_stems(maps.source, maps.target, options);
    if (result.outcome != outcome::registered) continue;
    ++with;
    CHECK(scenes::max_error(*result.target_from_source, maps.truth, maps.source) < 0.5);
    REQUIRE(result.prior);
    CHECK(result.prior->distance == Approx(std::hypot(1, 0.5)).margin(0.2));
    CHECK(result.prior->turn == Approx(3 * degree).margin(2 * degree));
    CHECK_FALSE(result.prior->is_contradicted);
  }
  CHECK(with >= 19);
  CHECK(without <= 16);
}

TEST_CASE("a prior is of the caller's frames, whatever the type of positions") {
  random_source random(5);
  const seen_twice maps = few_in_common(random, 12, 8, 0.02);
  const auto check = [&](const char* name, const auto& range) {
    INFO(name);
    matching_options options;
    options.prior = {displaced(maps.truth, maps.source, 1, 0, 0), 1, 4 * degree};
    const matching result = match_stems(range, maps.target, options);
    REQUIRE(result.prior);
    CHECK(result.prior->distance == Approx(1).margin(0.1));
  };
  scenes::for_each_type_with_heights(maps.source, check);
  scenes::for_each_type_without_heights(maps.source, check);
}

TEST_CASE(
    "a prior that many stems contradict is named and not followed, for every proposal and preparation") {
  random_source random(6);
  const seen_twice maps = few_in_common(random, 25, 10, 0.02);
  for (const proposal by : {proposal::triangle_index, proposal::algorithm_1}) {
    matching_options options{.proposal = by};
    options.prior = {displaced(maps.truth, maps.source, 30, 0, 0), 2, 5 * degree};
    for (const matching& result : {match_stems(maps.source, maps.target, options),
                                   match_stems(maps.source, prepare_map(maps.target, options), options)}) {
      REQUIRE(result.outcome == outcome::registered);
      CHECK(scenes::max_error(*result.target_from_source, maps.truth, maps.source) < 0.1);
      REQUIRE(result.prior);
      CHECK(result.prior->is_contradicted);
      CHECK(result.prior->distance == Approx(30).margin(0.1));
    }
  }
}

TEST_CASE("where the prior excludes what is significant, but not beyond doubt, the reason says so") {
  int named = 0;
  for (int seed = 1; seed <= 20; ++seed) {
    random_source random{std::uint64_t(seed)};
    const seen_twice maps = few_in_common(random, 6, 24, 0.02);
    const matching without = match_stems(maps.source, maps.target);
    if (without.outcome != outcome::registered || without.hypotheses.front().log10_nfa < -6) continue;
    matching_options options;
    options.prior = {displaced(maps.truth, maps.source, 20, 0, 0), 1, 5 * degree};
    const matching result = match_stems(maps.source, maps.target, options);
    CHECK(result.outcome == outcome::not_registered);
    CHECK_THAT(result.reason, Catch::StartsWith("prior:"));
    ++named;
  }
  CHECK(named >= 3);
}

TEST_CASE(
    "what is registered within a prior is within it, and only what the stems alone show contradicts it") {
  int registered = 0;
  for (int seed = 1; seed <= 60; ++seed) {
    random_source random{std::uint64_t(seed)};
    const seen_twice maps = few_in_common(random, 14, 18, 0.25);
    matching_options options;
    options.prior = {displaced(maps.truth, maps.source, 0.52, 0, 0), 0.1, 5 * degree};
    const matching result = match_stems(maps.source, maps.target, options);
    if (result.outcome != outcome::registered) continue;
    ++registered;
    REQUIRE(result.prior);
    if (result.prior->distance <= 4 * std::hypot(0.1, 0.1)) {
      CHECK_FALSE(result.prior->is_contradicted);
    } else {
      CHECK(result.prior->is_contradicted);
      CHECK(match_stems(maps.source, maps.target).outcome == outcome::registered);
    }
  }
  CHECK(registered >= 20);
}

TEST_CASE("rows that fit at every shift are registered where a prior allows one of them, and only there") {
  random_source random(7);
  const positions stems = scenes::lattice(8, 7, 3);
  const Eigen::Isometry3d truth = scenes::random_levelled_transform(random);
  const positions target = scenes::noisy(scenes::moved(truth, stems), 0.02, random);
  CHECK(match_stems(stems, target).outcome == outcome::ambiguous);
  for (const bool swapped : {false, true}) {
    const positions &from = swapped ? target : stems, &to = swapped ? stems : target;
    const Eigen::Isometry3d expected = swapped ? truth.inverse() : truth;
    matching_options options;
    options.prior = {displaced(expected, from, 0.4, -0.3, 2 * degree), 0.3, 3 * degree};
    const matching near = match_stems(from, to, options);
    REQUIRE(near.outcome == outcome::registered);
    CHECK(scenes::max_error(*near.target_from_source, expected, from) < 0.1);
    options.prior->sigma_position = 3;
    CHECK(match_stems(from, to, options).outcome != outcome::registered);
  }
}

TEST_CASE("unrelated maps are not registered by their priors") {
  int registered = 0;
  for (int seed = 1; seed <= 60; ++seed) {
    random_source random{std::uint64_t(seed)};
    const positions source = scenes::random_stems(random, 25, 40, 30),
                    target = scenes::random_stems(random, 25, 40, 30);
    matching_options options;
    options.prior = {Eigen::Isometry3d::Identity(), 2, 10 * degree};
    registered += match_stems(source, target, options).outcome == outcome::registered;
  }
  CHECK(registered == 0);
}

TEST_CASE("a prior that makes no sense is named by its field") {
  const positions none;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto with = [](double sigma_position, double sigma_yaw,
                       const Eigen::Isometry3d& t = Eigen::Isometry3d::Identity()) {
    matching_options options;
    options.prior = {t, sigma_position, sigma_yaw};
    return options;
  };
  for (const double bad : {-1.0, nan, std::numeric_limits<double>::infinity()}) {
    CHECK_THROWS_WITH(match_stems(none, none, with(bad, 1)), Catch::Contains("prior.sigma_position"));
    CHECK_THROWS_WITH(match_stems(none, none, with(1, bad)), Catch::Contains("prior.sigma_yaw"));
  }
  Eigen::Isometry3d scaled = Eigen::Isometry3d::Identity();
  scaled.linear() *= 1.01;
  CHECK_THROWS_WITH(match_stems(none, none, with(1, 1, scaled)),
                    Catch::Contains("prior.target_from_source must be a rotation"));
  CHECK(match_stems(none, none, with(1, 1)).outcome == outcome::not_registered);
}

}  // namespace globalmatch::test_prior
