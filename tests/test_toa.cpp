#include "baselines/toa.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "baseline_scenes.hpp"
#include "catch.hpp"
#include "oracles/brute_force_alignment.hpp"

namespace globalmatch::test_toa {

using namespace benchmarks;
using scenes::inlier_threshold;

const auto run = [](const two_maps& maps, const run_limits& limits) {
  return run_toa(maps, limits, inlier_threshold);
};

scored_transform best_of(const two_maps& maps) {
  const stem_alignment alignment(maps, inlier_threshold);
  matching_funnel funnel;
  return best_of_triplets(alignment, funnel);
}

/// The oracle, radii within 30 % of the larger where they are measured.
std::size_t most_agreeing(const two_maps& maps) {
  return oracles::most_agreeing_stems(maps.source, maps.target, inlier_threshold,
                                      [&](const oracles::stem_triplet& s, const oracles::stem_triplet& t) {
                                        for (std::size_t i = 0; i < 3 && !maps.source_radii.empty(); ++i) {
                                          const double a = maps.source_radii[s[i]],
                                                       b = maps.target_radii[t[i]];
                                          if (std::abs(a - b) > 0.3 * std::max(a, b)) return false;
                                        }
                                        return true;
                                      });
}

TEST_CASE("TOA finds the transform on which as many stems agree as on the best of brute force") {
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    INFO("seed " << seed);
    for (const auto& maps : {scenes::small_maps(seed, 9, 0.8), scenes::unrelated_maps(seed, 9)}) {
      CHECK(best_of(maps).agreeing == most_agreeing(maps));
      CHECK(best_of(scenes::without_radii(maps)).agreeing == most_agreeing(scenes::without_radii(maps)));
    }
  }
}

TEST_CASE(
    "TOA tries every two triplets that are alike, and their transform is right where stems are common") {
  std::size_t right = 0;
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const auto maps = scenes::small_maps(seed, 30, 0.5);
    const match_run result = run(maps, {});
    const matching_funnel& f = result.funnel;
    CHECK(f.source_triangles == triplet_count(f.source_stems - f.source_coincident));
    CHECK(f.target_triangles == triplet_count(f.target_stems - f.target_coincident));
    CHECK(f.tested == f.local_pairs);
    right += scenes::is_right(result, maps);
  }
  CHECK(right == 10);
}

TEST_CASE("TOA tries fewer triplets where radii are measured, and none where they all differ") {
  auto maps = scenes::small_maps(1, 20, 0.7);
  const std::size_t by_edges = run(scenes::without_radii(maps), {}).funnel.tested;
  CHECK(run(maps, {}).funnel.tested < by_edges);
  CHECK(run(maps, {}).funnel.tested > 0);
  for (double& radius : maps.target_radii) radius = 1;
  CHECK(run(maps, {}).funnel.tested == 0);
  CHECK_FALSE(run(maps, {}).target_from_source);
  for (double& radius : maps.target_radii) radius = 0;
  CHECK(run(maps, {}).funnel.tested == by_edges);
}

TEST_CASE("TOA registers equal maps, in any order of their stems, and bears degenerate ones") {
  scenes::require_equal_maps_register(run);
  scenes::require_order_does_not_count(run);
  scenes::require_degenerate_maps_return(run);
}

TEST_CASE("TOA is stopped by its limits") {
  scenes::require_limits_stop(run, 200);
  CHECK(run(scenes::small_maps(3, 40, 0.5), {.memory = 1000}).stopped);
}

}  // namespace globalmatch::test_toa
