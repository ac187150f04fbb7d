// Small pairs of maps for the baselines of the benchmarks, and what each of them must bear.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "catch.hpp"
#include "globalmatch/detail/core/random.hpp"
#include "match_run.hpp"
#include "stem_layouts.hpp"

namespace globalmatch::scenes {

constexpr double inlier_threshold = 0.05;  // [m]

/// A forest seen twice, radii measured to 1 cm.
inline benchmarks::two_maps small_maps(std::uint64_t seed, std::size_t stems, double overlap,
                                       const benchmarks::view_options& view = {.radius_noise = 0.01}) {
  detail::random_source random(seed);
  return benchmarks::overlapping_maps("random", stems, overlap, view, random);
}

/// The same stems in both maps, exactly.
inline benchmarks::two_maps equal_maps(std::uint64_t seed, std::size_t stems) {
  return small_maps(seed, stems, 1, {.noise = 0, .detected = 1, .false_stems = 0, .radius_noise = 0});
}

/// Maps of two forests.
inline benchmarks::two_maps unrelated_maps(std::uint64_t seed, std::size_t stems) {
  auto maps = small_maps(seed, stems, 0.5), other = small_maps(seed + 1000, stems, 0.5);
  maps.target = other.target;
  maps.target_radii = other.target_radii;
  return maps;
}

/// Stems, and radii if any, in another order.
inline void shuffle(benchmarks::positions& stems, std::vector<double>& radii, detail::random_source& random) {
  for (std::size_t i = stems.size(); i > 1; --i) {
    const std::size_t j = random.below(static_cast<std::uint32_t>(i));
    std::swap(stems[i - 1], stems[j]);
    if (!radii.empty()) std::swap(radii[i - 1], radii[j]);
  }
}

inline benchmarks::two_maps without_radii(benchmarks::two_maps maps) {
  maps.source_radii.clear();
  maps.target_radii.clear();
  return maps;
}

inline bool is_right(const benchmarks::match_run& run, const benchmarks::two_maps& maps) {
  return run.target_from_source &&
         benchmarks::max_error(*run.target_from_source, maps.target_from_source, maps.source) < 0.3;
}

/// `run(maps, limits)` finds the transform of equal maps.
template <class Run>
void require_equal_maps_register(const Run& run) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    INFO("seed " << seed);
    const auto maps = equal_maps(seed, 12);
    const benchmarks::match_run result = run(maps, benchmarks::run_limits{});
    REQUIRE(result.target_from_source);
    CHECK(benchmarks::max_error(*result.target_from_source, maps.target_from_source, maps.source) < 1e-3);
    CHECK_FALSE(result.stopped);
  }
}

/// `run(maps, limits)` gives the same bits whatever the order of the stems.
template <class Run>
void require_order_does_not_count(const Run& run) {
  detail::random_source random(7);
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    INFO("seed " << seed);
    auto maps = small_maps(seed, 16, 0.7);
    const auto in_order = run(maps, benchmarks::run_limits{}).target_from_source;
    shuffle(maps.source, maps.source_radii, random);
    shuffle(maps.target, maps.target_radii, random);
    const auto shuffled = run(maps, benchmarks::run_limits{}).target_from_source;
    REQUIRE(in_order.has_value() == shuffled.has_value());
    if (in_order) CHECK(in_order->matrix() == shuffled->matrix());
  }
}

/// `run(maps, limits)` refuses maps of fewer than three stems, and returns for stems on a line, or at one
/// place.
template <class Run>
void require_degenerate_maps_return(const Run& run) {
  for (std::size_t stems = 0; stems < 3; ++stems) {
    INFO(stems << " stems");
    benchmarks::two_maps few = equal_maps(1, 12);
    few.source_radii.clear();
    few.source.resize(stems);
    CHECK_FALSE(run(few, benchmarks::run_limits{}).target_from_source);
    std::swap(few.source, few.target);
    std::swap(few.source_radii, few.target_radii);
    CHECK_FALSE(run(few, benchmarks::run_limits{}).target_from_source);
  }
  benchmarks::two_maps line, place;
  for (int i = 0; i < 8; ++i) {
    line.source.push_back({1.7 * i + 0.1 * i * i, 0, 0});
    place.source.push_back({1, 2, 3});
  }
  line.target = line.source;
  place.target = place.source;
  const auto on_a_line = run(line, benchmarks::run_limits{});
  if (on_a_line.target_from_source) CHECK(on_a_line.target_from_source->matrix().allFinite());
  CHECK_FALSE(run(place, benchmarks::run_limits{}).target_from_source);
}

/// `run(maps, limits)` stops once its time is up, or where it is known to need too much memory.
template <class Run>
void require_limits_stop(const Run& run, std::size_t stems) {
  const auto maps = small_maps(3, stems, 0.5);
  const auto late = run(maps, benchmarks::run_limits{.seconds = 1e-6});
  CHECK(late.stopped);
  CHECK_FALSE(late.target_from_source);
  CHECK_FALSE(run(small_maps(3, 8, 0.5), benchmarks::run_limits{.seconds = 600}).stopped);
}

}  // namespace globalmatch::scenes
