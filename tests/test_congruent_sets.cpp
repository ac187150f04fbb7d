#include "baselines/congruent_sets.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>

#include "baseline_scenes.hpp"
#include "catch.hpp"
#include "oracles/brute_force_alignment.hpp"

namespace globalmatch::test_congruent_sets {

using namespace benchmarks;
using scenes::inlier_threshold;
using four_indices = std::array<stem_index, 4>;

const auto run = [](const two_maps& maps, const run_limits& limits) {
  return run_congruent_sets(maps, limits, inlier_threshold);
};

TEST_CASE("the lines of a base intersect where its ratios say") {
  const stem_alignment maps(scenes::small_maps(1, 30, 0.7), inlier_threshold);
  const congruent_sets sets(maps, {});
  random_source random(1);
  std::size_t bases = 0;
  for (int i = 0; i < 200; ++i) {
    const auto base = sets.draw_base(random);
    if (!base) continue;
    ++bases;
    const auto at = [&](std::size_t k) { return maps.source.at[base->stems[k]].xy(); };
    CHECK((between(at(0), at(1), base->r1) - between(at(2), at(3), base->r2)).norm() < 1e-6);
    CHECK(std::set(base->stems.begin(), base->stems.end()).size() == 4);
    CHECK(std::max(std::abs(base->r1 - 0.5), std::abs(base->r2 - 0.5)) <= 1);
  }
  CHECK(bases > 100);
}

/// Largest difference [m] of the distances of two sets of four stems.
double dissimilarity(const stem_alignment& maps, const four_indices& a, const four_indices& b) {
  double largest = 0;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = i + 1; j < 4; ++j)
      largest = std::max(largest, std::abs((maps.source.at[a[i]] - maps.source.at[a[j]]).xy().norm() -
                                           (maps.target.at[b[i]] - maps.target.at[b[j]]).xy().norm()));
  return largest;
}

std::array<correspondence, 4> pairs_of(const four_indices& a, const four_indices& b) {
  return {{{a[0], b[0]}, {a[1], b[1]}, {a[2], b[2]}, {a[3], b[3]}}};
}

/// Calls `visit` for all ordered sets of four target stems.
template <class Visit>
void for_each_four(std::size_t size, const Visit& visit) {
  for (stem_index i = 0; i < size; ++i)
    for (stem_index j = 0; j < size; ++j)
      for (stem_index k = 0; k < size; ++k)
        for (stem_index l = 0; l < size; ++l)
          if (std::set{i, j, k, l}.size() == 4) visit(four_indices{i, j, k, l});
}

TEST_CASE("ten stems, all in both maps, are found though few bases are within half their extent") {
  std::size_t found = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const two_maps maps = scenes::equal_maps(seed, 10);
    const auto transform = run(maps, {}).target_from_source;
    found += transform && scenes::is_right(run(maps, {}), maps);
  }
  CHECK(found == 40);
}

TEST_CASE("congruent sets are those of brute force over all sets of four stems") {
  std::size_t found_at_all = 0;
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    const stem_alignment maps(scenes::small_maps(seed, 12, 0.9), inlier_threshold);
    const congruent_sets sets(maps, {.extent_share = 1});
    random_source random(seed);
    for (int i = 0; i < 10; ++i) {
      INFO("seed " << seed << ", base " << i);
      const auto base = sets.draw_base(random);
      if (!base) continue;
      std::set<four_indices> found;
      sets.for_each(*base, [&](const std::array<correspondence, 4>& pairs) {
        found.insert({pairs[0].target, pairs[1].target, pairs[2].target, pairs[3].target});
      });
      found_at_all += found.size();
      for_each_four(maps.target.size(), [&](const four_indices& like) {
        const bool is_found = found.contains(like);
        if (dissimilarity(maps, base->stems, like) >= inlier_threshold) {
          CHECK_FALSE(is_found);
          return;
        }
        const auto pairs = pairs_of(base->stems, like);
        const auto transform = maps.context.fit(pairs);
        REQUIRE(transform);
        const auto residuals = maps.context.residuals(*transform, pairs);
        if (*std::max_element(residuals.begin(), residuals.end()) < 0.7 * inlier_threshold) CHECK(is_found);
      });
    }
  }
  CHECK(found_at_all > 10);
}

TEST_CASE("congruent sets find the transform on which as many stems agree as on the best of brute force") {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    INFO("seed " << seed);
    const auto maps = scenes::equal_maps(seed, 9);
    const stem_alignment alignment(maps, inlier_threshold);
    matching_funnel funnel;
    CHECK(best_congruent_set(alignment, funnel, {.extent_share = 1}).agreeing ==
          oracles::most_agreeing_stems(maps.source, maps.target, inlier_threshold,
                                       [](const auto&, const auto&) { return true; }));
  }
}

TEST_CASE("congruent sets take fewer bases the more stems agree, and are right where a third is common") {
  std::size_t right = 0, half = 0, whole = 0;
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const auto maps = scenes::small_maps(seed, 40, 0.5), equal = scenes::equal_maps(seed, 40);
    const match_run result = run(maps, {});
    right += scenes::is_right(result, maps);
    half += result.funnel.source_triangles;
    whole += run(equal, {}).funnel.source_triangles;
  }
  CHECK(right == 10);
  CHECK(whole < half);
  CHECK(bases_needed(1, 0.99) < 1);
  CHECK(bases_needed(0.5, 0.99) == Approx(std::log(0.01) / std::log(1 - 1.0 / 16)));
}

TEST_CASE("congruent sets register equal maps, in any order of their stems, and bear degenerate ones") {
  scenes::require_equal_maps_register(run);
  scenes::require_order_does_not_count(run);
  scenes::require_degenerate_maps_return(run);
}

TEST_CASE("congruent sets are stopped by their limits") {
  scenes::require_limits_stop(run, 1500);
  CHECK(run(scenes::small_maps(3, 40, 0.5), {.memory = 1000}).stopped);
}

}  // namespace globalmatch::test_congruent_sets
