#include "globalmatch/detail/matching/scale_fit.hpp"

#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "globalmatch/stem_matching.hpp"
#include "position_types.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_scale_fit {

using namespace detail;

namespace {

using scenes::positions;

const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();

positions times(double factor, positions stems) {
  for (Eigen::Vector3d& p : stems) p *= factor;
  return stems;
}

/// Maps of equal order: stem i is paired with stem i.
struct paired {
  positions source, target;
  Eigen::Isometry3d truth;
};

paired any_pair(std::uint64_t seed, double factor, double noise, std::size_t count = 60) {
  random_source random(seed);
  const positions stems = scenes::random_stems(random, count, 60, 40);
  const Eigen::Isometry3d truth = scenes::random_levelled_transform(random);
  return {scenes::noisy(times(1 / factor, stems), noise, random),
          scenes::noisy(scenes::moved(truth, stems), noise, random), truth};
}

/// The scale of all pairs in one order, under the transform that fits them best.
scale_estimate scale_of(const paired& maps) {
  const position_set source = scenes::set_in_order(maps.source), target = scenes::set_in_order(maps.target);
  const matching_context context(source, target, true, degrees_of_freedom::four);
  local_hypothesis h;
  for (stem_index i = 0; i < source.size(); ++i) h.correspondences.push_back({i, i});
  h.target_from_source = *context.fit(h.correspondences);
  const auto fitted = fit_scale(h, context);
  REQUIRE(fitted);
  return *fitted;
}

}  // namespace

TEST_CASE("the scale of exact pairs is exact, whatever the transform") {
  for (std::uint64_t seed = 1; seed <= 40; ++seed)
    for (const double factor : {0.97, 1.0, 1.0004, 1.03}) {
      const scale_estimate fitted = scale_of(any_pair(seed, factor, 0));
      CHECK(fitted.factor == Approx(factor).epsilon(1e-12));
      CHECK(fitted.differs == (factor != 1));
    }
}

TEST_CASE("the errors of the scale are as large as its sigma says") {
  double squares = 0;
  constexpr int trials = 400;
  for (int seed = 1; seed <= trials; ++seed) {
    const scale_estimate fitted = scale_of(any_pair(std::uint64_t(seed), 1.01, 0.03, 20));
    const double off = (fitted.factor - 1.01) / fitted.sigma;
    squares += off * off / trials;
  }
  CHECK(squares > 0.85);
  CHECK(squares < 1.35);  // of Student's t with 36 degrees of freedom: 1.06
}

TEST_CASE("noise alone does not make a scale differ") {
  for (int seed = 1; seed <= 200; ++seed)
    CHECK_FALSE(scale_of(any_pair(std::uint64_t(seed), 1, 0.03, 8 + std::size_t(seed))).differs);
}

TEST_CASE("three pairs say nothing of the scale, and neither do stems at one place") {
  for (const positions& stems :
       {positions{{0, 0, 0}, {5, 0, 0}, {0, 5, 0}}, positions(6, Eigen::Vector3d(1, 2, 3))}) {
    const position_set set = scenes::set_in_order(stems);
    const matching_context context(set, set, true, degrees_of_freedom::four);
    local_hypothesis h;
    for (stem_index i = 0; i < set.size(); ++i) h.correspondences.push_back({i, i});
    CHECK_FALSE(fit_scale(h, context));
  }
}

TEST_CASE("a map that is one per cent too large is registered, and the error is as large as it says") {
  for (int seed = 1; seed <= 20; ++seed) {
    const paired maps = any_pair(std::uint64_t(seed), 1.01, 0.02);
    const matching result = match_stems(maps.source, maps.target);
    REQUIRE(result.outcome == outcome::registered);
    REQUIRE(result.scale);
    CHECK(result.scale->differs);
    CHECK_FALSE(result.scale->is_applied);
    CHECK(result.scale->factor == Approx(1.01).margin(4 * result.scale->sigma));
    const Eigen::Vector3d corner = maps.truth * Eigen::Vector3d(0, 0, 0);
    const double off = (*result.target_from_source * Eigen::Vector3d(0, 0, 0) - corner).head<2>().norm();
    CHECK(off > 0.2);
    CHECK(off < 3 * std::sqrt(result.uncertainty->at(corner).topLeftCorner<2, 2>().trace()));
  }
}

