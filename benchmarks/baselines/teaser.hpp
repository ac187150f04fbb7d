// TEASER++ (Yang, Shi, Carlone 2021, "TEASER: fast and certifiable point cloud registration", IEEE T-RO
// 37(2)) on all associations of stems in plan: the largest clique of associations whose lengths agree, by
// their own program, rotation about the vertical alone (Quatro). Ours: stems without heights; the least
// squares over all agreeing stems in the end.
#pragma once

#include "baselines/consistent_associations.hpp"

#include <teaser/registration.h>

#include <cmath>
#include <cstddef>
#include <vector>

namespace globalmatch::benchmarks {

struct teaser_options {
  std::size_t max_associations = 4000;  ///< as all pairs of them are made
};

/// The search cannot be stopped: one that took too long counts as stopped in the end.
inline match_run run_teaser(const two_maps& maps, const run_limits& limits, double inlier_threshold,
                            const teaser_options& options = {}) {
  const stem_alignment alignment(maps, inlier_threshold);
  match_run run = run_within(limits, 0, [&](const execution& exec) {
    match_run result{.funnel = alignment.funnel()};
    const consistent_associations associations(alignment);
    result.stopped = associations.size() > options.max_associations;
    if (result.stopped || associations.count() == 0) return result;
    Eigen::Matrix3Xd source(3, Eigen::Index(associations.size())), target(source);
    for (std::size_t a = 0; a < associations.size(); ++a) {
      const correspondence c = associations[a];
      const vec2 from = alignment.source.at[c.source].xy(), to = alignment.target.at[c.target].xy();
      source.col(Eigen::Index(a)) << from.x, from.y, 0;
      target.col(Eigen::Index(a)) << to.x, to.y, 0;
    }
    teaser::RobustRegistrationSolver::Params params;
    params.noise_bound = inlier_threshold / 2;  // lengths may differ by twice the bound of a stem
    params.estimate_scaling = false;
    params.rotation_estimation_algorithm =
        teaser::RobustRegistrationSolver::ROTATION_ESTIMATION_ALGORITHM::QUATRO;
    params.max_clique_num_threads = int(thread_count(exec));
    if (std::isfinite(limits.seconds)) params.max_clique_time_limit = limits.seconds;
    teaser::RobustRegistrationSolver solver(params);
    solver.solve(source, target);
    std::vector<correspondence> clique;
    for (const int node : solver.getInlierMaxClique()) clique.push_back(associations[std::size_t(node)]);
    result.funnel.consensus = clique.size();
    result.target_from_source = transform_of(alignment, clique);
    return result;
  });
  if (run.seconds > limits.seconds) run.stopped = true, run.target_from_source.reset();
  return run;
}

}  // namespace globalmatch::benchmarks
