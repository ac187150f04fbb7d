// Ways to match two stem maps, side by side: ours, and what it is measured against.
#pragma once

#include <globalmatch/stem_matching.hpp>

#include "baselines/centroid_test.hpp"
#include "baselines/coherent_point_drift.hpp"
#include "baselines/congruent_sets.hpp"
#include "baselines/fast_toa.hpp"
#include "baselines/literal_algorithm_1.hpp"
#include "baselines/toa.hpp"
#include "match_run.hpp"
#include "stem_layouts.hpp"

#ifdef GLOBALMATCH_BENCHMARK_ASTROALIGN
#include "baselines/astroalign.hpp"
#endif
#ifdef GLOBALMATCH_BENCHMARK_CLIPPER
#include "baselines/clipper.hpp"
#endif
#ifdef GLOBALMATCH_BENCHMARK_TEASER
#include "baselines/teaser.hpp"
#endif

#include <functional>
#include <string_view>
#include <vector>

namespace globalmatch::benchmarks {

using namespace detail;

/// `target` are stems or a prepared map; `memory` [bytes] is what the run is known to need.
template <class Target>
match_run run_match_stems(const positions& source, const Target& target, const matching_options& options,
                          const run_limits& limits, double memory = 0) {
  return run_within(limits, memory, [&](const execution& exec) {
    const matching result = match_stems(source, target, options, Eigen::Vector3d::UnitZ(), exec);
    return match_run{.target_from_source = result.target_from_source,
                     .funnel = result.funnel,
                     .stopped = result.outcome == outcome::cancelled};
  });
}

/// Algorithm 1 without looking at consensus sets that cannot win, at the paper's tolerance.
inline match_run run_algorithm_1(const two_maps& maps, const run_limits& limits, double inlier_threshold) {
  matching_options exact;
  exact.proposal = proposal::algorithm_1;
  exact.inlier_threshold = inlier_threshold;
  const double numbers = double(maps.source.size()) * double(maps.target.size());
  return run_match_stems(maps.source, maps.target, exact, limits, numbers * sizeof(std::uint32_t));
}

struct matcher {
  std::string_view name;
  std::function<match_run(const two_maps&, const run_limits&)> run;
};

/// `index` is `match_stems` with these options; the others have the paper's tolerance.
inline std::vector<matcher> all_matchers(const matching_options& options = {}) {
  constexpr double inlier_threshold = 0.05;
  const auto at_threshold = [&](const auto& run) {
    return
        [=](const two_maps& maps, const run_limits& limits) { return run(maps, limits, inlier_threshold); };
  };
  return {
      {"index",
       [options](const auto& maps, const auto& limits) {
         return run_match_stems(maps.source, maps.target, options, limits);
       }},
      {"algorithm_1", at_threshold(run_algorithm_1)},
      {"literal_algorithm_1", at_threshold(run_literal_algorithm_1)},
      {"centroid_test", at_threshold(run_centroid_test)},
      {"like_toa", at_threshold(run_toa)},
      {"like_fast_toa", at_threshold(run_fast_toa)},
      {"congruent_sets", at_threshold(run_congruent_sets)},
      {"coherent_point_drift", run_coherent_point_drift},
#ifdef GLOBALMATCH_BENCHMARK_ASTROALIGN
      {"astroalign", at_threshold(run_astroalign)},
#endif
#ifdef GLOBALMATCH_BENCHMARK_CLIPPER
      {"clipper", at_threshold([](const auto& maps, const auto& limits, double threshold) {
         return run_clipper(maps, limits, threshold);
       })},
#endif
#ifdef GLOBALMATCH_BENCHMARK_TEASER
      {"teaser", at_threshold([](const auto& maps, const auto& limits, double threshold) {
         return run_teaser(maps, limits, threshold);
       })},
#endif
  };
}

}  // namespace globalmatch::benchmarks
