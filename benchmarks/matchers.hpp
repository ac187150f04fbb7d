// Ways to match two stem maps, side by side: ours, and what it is measured against.
#pragma once

#include <globalmatch/detail/matching/verify.hpp>
#include <globalmatch/stem_matching.hpp>

#include "oracles/algorithm_1.hpp"
#include "peak_memory.hpp"
#include "stem_layouts.hpp"
#include "support/programs/reports.hpp"
#include "triplet_search.hpp"

#include <algorithm>
#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace globalmatch::benchmarks {

using namespace detail;

/// What a matcher made of two maps.
struct match_run {
  std::optional<Eigen::Isometry3d> target_from_source = {};
  matching_funnel funnel = {};
  double seconds = 0, peak_memory = 0;  // peak in [MB]
  nlohmann::ordered_json stages = {};   // seconds of each
};

/// `target` are stems or a prepared map.
template <class Target>
match_run run_match_stems(const positions& source, const Target& target, const matching_options& options,
                          int threads) {
  support::stage_clock clock;
  const matching result =
      match_stems(source, target, options, Eigen::Vector3d::UnitZ(), clock.listen(threads));
  match_run run{.target_from_source = result.target_from_source, .funnel = result.funnel};
  run.seconds = clock.seconds();
  run.stages = clock.stages();
  return run;
}

/// Algorithm 1 as the paper writes it, every pair of triangle pairs compared; local pairs by table.
inline match_run run_literal_algorithm_1(const two_maps& maps, double inlier_threshold, int threads) {
  support::stage_clock clock;
  const execution exec = clock.listen(threads);
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const position_set source = import_positions(maps.source, up, "source");
  const position_set target = import_positions(maps.target, up, "target");
  report_progress(exec, "triangles", 0);
  const auto source_triangles = build_triangles(source, false);
  const auto target_triangles = build_triangles(target, false);
  const auto pairs = match_locally(source_triangles, target_triangles, inlier_threshold, exec);
  report_progress(exec, "global matching", 0);
  const auto consensus = oracles::largest_consensus(source, target, pairs, false, inlier_threshold);
  match_run run;
  const matching_context both(source, target, false, degrees_of_freedom::four);
  if (const auto h = verify(both, consensus, inlier_threshold))
    run.target_from_source = in_scan_frames(h->target_from_source, source, target);
  run.funnel = {.source_stems = source.size(),
                .target_stems = target.size(),
                .source_triangles = source_triangles.size(),
                .target_triangles = target_triangles.size(),
                .local_pairs = pairs.size(),
                .tested = pairs.size() * (pairs.size() - std::min<std::size_t>(pairs.size(), 1))};
  run.seconds = clock.seconds();
  run.stages = clock.stages();
  return run;
}

inline match_run run_triplet_search(const two_maps& maps, double inlier_threshold) {
  const support::stage_clock clock;
  const triplet_match result = match_all_triplets(maps.source, maps.target, inlier_threshold);
  match_run run{.target_from_source = result.target_from_source};
  run.funnel = {.source_stems = maps.source.size(),
                .target_stems = maps.target.size(),
                .source_triangles = result.source_triplets,
                .target_triangles = result.target_triplets,
                .local_pairs = result.like_pairs,
                .tested = result.like_pairs};
  run.seconds = clock.seconds();
  return run;
}

struct matcher {
  std::string_view name;
  std::size_t max_stems;  ///< that it can bear
  std::function<match_run(const two_maps&, int threads)> run;
};

/// `index` is `match_stems` with default options; the others have the paper's tolerance.
inline std::vector<matcher> all_matchers() {
  constexpr double inlier_threshold = 0.05;
  constexpr std::size_t any = std::numeric_limits<std::size_t>::max();
  matching_options exact;
  exact.proposal = proposal::algorithm_1;
  exact.inlier_threshold = inlier_threshold;
  return {
      {"index", any,
       [](const auto& maps, int threads) { return run_match_stems(maps.source, maps.target, {}, threads); }},
      {"algorithm_1", 2000,
       [=](const auto& maps, int threads) {
         return run_match_stems(maps.source, maps.target, exact, threads);
       }},
      {"literal_algorithm_1", 500,
       [=](const auto& maps, int threads) {
         return run_literal_algorithm_1(maps, inlier_threshold, threads);
       }},
      {"triplets", 200, [=](const auto& maps, int) { return run_triplet_search(maps, inlier_threshold); }},
  };
}

}  // namespace globalmatch::benchmarks
