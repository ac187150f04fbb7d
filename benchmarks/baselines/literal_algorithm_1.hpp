// Algorithm 1 as the paper writes it ([GM] 3.2.3), every two triangle pairs compared.
#pragma once

#include <globalmatch/detail/matching/verify.hpp>
#include <globalmatch/local_matching.hpp>
#include <globalmatch/triangles.hpp>

#include "baselines/stem_alignment.hpp"
#include "oracles/algorithm_1.hpp"

#include <algorithm>
#include <cstddef>

namespace globalmatch::benchmarks {

using namespace detail;

/// Algorithm 1 where `test(source, target)` returns what says which triangle pairs agree (line 5), and
/// verification on all stems.
template <class Test>
match_run run_consensus(const two_maps& maps, const run_limits& limits, double inlier_threshold,
                        const Test& test) {
  return run_within(limits, 0, [&](const execution& exec) {
    const stem_alignment both(maps, inlier_threshold);
    match_run run{.funnel = both.funnel()};
    report_progress(exec, "triangles", 0);
    const auto source_triangles = build_triangles(both.source, false, {}, exec);
    const auto target_triangles = build_triangles(both.target, false, {}, exec);
    const auto pairs = match_locally(source_triangles, target_triangles, inlier_threshold, exec);
    run.funnel.source_triangles = source_triangles.size();
    run.funnel.target_triangles = target_triangles.size();
    run.funnel.local_pairs = pairs.size();
    run.funnel.tested = pairs.size() * (pairs.size() - std::min<std::size_t>(pairs.size(), 1));
    report_progress(exec, "global matching", 0);
    const auto consensus = oracles::largest_consensus(pairs, test(both.source, both.target));
    if (const auto h = verify(both.context, consensus, inlier_threshold))
      run.target_from_source = in_scan_frames(h->target_from_source, both.source, both.target);
    return run;
  });
}

inline match_run run_literal_algorithm_1(const two_maps& maps, const run_limits& limits,
                                         double inlier_threshold) {
  return run_consensus(maps, limits, inlier_threshold, [&](const auto& source, const auto& target) {
    return oracles::globally_consistent(source, target, false, inlier_threshold);
  });
}

}  // namespace globalmatch::benchmarks
