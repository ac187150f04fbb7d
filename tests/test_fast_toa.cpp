#include "baselines/fast_toa.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "baseline_scenes.hpp"
#include "baselines/toa.hpp"
#include "catch.hpp"
#include "oracles/brute_force_alignment.hpp"

namespace globalmatch::test_fast_toa {

using namespace benchmarks;
using scenes::inlier_threshold;

const auto run = [](const two_maps& maps, const run_limits& limits) {
  return run_fast_toa(maps, limits, inlier_threshold);
};

constexpr std::size_t never = std::numeric_limits<std::size_t>::max();

TEST_CASE(
    "Fast-TOA without early termination finds as many agreeing stems as brute force over wide triplets") {
  constexpr double min_width = 0.5;
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    INFO("seed " << seed);
    for (const auto& given : {scenes::small_maps(seed, 9, 0.8), scenes::unrelated_maps(seed, 9)}) {
      const two_maps maps = scenes::without_radii(given);
      const stem_alignment alignment(maps, inlier_threshold);
      matching_funnel funnel;
      const auto best =
          first_sufficient(alignment, funnel, {.min_width = min_width, .min_sufficient = never});
      CHECK(funnel.tested == funnel.local_pairs);
      CHECK(best.agreeing == oracles::most_agreeing_stems(
                                 maps.source, maps.target, inlier_threshold,
                                 [&](const oracles::stem_triplet& s, const oracles::stem_triplet& t) {
                                   return std::min(oracles::horizontal_width(maps.source, s),
                                                   oracles::horizontal_width(maps.target, t)) >= min_width;
                                 }));
    }
  }
}

TEST_CASE("Fast-TOA ends at the first transform on which enough stems agree") {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    INFO("seed " << seed);
    const auto maps = scenes::small_maps(seed, 30, 0.7);
    const stem_alignment alignment(maps, inlier_threshold);
    matching_funnel funnel;
    const auto best = first_sufficient(alignment, funnel, {.sufficient_share = 0.3, .min_sufficient = 6});
    const double smaller = double(std::min(alignment.source.size(), alignment.target.size()));
    CHECK(double(best.agreeing) >= 0.3 * smaller);
    CHECK(best.agreeing >= 6);
    CHECK(funnel.tested < funnel.local_pairs);
    CHECK(scenes::is_right(run(maps, {}), maps));
  }
}

TEST_CASE("Fast-TOA tries no more triplets than TOA") {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    INFO("seed " << seed);
    for (const auto& maps : {scenes::small_maps(seed, 20, 0.5), scenes::unrelated_maps(seed, 20)}) {
      const auto fast = run(maps, {}).funnel, exhaustive = run_toa(maps, {}, inlier_threshold).funnel;
      CHECK(fast.source_triangles < exhaustive.source_triangles);
      CHECK(fast.tested <= exhaustive.tested);
    }
  }
}

TEST_CASE("Fast-TOA registers equal maps, in any order of their stems, and bears degenerate ones") {
  scenes::require_equal_maps_register(run);
  scenes::require_order_does_not_count(run);
  scenes::require_degenerate_maps_return(run);
}

TEST_CASE("Fast-TOA is stopped by its limits") {
  scenes::require_limits_stop(run, 200);
  CHECK(run(scenes::small_maps(3, 40, 0.5), {.memory = 1000}).stopped);
}

}  // namespace globalmatch::test_fast_toa