TEST_CASE("the scale is applied on demand, for every type of positions and to prepared maps") {
  const paired maps = any_pair(3, 1.02, 0.01);
  matching_options options;
  options.scale = true;
  const auto check = [&](const matching& result) {
    REQUIRE(result.outcome == outcome::registered);
    CHECK(result.scale->is_applied);
    CHECK(result.scale->factor == Approx(1.02).margin(1e-3));
    for (std::size_t i = 0; i < maps.source.size(); ++i) {
      const Eigen::Vector3d placed =
          *result.target_from_source * Eigen::Vector3d(result.scale->factor * maps.source[i]);
      CHECK((placed - maps.target[i]).head<2>().norm() < 0.06);
    }
  };
  scenes::for_each_type_with_heights(maps.source, [&](const char* name, const auto& range) {
    INFO(name);
    check(match_stems(range, maps.target, options));
    check(match_stems(range, prepare_map(maps.target, options), options));
  });
}

TEST_CASE("a prior is of the source as it is given, however far from 0, where a scale is applied") {
  paired maps = any_pair(5, 1.02, 0.01);
  for (Eigen::Vector3d& p : maps.source) p += Eigen::Vector3d(500'000, 4'000'000, 0);
  matching_options options;
  options.scale = true;
  options.prior.emplace();
  Eigen::Vector3d center = Eigen::Vector3d::Zero(), place = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < maps.source.size(); ++i) {
    center += maps.source[i] / double(maps.source.size());
    place += maps.target[i] / double(maps.source.size());
  }
  Eigen::Isometry3d turn = Eigen::Isometry3d::Identity();
  turn.linear() = maps.truth.linear();
  options.prior->target_from_source = Eigen::Translation3d(place) * turn * Eigen::Translation3d(-center);
  options.prior->sigma_position = 0.5;
  const matching result = match_stems(maps.source, maps.target, options);
  REQUIRE(result.outcome == outcome::registered);
  CHECK(result.scale->is_applied);
  CHECK(result.prior->distance < 0.1);
  CHECK_FALSE(result.prior->is_contradicted);
}

TEST_CASE("maps of one scale give the same bits whether a scale is asked for or not") {
  const paired maps = any_pair(4, 1, 0.02);
  matching_options options;
  options.scale = true;
  const matching without = match_stems(maps.source, maps.target),
                 with = match_stems(maps.source, maps.target, options);
  REQUIRE(without.outcome == outcome::registered);
  CHECK(without.target_from_source->matrix() == with.target_from_source->matrix());
  CHECK(without.uncertainty->covariance == with.uncertainty->covariance);
  CHECK_FALSE(with.scale->differs);
  CHECK_FALSE(with.scale->is_applied);
}

TEST_CASE("a distortion widens the covariance of shift and turn, in four degrees of freedom and in six") {
  for (const std::size_t size : {std::size_t(4), std::size_t(6)}) {
    small_matrix covariance;
    covariance.size = size;
    scale_estimate scale{0.99, 1e-3, false, false};
    add_distortion(covariance, scale, 20);
    CHECK(covariance(0, 0) == 0);
    scale.differs = true;
    add_distortion(covariance, scale, 20);
    CHECK(covariance(0, 0) == Approx(0.04));
    CHECK(covariance(1, 1) == Approx(0.04));
    CHECK(covariance(size - 1, size - 1) == Approx(1e-4));
    CHECK(covariance(2, 2) == 0);
  }
}

}  // namespace globalmatch::test_scale_fit
