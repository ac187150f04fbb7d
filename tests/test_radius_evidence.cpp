#include "globalmatch/detail/matching/radius_evidence.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "catch.hpp"
#include "globalmatch/stem_matching.hpp"
#include "stem_scenes.hpp"

namespace globalmatch::test_radius_evidence {

using namespace detail;

using scenes::four;

namespace {

/// A stem as a caller has it who measured radii.
struct trunk {
  double x, y, z, radius;
};

double any_radius(random_source& random) {
  return 0.05 + 0.3 * random.uniform() * random.uniform();
}

/// Trunks on a square of 60 m.
std::vector<trunk> random_trunks(random_source& random, std::size_t count, double growth = 0) {
  std::vector<trunk> trunks;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = 60 * random.uniform(), y = 60 * random.uniform();
    trunks.push_back({x, y, 0.1 * x, any_radius(random) + growth * x});
  }
  return trunks;
}

/// Two maps in one frame, and a hypothesis that pairs their first stems.
struct paired_maps {
  position_set from, to;
  matching_context context;

  paired_maps(const std::vector<trunk>& source, const std::vector<trunk>& target)
      : from(import_positions(source, Eigen::Vector3d::UnitZ(), "source")),
        to(import_positions(target, Eigen::Vector3d::UnitZ(), "target")),
        context(from, to, true, four) {}

  /// Stem i of the source with stem i of the target, as they were given.
  local_hypothesis first(std::size_t pairs) const {
    local_hypothesis h;
    for (stem_index s = 0; s < from.size(); ++s)
      for (stem_index t = 0; t < to.size(); ++t)
        if (from.original[s] == to.original[t] && from.original[s] < pairs)
          h.correspondences.push_back({s, t});
    h.log10_nfa = h.log10_nfa_poisson = -2;
    return h;
  }
  double log10_probability(std::size_t pairs) const {
    return radius_evidence(context).log10_probability(first(pairs));
  }
};

/// The trunks as they are measured again: radii to 1 cm.
std::vector<trunk> measured_again(std::vector<trunk> trunks, random_source& random) {
  for (trunk& t : trunks) t.radius = std::max(0.01, t.radius + 0.01 * random.normal());
  return trunks;
}

}  // namespace

TEST_CASE("radii that agree lower the NFA of a transform, the more the more stems are paired") {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    CAPTURE(seed);
    random_source random(seed);
    const std::vector<trunk> source = random_trunks(random, 50);
    const paired_maps maps(source, measured_again(source, random));
    const evidence_score of_six = radius_evidence(maps.context).score(maps.first(6)),
                         of_sixteen = radius_evidence(maps.context).score(maps.first(16));
    CHECK(of_six.source == evidence_source::radii);
    CHECK(of_six.log10_nfa < -2);
    CHECK(of_sixteen.log10_nfa < of_six.log10_nfa - 1);
    CHECK(of_sixteen.log10_nfa_poisson == -2);
  }
}

TEST_CASE("radii of stems that have nothing in common agree as rarely as the null model says") {
  constexpr std::size_t trials = 1000;
  for (const double growth : {0.0, 0.005}) {  // [m] of radius a metre along x, in both maps
    std::size_t below_tenth = 0, below_hundredth = 0;
    for (std::uint64_t seed = 1; seed <= trials; ++seed) {
      random_source random(seed);
      const std::vector<trunk> source = random_trunks(random, 50, growth);
      std::vector<trunk> target = random_trunks(random, 50, growth);
      for (std::size_t i = 0; i < 6; ++i)  // at the same places, where radii have grown as much
        target[i] = {source[i].x, source[i].y, source[i].z, any_radius(random) + growth * source[i].x};
      const double log10_probability = paired_maps(source, target).log10_probability(6);
      below_tenth += log10_probability < -1;
      below_hundredth += log10_probability < -2;
    }
    CAPTURE(growth, below_tenth, below_hundredth);
    CHECK(double(below_tenth) < 0.15 * trials);
    CHECK(double(below_hundredth) < 0.02 * trials);
  }
}

TEST_CASE("radii that are not known are no evidence") {
  random_source random(3);
  std::vector<trunk> source = random_trunks(random, 30), target = measured_again(source, random);
  const double known = paired_maps(source, target).log10_probability(10);
  for (std::size_t i = 5; i < 10; ++i) source[i].radius = std::nan("");
  const double of_half = paired_maps(source, target).log10_probability(10);
  CHECK(known < of_half);
  CHECK(of_half < 0);
  for (trunk& t : source) t.radius = 0;
  const paired_maps maps(source, target);
  CHECK_FALSE(radius_evidence(maps.context).is_known());
  CHECK(maps.log10_probability(10) == 0);
  CHECK(radius_evidence(maps.context).score(maps.first(10)).log10_nfa == -2);
  CHECK(paired_maps({}, {}).log10_probability(0) == 0);
}

TEST_CASE("with radii natural stands are registered from fewer common stems") {
  constexpr std::size_t common = 6, size = 40, seeds = 20;
  std::size_t with = 0, without = 0;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    random_source random(seed);
    std::vector<trunk> source = random_trunks(random, size), target = random_trunks(random, size);
    const std::vector<trunk> again = measured_again(source, random);
    for (std::size_t i = 0; i < common; ++i) target[i] = again[i];
    for (trunk& t : target) t.x += 0.07 * random.normal(), t.y += 0.07 * random.normal();
    const auto is_right = [&](const matching& result) {
      return result.target_from_source &&
             scenes::max_error(*result.target_from_source, Eigen::Isometry3d::Identity(),
                               {{source[0].x, source[0].y, source[0].z}}) < 0.5;
    };
    const matching by_both = match_stems(source, target);
    with += is_right(by_both);
    for (std::vector<trunk>* map : {&source, &target})
      for (trunk& t : *map) t.radius = 0;
    without += is_right(match_stems(source, target));
  }
  CAPTURE(with, without);
  CHECK(with >= without + 3);
}

}  // namespace globalmatch::test_radius_evidence
